"""The exact net on a sphere, from a similarity equation: an independent reference for marched nets.

The crossing angle w of a net whose axes are orthogonal great circles depends on sigma = u v / R^2 alone (from Gauss's
w_uv = -sin w / R^2): sigma f'' + f' + sin f = 0 with f(0) = pi/2, f'(0) = -1. A rod at offset c then has the geodesic
curvature -w_u, and its Frenet equations on the sphere give its path.
"""

from functools import lru_cache
from math import pi

import numpy as np
from scipy.integrate import OdeSolution
from scipy.integrate._ivp.ivp import OdeResult

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.validation import number, positive

LIMIT = 1.8616  # sigma at which f of `crossing_angle` first becomes 0: the net of a sphere folds
KNOWN = 1.95  # f is integrated to this sigma


@lru_cache
def _crossing_angle() -> "OdeSolution":
    """f and f' as functions of sigma; a series, pi/2 - s + s^3/18, starts the solution off the singular point."""
    from scipy.integrate import solve_ivp

    s = 1e-3
    first = [pi / 2 - s + s**3 / 18 - 7 * s**5 / 1800, -1 + s**2 / 6 - 7 * s**4 / 360]
    solution = solve_ivp(
        lambda sigma, f: [f[1], -(f[1] + np.sin(f[0])) / sigma],
        (s, KNOWN), first, method="DOP853", rtol=1e-13, atol=1e-14, dense_output=True,
    )  # fmt: skip
    assert solution.sol is not None
    return solution.sol


def crossing_angle(sigma: float) -> tuple[float, float]:
    """Angle between the families.

    Parameters
    ----------
    sigma : u v / R^2.

    Returns
    -------
    f(sigma) [rad], which is odd about pi/2, and its derivative.
    """
    size = abs(sigma)
    if size < 1e-3:
        f, slope = pi / 2 - size + size**3 / 18, -1 + size**2 / 6
    else:
        f, slope = _crossing_angle()(size)
    return (float(f), float(slope)) if sigma >= 0 else (pi - float(f), float(slope))


def sphere_net_rod(radius: float, offset: float, length: float, base: float | None = None) -> "OdeResult":
    """Compute the path of a rod of a sphere's net, from its middle.

    The anchor is the north pole (0, 0, radius); the rod crosses the great circle x = 0 and starts along x.

    Parameters
    ----------
    radius : of the sphere [m].
    offset : of the rod, an arc length [m].
    length : of the path, from the rod's middle [m].
    base : z of a plane at which the path ends if it reaches it first [m], or None.

    Returns
    -------
    A solution of scipy: `sol(s / radius)` is the position over the radius (3) and the unit tangent (3); `t_events` has
    s / radius where the base is reached.

    Raises
    ------
    InputError : the path would go far past the limit of the net, where its equation is not solved.
    """
    from scipy.integrate import solve_ivp

    positive("radius", radius, "m")
    number("offset", offset, "m")
    positive("length", length, "m")
    if base is not None:
        number("base", base, "m")
    a = offset / radius
    known = radius * KNOWN / abs(a) if a else np.inf
    start = np.array([0.0, np.sin(a), np.cos(a), 1.0, 0.0, 0.0])

    def frenet(s: float, y: Floats) -> Floats:
        n, t = y[:3], y[3:]
        turn = -crossing_angle(s * a)[1] * a  # geodesic curvature times the radius
        return np.concatenate([t, turn * np.cross(n, t) - n])

    def above_base(s: float, y: Floats) -> float:
        return float(y[2] - base / radius) if base is not None else 1.0

    above_base.terminal = True  # type: ignore[attr-defined]
    path = solve_ivp(frenet, (0.0, min(length, known) / radius), start, method="DOP853", rtol=1e-12, atol=1e-13,
                     events=above_base, dense_output=True)  # fmt: skip
    if length > known and path.t[-1] >= known / radius:
        raise InputError(
            f"the net of the sphere folds before the rod at offset {offset:g} m is {length:g} m long: "
            f"ask for at most {known:.4g} m"
        )
    return path


def sphere_net_end(radius: float, offset: float, base: float = 0.0) -> float:
    """Compute the half-length of a rod of a sphere's net, from its middle down to a base plane.

    Parameters
    ----------
    radius : of the sphere [m].
    offset : of the rod, an arc length [m].
    base : z of the plane; the centre of the sphere is at 0 [m].

    Returns
    -------
    Half-length [m].

    Raises
    ------
    InputError : the rod's middle is below the base, or the net folds before the rod reaches the base.
    """
    positive("radius", radius, "m")
    number("offset", offset, "m")
    number("base", base, "m")
    a = abs(offset) / radius
    if not abs(base) < radius or a >= pi or np.cos(a) * radius <= base:
        raise InputError(f"the rod at offset {offset} m does not touch the cap above z = {base} m")
    furthest = radius * min(LIMIT / a if a else np.inf, 2 * pi)
    events = sphere_net_rod(radius, offset, furthest, base).t_events
    reached = np.empty(0) if events is None else events[0]
    if len(reached) == 0:
        raise InputError(f"the net folds before the rod at offset {offset} m reaches z = {base} m")
    return float(radius * reached[0])
