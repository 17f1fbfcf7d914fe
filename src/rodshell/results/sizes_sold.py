"""The sizes in which a rod's material is sold, and whether a chosen section is among them."""

from rodshell.figures.form import RodType
from rodshell.rods.section import TRADE_SIZES, Section, size_text


def sizes_sold(rod: RodType) -> tuple[Section, ...]:
    """Sections in which the rod's material is sold, the thinnest first; none where it is not a preset."""
    preset = rod.preset.name if rod.preset else None
    return next((sizes for name, sizes in TRADE_SIZES.items() if name == preset), ())


def thinner_than_sold(rod: RodType) -> str:
    """That a chosen section is thinner than every size in which its material is sold, or ""."""
    sold, sides = sizes_sold(rod), half_sides(rod)
    if "section" not in (rod.chosen or {}) or not sold or not sides or 2 * max(sides) >= sold[0].depth:
        return ""
    return f"thinner than any size that is sold, the first of which is {size_text(sold[0])}"


def half_sides(rod: RodType) -> tuple[float, ...]:
    """Distances of the outermost fibres along both axes [m]; none of a given section."""
    if (section := rod.section) is None:
        return ()
    if section.radius:
        return section.radius, section.radius
    if section.width and section.height:
        return section.width / 2, section.height / 2
    return (section.a, section.b) if section.a and section.b else ()
