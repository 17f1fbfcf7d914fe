"""Whether rods touch or cross, in the flat grid, on the way and in the shell."""

from collections.abc import Iterator

from rodshell.figures.findings import Said, said
from rodshell.results.judged.shape import shape_words, support_of
from rodshell.results.results import Results
from rodshell.results.wording import drawn_length, place, rounding_of


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
