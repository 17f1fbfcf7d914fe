"""Target surfaces with signed distance, normal, curvature and an end: formulas, meshes, NURBS, heights."""

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
