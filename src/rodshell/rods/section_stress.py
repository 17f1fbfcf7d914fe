"""Stress over a rod's section: bending, stretch and torsion together, at the points where the sum can be largest.

    sigma = E (eps + kappa1 x + kappa2 y),   tau = G theta' l(x, y),   s = sqrt(sigma^2 + (w tau)^2)

x and y run along the directors m1 and m2; theta' is the twist per length, l [m] Saint-Venant's shear stress over
G theta' [Timoshenko and Goodier, Theory of Elasticity, sections 105 and 109]. The weight w is the strength over the
shear strength: sqrt(3) makes s the stress of von Mises, for isotropic materials; for timber and fibre composites the
two strengths are given, and s over the strength is the criterion of Tsai and Hill for stress along the fibres.

The largest s lies on the outline: sigma is linear, and tau the gradient of a function of constant Laplacian, so that
neither sigma^2 nor tau^2 has a maximum inside.
"""

from math import sqrt

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.rods.section import Circle, Ellipse, GivenSection, RectangularSection, Rod, Tube

VON_MISES = sqrt(3.0)
POINTS = 33  # on a side of a rectangle, from its middle to a corner, and on a quarter of an ellipse: s within 1e-3
TERMS = np.arange(1, 200, 2)  # of the series of a rectangle, which fall as n^-2 at worst, next to a corner


def fibre_distance(rod: Rod) -> float | None:
    """Distance [m] of the outermost fibre from the axis of bending, for bends in any direction.

    Where the section is not round it is that of its farthest point: the stress is then an upper bound. None for a
    given section without fibre distances.

    Parameters
    ----------
    rod : section and material.
    """
    section = rod.section
    if isinstance(section, GivenSection):
        return None if section.fibre_distances is None else float(np.hypot(*section.fibre_distances))
    if isinstance(section, Circle | Tube):
        return section.outer_radius
    if isinstance(section, Ellipse):
        return max(section.a, section.b)
    if isinstance(section, RectangularSection):
        return 0.5 * float(np.hypot(section.width, section.height))
    raise InputError(f"the outermost fibre of a section of kind {type(section).__name__} is not known")


def fibre_strain(rod: Rod, kappa1: Floats, kappa2: Floats) -> Floats:
    """Largest bending strain over the section [-].

    Exact for each shape; for a given section that of the corner of the box that its fibre distances span.

    Parameters
    ----------
    kappa1, kappa2 : (n,) curvatures towards m1 and m2 [1/m].

    Raises
    ------
    InputError : a given section has no fibre distances.
    """
    section = rod.section
    if isinstance(section, Ellipse):
        return np.hypot(section.a * kappa1, section.b * kappa2)
    if isinstance(section, Circle | Tube):
        return np.asarray(section.outer_radius * np.hypot(kappa1, kappa2))
    if isinstance(section, RectangularSection):
        x, y = 0.5 * section.width, 0.5 * section.height
    elif section.fibre_distances is None:
        raise InputError("the strain of a given section without fibre_distances is not known: give them")
    else:
        x, y = section.fibre_distances
    return np.asarray(x * np.abs(kappa1) + y * np.abs(kappa2))


def torsion_stress(rod: Rod, twist_rate: Floats) -> Floats:
    """Largest shear stress of torsion over the section [Pa].

    Parameters
    ----------
    twist_rate : (n,) twist per length [rad/m].

    Raises
    ------
    InputError : a given section has no torsion modulus.
    """
    return np.asarray(_outline(rod)[2].max() * np.abs(twist_rate))


def largest_stress(
    rod: Rod, kappa1: Floats, kappa2: Floats, axial: Floats, twist_rate: Floats, *, weight: float = VON_MISES
) -> Floats:
    """Largest s over the section [Pa], as the module defines it.

    Parameters
    ----------
    kappa1, kappa2 : (n,) curvatures towards m1 and m2 [1/m].
    axial : (n,) strain of the axis [-].
    twist_rate : (n,) twist per length [rad/m].
    weight : w, of the shear stress against the normal stress [-].

    Raises
    ------
    InputError : the stress of a given section needs a value that is missing.
    """
    modulus = fibre_modulus(rod)
    bent, drawn, twist = fibre_strain(rod, kappa1, kappa2), np.abs(axial), np.abs(twist_rate)
    result = np.asarray(modulus * (bent + drawn))
    if not twist.any():
        return result
    if isinstance(rod.section, Circle | Tube):
        kappa1, kappa2 = np.hypot(kappa1, kappa2), np.zeros_like(kappa2)
    across, within = np.abs(kappa1), np.abs(kappa2)
    for x, y, shear in zip(*_outline(rod), strict=True):  # in the quarter of equal signs, the worst of four
        normal = modulus * (x * across + y * within + drawn)
        result = np.maximum(result, np.hypot(normal, weight * shear * twist))
    return result


