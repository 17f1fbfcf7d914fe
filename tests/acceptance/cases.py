"""The cases of the acceptance table: the paper's targets and others, with their layouts."""

from dataclasses import dataclass, field
from math import cos, pi, sin
from typing import Any

import rodshell as rs

R = 0.2
ROD = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))  # HQK section 3.2
DISC = rs.Disc(R)


@dataclass(frozen=True)
class AcceptanceCase:
    """A target and a layout; `convex` where nearly all of the pinned gap is the missing end moment."""

    name: str
    target: rs.Target
    layout: dict[str, Any] = field(default_factory=dict)
    anchor: tuple[float, float] | None = None
    clamped_rms: float | None = None

    def grid(self, **changes: Any) -> rs.GridLayout:
        return rs.GridLayout.orthogonal(**{"spacing": 0.03, "edge": 0.005, **self.layout, **changes})


def ridge_formula() -> str:
    c, s = cos(0.5), sin(0.5)
    p, q = f"({c}*(x - .02) + {s}*(y - .03))", f"({c}*(y - .03) - {s}*(x - .02))"
    return f".05 - .75*x^2 - .5*y^2 + .3*x*y + .06*exp(-({p}^2/.14^2 + {q}^2/.045^2)/2)"


BUMP = "exp(-((x {sign} .09)^2/.06^2 + y^2/.07^2)/2)"
TWO_BUMPS = f"0.08*({BUMP.format(sign='-')} + {BUMP.format(sign='+')})"

HEMISPHERE = rs.Hemisphere(R)
CAP = rs.Cap(radius=0.25, base=0.1)
PARABOLOID = rs.Paraboloid(radius=R, height=0.12)
ELLIPSOID = rs.Ellipsoid(a=0.2, b=0.15, c=0.12)

# the paper's counts (HQK section 3.2); the number is the largest clamped gap, rms over the size
PAPER = (
    AcceptanceCase("hemisphere 17x17", HEMISPHERE, {"rods": (17, 17)}, clamped_rms=0.0005),
    AcceptanceCase("hemisphere 13x13 at 40 mm", HEMISPHERE, {"rods": (13, 13), "spacing": 0.04}, clamped_rms=0.0005),
    AcceptanceCase("hemisphere 11x11 at 50 mm", HEMISPHERE, {"rods": (11, 11), "spacing": 0.05}, clamped_rms=0.0005),
    AcceptanceCase("hemisphere 16x16", HEMISPHERE, {"rods": (16, 16)}, clamped_rms=0.0005),
    AcceptanceCase("paraboloid 15x15", PARABOLOID, {"rods": (15, 15)}, clamped_rms=0.002),
    AcceptanceCase("ellipsoid 11+15", ELLIPSOID, {"rods": (11, 15)}, clamped_rms=0.002),
    AcceptanceCase("cap 17x17", CAP, {"rods": (17, 17)}, clamped_rms=0.002),
)
AUTO = (
    AcceptanceCase("hemisphere auto", HEMISPHERE, clamped_rms=0.0005),
    AcceptanceCase("hemisphere auto at 40 mm", HEMISPHERE, {"spacing": 0.04}, clamped_rms=0.0005),
    AcceptanceCase("hemisphere auto at 50 mm", HEMISPHERE, {"spacing": 0.05}, clamped_rms=0.0005),
    AcceptanceCase("hemisphere auto, half a spacing off", HEMISPHERE, {"offset": (0.015, 0.015)}, clamped_rms=0.0005),
    AcceptanceCase("paraboloid auto", PARABOLOID, clamped_rms=0.002),
    AcceptanceCase("ellipsoid auto", ELLIPSOID, clamped_rms=0.002),
    AcceptanceCase("cap auto", CAP, clamped_rms=0.002),
)
FURTHER = (
    AcceptanceCase("hemisphere, anchor (0.1, 0)", HEMISPHERE, anchor=(0.1, 0.0)),
    AcceptanceCase("ellipsoid turned by 45 deg", ELLIPSOID, {"rotate": pi / 4}, clamped_rms=0.002),
    AcceptanceCase("paraboloid H = 2R", rs.Paraboloid(radius=R, height=2 * R)),
    AcceptanceCase("hypar", rs.HeightField(formula="(x^2 - y^2)/0.8", domain=DISC)),
    AcceptanceCase("two bumps", rs.HeightField(formula=TWO_BUMPS, domain=DISC)),
    AcceptanceCase("ridge", rs.HeightField(formula=ridge_formula(), domain=DISC)),
)
BEYOND = AcceptanceCase("cap with base -0.18", rs.Cap(radius=R, base=-0.18))
SHARP = AcceptanceCase("gaussian", rs.HeightField(formula=".3*exp(-(x^2 + y^2)/(2*.05^2))", domain=DISC))
