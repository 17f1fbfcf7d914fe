"""Target surfaces with signed distance, normal, curvature and an end: formulas, meshes, NURBS, heights.

Each kind is imported when it is first used: most jobs have one.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rodshell.targets.freeform import Freeform
    from rodshell.targets.from_file import Placement, heights_from, surface_from
    from rodshell.targets.heightfield import HeightField
    from rodshell.targets.patch import Patch, Seam
    from rodshell.targets.quadric import Cap, Ellipsoid, Hemisphere, Paraboloid
    from rodshell.targets.rim import Disc, Rectangle
    from rodshell.targets.target import Gap, Implicit, Target

__all__ = [
    "Cap", "Disc", "Ellipsoid", "Freeform", "Gap", "HeightField", "Hemisphere", "Implicit", "Paraboloid", "Patch",
    "Placement", "Rectangle", "Seam", "Target", "heights_from", "surface_from",
]  # fmt: skip

_HOMES = {
    "freeform": ("Freeform",),
    "from_file": ("Placement", "heights_from", "surface_from"),
    "heightfield": ("HeightField",),
    "patch": ("Patch", "Seam"),
    "quadric": ("Cap", "Ellipsoid", "Hemisphere", "Paraboloid"),
    "rim": ("Disc", "Rectangle"),
    "target": ("Gap", "Implicit", "Target"),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> object:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'rodshell.targets' has no attribute {name!r}")
    return getattr(import_module(f"rodshell.targets.{_HOME_OF[name]}"), name)