def fibre_modulus(rod: Rod) -> float:
    """Young's modulus of the outermost fibres [Pa].

    Raises
    ------
    InputError : a given section without fibre_modulus or fibre_distances.
    """
    if isinstance(rod.section, GivenSection):
        require_known_stress(rod, twisted=False)
        assert rod.section.fibre_modulus is not None
        return rod.section.fibre_modulus
    assert rod.material is not None
    return rod.material.youngs_modulus


def stress_is_known(rod: Rod, *, twisted: bool) -> bool:
    """Whether the stress of a rod is known, with that of torsion if it is `twisted`.

    Parameters
    ----------
    rod : section and material.
    twisted : the rods can be twisted.
    """
    return not _missing(rod, twisted)


def require_known_stress(rod: Rod, *, twisted: bool) -> None:
    """Refuse a given section whose stress is not known.

    Parameters
    ----------
    twisted : whether the rods can be twisted: by joints, or because their two bending stiffnesses differ.

    Raises
    ------
    InputError : values are missing that the stress needs.
    """
    if missing := _missing(rod, twisted):
        needed = " and ".join([", ".join(missing[:-1]), missing[-1]] if missing[1:] else missing)
        raise InputError(
            "a strength can be checked only where the stress is known, and of this given section that needs "
            f"{needed}: give what is missing (rod.section), or leave out the strength"
        )


def _missing(rod: Rod, twisted: bool) -> list[str]:
    """Values that the stress of a given section needs and that are missing."""
    if not isinstance(rod.section, GivenSection):
        return []
    needed = ["fibre_distances", "fibre_modulus", *(["torsion_modulus"] if twisted else [])]
    return [name for name in needed if getattr(rod.section, name) is None]


def _outline(rod: Rod) -> tuple[Floats, Floats, Floats]:
    """Points x, y >= 0 of the outline [m], (p,) each, and the shear stress there over the twist per length [Pa m]."""
    section = rod.section
    if isinstance(section, GivenSection):
        require_known_stress(rod, twisted=True)
        assert section.fibre_distances is not None
        assert section.torsion_modulus is not None
        farthest = section.fibre_distances
        # where the largest shear stress acts is not known: at the farthest fibre is the worst case
        return np.array(farthest[:1]), np.array(farthest[1:]), np.array([section.GJ / section.torsion_modulus])
    assert rod.material is not None
    if isinstance(section, Circle | Tube):
        x, y, lever = np.array([section.outer_radius]), np.zeros(1), np.array([section.outer_radius])
    elif isinstance(section, Ellipse):
        a, b, at = section.a, section.b, np.linspace(0.0, 0.5 * np.pi, POINTS)
        x, y = a * np.cos(at), b * np.sin(at)
        lever = 2 * a * b / (a**2 + b**2) * np.hypot(b * np.cos(at), a * np.sin(at))
    else:
        x, y, lever = _rectangle(section.width, section.height)
    return x, y, rod.material.shear_modulus * lever


def _rectangle(width: float, height: float) -> tuple[Floats, Floats, Floats]:
    """As `_outline`, the shear stress over G theta': from the middle of each side to the corner, where it vanishes."""
    thin, wide = sorted((0.5 * width, 0.5 * height))
    share = np.linspace(0.0, 1.0, POINTS)[:, None]
    n = TERMS * np.pi / (2 * thin)
    # cosh(n s)/cosh(n wide) without overflow
    falls = (np.exp(-n * wide * (1 - share)) + np.exp(-n * wide * (1 + share))) / (1 + np.exp(-2 * n * wide))
    sign = np.where(TERMS % 4 == 1, 1.0, -1.0)
    on_wide = 2 * thin * (1 - 8 / np.pi**2 * (falls / TERMS**2).sum(axis=1))
    on_thin = 16 * thin / np.pi**2 * (sign * np.tanh(n * wide) * np.cos(n * thin * share) / TERMS**2).sum(axis=1)
    lever = np.concatenate([on_wide, on_thin])
    lever[[POINTS - 1, -1]] = 0.0
    along, end = np.append(wide * share, np.full(POINTS, wide)), np.append(np.full(POINTS, thin), thin * share)
    return (end, along, lever) if width <= height else (along, end, lever)
