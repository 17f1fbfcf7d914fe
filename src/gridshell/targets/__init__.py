"""What the user wants: surfaces with signed gap, normal, curvature and an end."""

from gridshell.targets.domain import Disc, Domain, EllipseDomain, Rectangle
from gridshell.targets.formula import Formula, parse_formula
from gridshell.targets.freeform import Freeform
from gridshell.targets.fromfile import heights_from, surface_from
from gridshell.targets.heightfield import HeightField
from gridshell.targets.jet import Jet
from gridshell.targets.placement import Placement
from gridshell.targets.quadric import Cap, Ellipsoid, Hemisphere, Paraboloid
from gridshell.targets.target import Gap, Implicit, Target

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
