"""How the shell is erected: from flat on the way that was computed, on another, or in place."""

from collections.abc import Iterator

from rodshell.figures.findings import Said, said
from rodshell.figures.records import Ends
from rodshell.figures.sentences import ANOTHER_WAY
from rodshell.results.judged.own_weight import reserve
from rodshell.results.judged.shape import CONVERGED, contact_faults, met_on_the_way, shape_words, status_of
from rodshell.results.judged.stress import bent_of, fibre_faults, holds_while_erected, strength_name
from rodshell.results.results import Results
from rodshell.results.wording import percent, too_much
from rodshell.rods.supports import PINNED, clamped_among

MOST_THINNER = 2.0  # what rods use of their strength while erected, up to which thinner ones are spoken of


def unknown_below(results: Results) -> float:
    """Share of the deployment below which nothing is known: 0 all was followed, 1 only the final shape is known."""
    deployment = results.deployment
    if deployment and deployment.lost_at is None:
        return 0.0
    return min((stage.share for stage in (deployment.stages if deployment else ()) if stage.share > 0), default=1.0)


def erection_faults(results: Results) -> Iterator[Said]:
    """What the rods do not withstand on the way that was computed, and other ways, which may spare them."""
    bent, asked = bent_of(results, "deployment"), reserve(results)
    borne = [each.load_factor for each in results.self_weight.values() if each.load_factor is not None]
    used = bent.utilisation
    # else its own weight asks for thicker ones, or they would have to be so thin that it soon does
    thinner = min(borne, default=asked) >= asked and (used or 0.0) <= MOST_THINNER
    faults = [*fibre_faults(results, "deployment")]
    if used is not None and used > 1 and holds_while_erected(results, used):
        faults.append(said(
            "strength", None, used, 1, place=bent.rod, shape=shape_words("deployment", bent), share=too_much(used),
            whose=strength_name(results, "deployment"), where="",
        ))  # fmt: skip
    if met_on_the_way(results):
        faults += contact_faults(results, "deployment")
    for k, fault in enumerate(faults, start=1):
        other_way = ANOTHER_WAY + ", or use thinner rods" * thinner if k == len(faults) else ""
        yield Said(fault + other_way, fault.finding.changed(code=f"erection_{fault.finding.code}"))


def deployment_points(results: Results, usable: list[Ends], *, late: bool) -> Iterator[Said]:
    """Whether the deployment was checked; what was found there is among a result's warnings."""
    deployment, flat = results.deployment, results.flat_state
    if flat is not None and not flat.lies_flat:
        return  # it is assembled in place
    if not deployment:
        remedy = "" if late else f": this needs {PINNED} ends (pop_up.ends) and checks.stages above 0"
        upright = clamped_among(results.pop_up, False)
        failed = upright and status_of(results.pop_up[upright]) != CONVERGED
        why = f", since the {upright} shell was not found" if failed else remedy
        yield said("not_checked: deployment", why=why)
    elif (
        (clamped := clamped_among(usable))
        and deployment.reached_from_flat
        and (deployment.clamped is None or deployment.clamped.reached_from_flat is None)
    ):
        yield said("not_checked: clamped", clamped, pinned=deployment.ends or PINNED)


def laid_out(results: Results) -> Iterator[Said]:
    """Whether rods along curves of the target can be laid out flat, which decides how the shell is erected."""
    if flat := results.flat_state:
        strain, limit = flat.in_plane_strain, flat.limit or 0.0
        sentence = "lies_flat" if flat.lies_flat else "in_place" if (strain or 0.0) > limit else "in_place: unstable"
        yield said(sentence, None, strain, limit, bent=percent(strain or 0.0), withstood=percent(limit))
