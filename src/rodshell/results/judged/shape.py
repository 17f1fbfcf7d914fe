"""Whether there is a shell, and of which shape: found, stable, near the target, alone, with rods that do not touch."""

from collections.abc import Iterator

from rodshell.figures.checks import OTHER_SHAPES, Clearance, WorstBent
from rodshell.figures.findings import Said, said
from rodshell.figures.form import Agreement, PopUp
from rodshell.figures.records import Ends
from rodshell.results.results import Results
from rodshell.results.wording import drawn_length, percent, place, rounded, rounding_of, whole_percent
from rodshell.rods.supports import clamped_among

FAR_OFF, OFF = 0.05, 0.02  # largest gap over the size: another shape than the target; with clamped ends a convex shell
# leaves a tenth of the second
NEAR, AKIN = 0.6, 1.5  # distance over the size and energy ratio below which another stable shape may be met by accident
CONVERGED, BUCKLED = "converged", "buckled"  # statuses that say something about the shell: it crumples in the second


def status_of(shell: PopUp | None) -> str:
    """Of a shell; those of the first versions that kept none had converged."""
    return (shell.status if shell else None) or CONVERGED


def support_of(shape: str) -> Ends | None:
    """The support of a shape; None for the flat grid and the deployment."""
    return None if shape in OTHER_SHAPES else shape


def shape_words(shape: str, found: WorstBent | Clearance) -> str:
    """The shape that a sentence is about."""
    if shape not in OTHER_SHAPES:
        return f"with {shape} ends"
    return "during deployment" if found.share is None else f"at {whole_percent(found.share)} of the deployment"


def unstable(shell: PopUp, ends: Ends) -> Iterator[Said]:
    """That the shell with these ends buckles without loads."""
    if shell.stable is False:
        modes = shell.negative_modes
        count = f" ({modes} buckling mode{'s' if modes != 1 else ''})" if modes else ""
        yield said("unstable", ends, modes, 0, count=count)


def nearest(results: Results, usable: list[Ends]) -> tuple[Ends, Agreement] | None:
    """Of the shells that can be used the nearest to the target, and its gap; None without a target."""
    known = {ends: gap for ends, gap in results.agreement.items() if ends in usable and gap.max_relative is not None}
    return min(known.items(), key=lambda pair: pair[1].max_relative or 0.0, default=None)


def off_target(results: Results, ends: Ends, gap: Agreement) -> Said:
    """How far the best shell deviates; with clamped ends a convex shell fits the target, and dips are the cause."""
    where = f", near ({place(gap.where, rounding_of(results))})" if gap.where else ""
    drape = results.drape
    strong = drape.strong_bending if drape else None
    buckles = strong is not None and (strong.beyond or 0.0) > 0
    kind = (results.joint.kind if results.joint else None) or "ball"
    against_shear = kind not in ("ball", "pin")
    bound = drape is not None and drape.method == "bound"
    dips = clamped_among([ends]) and bound and not buckles and not against_shear
    advice = ": dips and ridges need seams, graded stiffness or supports" if dips else ""
    return said(
        "off_target", ends, gap.max_relative, OFF,
        gap=drawn_length(results, gap.max), share=percent(gap.max_relative), where=where, advice=advice,
    )  # fmt: skip


def sinking(results: Results, usable: list[Ends]) -> list[Said]:
    """That every shell that can be used takes another shape under its own weight: gaps are those without weight."""
    sizes = [gap.max / gap.max_relative for gap in results.agreement.values() if gap.max and gap.max_relative]
    sunk = {ends: results.self_weight[ends].deflection for ends in usable if ends in results.self_weight}
    known = {ends: depth for ends, depth in sunk.items() if depth is not None}
    if not sizes or not known or min(known.values()) <= OFF * sizes[0]:
        return []
    (ends, depth), *others = sorted(known.items(), key=lambda pair: pair[1])
    further = "".join(f", by {drawn_length(results, more)} with {other} ends" for other, more in others)
    share = depth / sizes[0]
    return [said("sinks", ends, share, OFF, depth=drawn_length(results, depth), share=percent(share), further=further)]


def near_shapes(results: Results, usable: list[Ends]) -> Iterator[Said]:
    for ends, searched in results.other_shapes.items():
        near = [
            (shape.distance, shape.energy)
            for shape in searched.found
            if not shape.mirror and shape.distance is not None and shape.energy is not None
            if shape.distance < NEAR and shape.energy < AKIN
        ]
        if ends in usable and near:
            distance, energy = min(near, key=lambda pair: pair[0])
            yield said("other_shape", ends, distance, NEAR, distance=percent(distance), energy=rounded(energy))


def contact_faults(results: Results, shape: str) -> Iterator[Said]:
    touching = results.contact.of(shape) if results.contact else None
    if not touching or not touching.pairs:
        return
    first, second = touching.rods or ("a rod", "another")
    rods = f"{first} and {second} overlap" if first != second else f"{first} runs into itself"
    worst = f"{touching.pairs} pairs of rods touch or cross, worst: " if touching.pairs > 1 else "rods touch: "
    where = f" near ({place(touching.where, rounding_of(results))})" if touching.where else ""
    yield said(
        "contact", support_of(shape), touching.clearance, 0, "m", place=first,
        shape=shape_words(shape, touching), worst=worst, rods=rods,
        depth=drawn_length(results, -(touching.clearance or 0.0)), where=where,
    )  # fmt: skip


def met_on_the_way(results: Results) -> bool:
    """Whether the rods are nearest to each other while the grid is erected, not in the flat grid."""
    met = results.contact.deployment if results.contact else None
    return met is not None and (met.share or 0.0) > 0
