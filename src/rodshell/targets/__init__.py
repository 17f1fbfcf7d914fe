"""What the user wants: surfaces with signed gap, normal, curvature and an end."""

from rodshell.targets.domain import Disc, Domain, EllipseDomain, Rectangle
from rodshell.targets.formula import Formula, parse_formula
from rodshell.targets.freeform import Freeform
from rodshell.targets.from_file import Placement, heights_from, surface_from
from rodshell.targets.heightfield import HeightField
from rodshell.targets.jet import Jet
from rodshell.targets.quadric import Cap, Ellipsoid, Hemisphere, Paraboloid
from rodshell.targets.target import Gap, Implicit, Target

__all__ = [
    "Cap",
    "Disc",
    "Domain",
    "Ellipsoid",
    "EllipseDomain",
    "Formula",
    "Freeform",
    "Gap",
    "HeightField",
    "Hemisphere",
    "Implicit",
    "Jet",
    "Paraboloid",
    "Placement",
    "Rectangle",
    "Target",
    "heights_from",
    "parse_formula",
    "surface_from",
]
