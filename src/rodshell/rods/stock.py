"""Sections in which each preset material is usually sold, thin ones first; what a supplier has may differ."""

from rodshell.rods.materials import PresetName
from rodshell.rods.section import Circle, RectangularSection, Section, Tube

MM = 1e-3


def _rods(*diameters: float) -> tuple[Section, ...]:
    return tuple(Circle(d / 2 * MM) for d in diameters)


def _tubes(*sizes: tuple[float, float]) -> tuple[Section, ...]:
    """Outer diameter and wall [mm]."""
    return tuple(Tube(d / 2 * MM, wall * MM) for d, wall in sizes)


def _laths(*sizes: tuple[float, float]) -> tuple[Section, ...]:
    """Thickness and breadth [mm] of laths that lie flat."""
    return tuple(RectangularSection(width=thickness * MM, height=breadth * MM) for thickness, breadth in sizes)


TIMBER = _laths(
    (3, 10), (5, 15), (8, 20), (10, 30), (12, 30), (15, 40), (20, 40), (24, 48), (30, 50), (40, 60), (50, 80)
)

STOCK: dict[PresetName, tuple[Section, ...]] = {
    "larch": TIMBER,
    "spruce": TIMBER,
    "oak": TIMBER,
    "bamboo": _tubes((15, 2), (20, 3), (30, 4), (40, 5), (60, 6), (80, 8), (100, 10)),  # walls of about a tenth
    "gfrp": (
        *_rods(1, 1.5, 2, 3, 4, 5, 6, 8, 10, 12),
        *_tubes((16, 2.5), (20, 2.5), (25, 3), (32, 3), (38, 3.5), (42, 3.5), (50, 4), (60, 5), (76, 6), (90, 6)),
    ),
    "plywood": _laths((4, 20), (6.5, 25), (9, 30), (12, 40), (15, 50), (18, 50), (21, 60), (24, 70)),
    "petg": _rods(1.75, 2.85, 4, 5, 6, 8, 10, 12, 15, 20),  # the first two are printers' filament
    "spring-steel": _rods(0.3, 0.4, 0.5, 0.6, 0.8, 1, 1.2, 1.5, 2, 2.5, 3),
    "rubber": (),
}


def scaled(section: Section, factor: float) -> Section:
    """A section like this one, all its lengths times `factor`."""
    return type(section)(**{key: factor * value for key, value in vars(section).items()})


def size_text(section: Section) -> str:
    """A size in stock as a supplier names it [mm]: 8 x 20 mm, a rod of 12 mm, a tube of 20 x 3 mm."""
    if isinstance(section, RectangularSection):
        return f"{section.width / MM:g} x {section.height / MM:g} mm"
    if isinstance(section, Tube):
        return f"a tube of {2 * section.radius / MM:g} x {section.thickness / MM:g} mm"
    return f"a rod of {depth(section) / MM:g} mm"


def depth(section: Section) -> float:
    """The largest side or diameter [m]."""
    if isinstance(section, Circle | Tube):
        return 2 * section.outer_radius
    if isinstance(section, RectangularSection):
        return max(section.width, section.height)
    return 2 * max(section.a, section.b)
