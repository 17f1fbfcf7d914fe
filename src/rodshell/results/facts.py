"""What was found, in sentences that judge nothing: gaps, supports, strength."""

from collections.abc import Iterator

from rodshell.figures.checks import Deployment
from rodshell.figures.records import Ends
from rodshell.results.judged.deployment import unknown_below
from rodshell.results.judged.loads import is_braced
from rodshell.results.judged.shape import CONVERGED, OFF
from rodshell.results.judged.stress import by_design_strength, utilisation
from rodshell.results.results import Results
from rodshell.results.verdict import shell_faults
from rodshell.results.wording import drawn_length, percent, rounded, whole_percent
from rodshell.rods.supports import clamped_among, finals_first

MUCH_LESS = 0.5  # clamped supports are recommended when they leave less than this share of the pinned gap,
NEGLIGIBLE = 1e-3  # unless that gap is below this share of the target's size already


def facts(results: Results) -> list[str]:
    """All of them."""
    return [*_gaps(results), *_strength(results)]


def _gaps(results: Results) -> Iterator[str]:
    """How near the converged shells come to the target, and which of two supports that can be used is worth it."""
    known = dict[Ends, float]()
    for ends in finals_first(results.agreement):
        gap, shell = results.agreement[ends], results.pop_up.get(ends)
        if gap.max is not None and shell is not None and shell.status == CONVERGED:
            known[ends] = gap.max
            share = "" if gap.max_relative is None else f" ({percent(gap.max_relative)} of its size)"
            yield f"With {ends} ends the largest gap to the target is {drawn_length(results, gap.max)}{share}."
    clamped, pinned = clamped_among(known), clamped_among(known, False)
    if clamped and pinned and not any([*shell_faults(results, ends)] for ends in results.pop_up):
        relative = results.agreement[pinned].max_relative
        held = f"Supports that hold the rods' directions ({clamped})"
        if known[clamped] < MUCH_LESS * known[pinned] and (relative is None or relative > NEGLIGIBLE):
            yield f"{held} leave {percent(known[clamped] / known[pinned])} of the gap that {pinned} ones leave."
        elif relative is None or relative <= OFF:
            yield f"{held} bring the unloaded shell little nearer to the target."
    elif results.pop_up and not results.target:
        yield "This result has no target, so no gap can be stated."


def _strength(results: Results) -> Iterator[str]:
    """How much of the strength is used, and in which shapes that is known."""
    used = utilisation(results)
    if used is not None:
        where = _known(results.deployment, unknown_below(results))
        design = "design " if by_design_strength(results) else ""
        yield f"Unloaded, the rods use {percent(used)} of their {design}strength at most, {where}"
    elif results.bending and results.bending.strength is not None:
        yield "How much of their strength the rods use is not known, since no shell was found."
    elif results.bending:
        yield "No strength was given, so it is not known whether the rods hold (checks.strength)."


def _known(deployment: Deployment | None, unknown: float) -> str:
    """In which shapes the stress is known; no more is said of the deployment than was followed."""
    if not deployment:
        return "in the final shape; the deployment from flat was not followed."
    if unknown >= 1:
        return "in the final shape; for the deployment, which could not be followed, the stress is not known."
    if unknown:
        return (
            f"in the final shape and above {whole_percent(unknown)} of the deployment; below that share the stress is "
            "not known."
        )
    if deployment.guided:
        low, high = (whole_percent(share) for share in deployment.guided)
        return (
            f"in the final shape and the stages of the deployment; the stress while the shell is guided from {low} to "
            f"{high} is not known."
        )
    if deployment.snaps:
        return "in the final shape and the stages of the deployment; the stress during a snap is not known."
    return "deployment included."


def mass_text(results: Results) -> str:
    """The mass of rods and joints, and that of beams along the edge; "" where it is not known."""
    mass = results.fabrication.total_mass if results.fabrication else None
    beams = sum(beam.mass or 0.0 for beam in results.edge_beams)
    if mass is None:
        return ""
    said = f"{rounded(mass)} kg{' without its bracing' if is_braced(results) else ''}"
    return said + (f" and beams of {rounded(beams)} kg along the edge" if beams else "")
