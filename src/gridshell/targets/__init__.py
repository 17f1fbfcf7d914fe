"""What the user wants: surfaces with signed gap, normal, curvature and an end."""

from gridshell.targets.domain import Disc, Domain, EllipseDomain, Rectangle
from gridshell.targets.formula import Formula, parse_formula
from gridshell.targets.heightfield import HeightField
from gridshell.targets.jet import Jet
from gridshell.targets.quadric import Cap, Ellipsoid, Hemisphere, Paraboloid
from gridshell.targets.target import Gap, Implicit, Target

__all__ = [
    "Cap",
    "Disc",
    "Domain",
    "Ellipsoid",
    "EllipseDomain",
    "Formula",
    "Gap",
    "HeightField",
    "Hemisphere",
    "Implicit",
    "Jet",
    "Paraboloid",
    "Rectangle",
    "Target",
    "parse_formula",
]
