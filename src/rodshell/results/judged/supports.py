"""Rod ends that something other than the ground may have to hold: along open arches, free edges and openings."""

from collections.abc import Iterator

import numpy as np

from rodshell.arrays import Floats
from rodshell.figures.checks import EndsInTheAir
from rodshell.figures.findings import Said, said
from rodshell.figures.loads import UsedBeam
from rodshell.figures.records import Ends
from rodshell.results.results import Results
from rodshell.results.wording import newtons, percent, rounded, shown_length, too_much
from rodshell.rods.support_groups import SupportGroups, unheld

ABOVE = 0.02  # of the size: higher ends are not on the level of the lowest


def in_the_air(results: Results) -> EndsInTheAir | None:
    """The rod ends that lie clearly higher than the lowest; None where it is not known where the ends are."""
    heights = [point[2] for point in results.boundary]
    known = [z for z in heights if z is not None]
    if not known:
        return None
    size = (results.target.reference_size if results.target else None) or width(results) / 2
    seams = {end for seam in results.seams for meeting in seam.meetings for end in meeting.ends}
    held = {k for k, name in enumerate(results.rod_ends) if name in seams}
    for of_supports in [*_forces(results)][:1]:
        held |= {*np.flatnonzero(unheld(of_supports)).tolist()}
    ground = min(known)
    above = [k for k, z in enumerate(heights) if z is not None and z - ground > ABOVE * size and k not in held]
    forces = [float(np.linalg.norm(np.nan_to_num(row[k]))) for row in _forces(results) for k in above]
    highest = max((heights[k] or 0.0) - ground for k in above) if above else 0.0
    return EndsInTheAir(count=len(above), highest=highest, largest_force=max(forces, default=None))


def width(results: Results) -> float:
    """Longest side in plan of what the shell stands on [m]."""
    columns = [[point[axis] for point in results.boundary] for axis in (0, 1)]
    known = [[value for value in column if value is not None] for column in columns]
    return max((max(column) - min(column) for column in known if column), default=0.0)


def share_of_span(results: Results, deflection: float | None) -> str:
    """A deflection [m] as a part of the smaller width of the plan, such as "span/250"; "" where one is not known."""
    points = np.array(results.boundary, dtype=float).reshape(-1, 3)
    if not deflection or not len(points):
        return ""
    return f"span/{float(np.ptp(points[:, :2], axis=0).min()) / deflection:.0f}"


def beam_faults(results: Results, ends: Ends) -> Iterator[Said]:
    """Beams along the edge that use more than their strength, or buckle between two rod ends: they have no node there,
    so that no path of the shell knows of it."""
    for under, _, beam in _used_beams(results) if ends == SupportGroups.name else ():
        for name, share in (("strength_of_beam", beam.utilisation), ("strength_of_beam: buckles", beam.euler)):
            if (share or 0.0) > 1:
                yield said(
                    name, ends, share, 1, place=beam.max_stress_at, beam=beam.name, under=under,
                    share=too_much(share or 0.0),
                )  # fmt: skip


def beams_to_check(results: Results) -> Iterator[Said]:
    """Beams that carry their spans without the reserve that is asked for, or whose strength is not known."""
    for under, reserve, beam in _used_beams(results):
        if 1.0 / reserve < (share := beam.euler or 0.0) <= 1:
            yield said(
                "reserve_under_loads: beam", SupportGroups.name, share, 1.0 / reserve, place=beam.max_stress_at,
                beam=beam.name, under=under, share=percent(share), asked=rounded(reserve), most=percent(1.0 / reserve),
            )  # fmt: skip
        if beam.utilisation is None:
            yield said("no_strength: others", place="edge beam", what="beams along the edge")


def _used_beams(results: Results) -> Iterator[tuple[str, float, UsedBeam]]:
    """Each beam without loads and under each combination: under what, in words, with which reserve, and its use."""
    for beam in results.edge_beams:
        if beam.unloaded is not None:
            yield "before loads act", 1.0, beam.unloaded
    for name, _, shell in results.loaded_shells():
        yield from ((f"under {name}", shell.reserve or 1.0, beam) for beam in shell.edge_beams)


def _forces(results: Results) -> Iterator[Floats]:
    """(2m, 3) forces of the supports, without loads and under each combination, with every end condition."""
    unloaded = {ends: held.forces for ends, held in results.reactions.items()}
    found = [*unloaded.items(), *((ends, shell.support_forces) for _, ends, shell in results.loaded_shells())]
    given = SupportGroups.name in unloaded  # then pinned and clamped ends are for comparison
    for forces in (forces for ends, forces in found if not given or ends == SupportGroups.name):
        if len(forces) == len(results.boundary):
            yield forces


def air_findings(results: Results) -> Iterator[Said]:
    """What has to hold rod ends that do not stand on the ground."""
    found = results.ends_in_the_air or in_the_air(results)
    if found is None or not found.count:
        return
    high = shown_length(results)(found.highest)
    force = found.largest_force
    under = "those under the loads among them" if results.loads else "before own weight and loads act"
    against = "" if force is None else f" against forces of up to {newtons(force)} each, {under}"
    yields = any(held.figures for held in results.reactions.values())
    stiff = "stiff as the supports that were given" if yields else "rigid"
    yield said(
        "ends_in_the_air", None, found.highest, 0, "m", stiff=stiff,
        count=found.count, all=len(results.boundary), high=high, against=against,
    )  # fmt: skip
