"""End correction: from the lines of a net to where rods bound to the surface would lie.

A line of the net is curved up to its end, while a rod's bending moment vanishes there (the natural boundary condition).
The joints hardly move for it: so between them each rod differs from its line by a cubic spline that vanishes at the
joints, and whose end moments cancel the line's geodesic curvature. By beam theory, to first order; the correction
decays by the factor 2 - sqrt(3) = 0.27 from joint to joint, as cubic splines do (docs/theory.md, The bound drape).
"""

import numba as nb
import numpy as np

from rodshell.arrays import Floats
from rodshell.layout import GridMesh
from rodshell.targets import Target

STEEP = 0.5  # rad that a line turns in its last span: from there beam theory does not hold, the rod stays on its line


def corrected_ends(target: Target, mesh: GridMesh, points: Floats) -> Floats:
    """(n, 3) the nodes, moved sideways on the target to where rods would lie, to first order [m].

    The axes stay: they are geodesics, and the drape holds them on their lines.

    Parameters
    ----------
    target : the surface.
    mesh : of the net's lines.
    points : (n, 3) its nodes on the net's lines [m].
    """
    joint = np.zeros(mesh.node_count, dtype=bool)
    joint[mesh.joint_nodes] = True
    normal = target.on_surface(points).normal
    result = points.copy()
    rods = np.flatnonzero([rod.offset != 0.0 for rod in mesh.grid.rods])
    _correct(points, normal, mesh.rod_nodes, mesh.rod_start[rods], mesh.rod_stop[rods], mesh.stations, joint, result)
    return target.retract(result)


@nb.njit(cache=True, error_model="numpy")
def _correct(points, normal, rod_nodes, rod_start, rod_stop, stations, joint, result):  # type: ignore[no-untyped-def]
    for rod in range(len(rod_start)):
        nodes, s = rod_nodes[rod_start[rod] : rod_stop[rod]], stations[rod_start[rod] : rod_stop[rod]]
        at = np.flatnonzero(joint[nodes])
        if len(at) < 2 or len(nodes) < 5:
            continue
        side = _sideways(points, normal, nodes)
        curvature = _curvature(points, nodes, s, side)
        first, last = curvature[at[0]], curvature[at[-1]]
        if max(abs(first) * (s[at[1]] - s[at[0]]), abs(last) * (s[at[-1]] - s[at[-2]])) > STEEP:
            continue
        moments = _moments(s[at], -first, -last)
        for span in range(len(at) - 1):
            a, b = at[span], at[span + 1]
            h = s[b] - s[a]
            for k in range(a + 1, b):
                x, y = (s[b] - s[k]) / h, (s[k] - s[a]) / h
                shift = h * h / 6.0 * (moments[span] * (x**3 - x) + moments[span + 1] * (y**3 - y))
                _shift(result, nodes[k], shift, side, k)
        for end, inner, stop, step in ((0, 1, -1, -1), (len(at) - 1, len(at) - 2, len(nodes), 1)):
            begin, h = at[end], abs(s[at[end]] - s[at[inner]])
            slope = h / 6.0 * (2.0 * moments[end] + moments[inner])
            for k in range(begin + step, stop, step):  # past the last joint the rod is straight
                far = abs(s[k] - s[begin])
                _shift(result, nodes[k], far * (slope + 0.5 * far * moments[end]), side, k)


@nb.njit(cache=True)
def _shift(result, node, shift, side, k):  # type: ignore[no-untyped-def]
    for i in range(3):
        result[node, i] += shift * side[k, i]


@nb.njit(cache=True, error_model="numpy")
def _sideways(points, normal, nodes):  # type: ignore[no-untyped-def]
    """(n, 3) unit vectors in the surface across a rod."""
    side, last = np.empty((len(nodes), 3)), len(nodes) - 1
    for k in range(len(nodes)):
        a, b, n, square = points[nodes[max(k - 1, 0)]], points[nodes[min(k + 1, last)]], normal[nodes[k]], 0.0
        for i in range(3):
            m, p = (i + 1) % 3, (i + 2) % 3
            side[k, i] = n[m] * (b[p] - a[p]) - n[p] * (b[m] - a[m])
            square += side[k, i] ** 2
        for i in range(3):
            side[k, i] /= np.sqrt(square)
    return side


@nb.njit(cache=True, error_model="numpy")
def _curvature(points, nodes, s, side):  # type: ignore[no-untyped-def]
    """(n,) geodesic curvature towards `side` by three nodes [1/m], extrapolated to the ends."""
    curvature = np.empty(len(nodes))
    for k in range(1, len(nodes) - 1):
        before, after, curvature[k] = s[k] - s[k - 1], s[k + 1] - s[k], 0.0
        for i in range(3):
            turn = (points[nodes[k + 1], i] - points[nodes[k], i]) / after
            turn -= (points[nodes[k], i] - points[nodes[k - 1], i]) / before
            curvature[k] += 2.0 * turn / (before + after) * side[k, i]
    for end, k, step in ((0, 1, 1), (len(nodes) - 1, len(nodes) - 2, -1)):
        rate = (curvature[k + step] - curvature[k]) / (s[k + step] - s[k])
        curvature[end] = curvature[k] + rate * (s[end] - s[k])
    return curvature


@nb.njit(cache=True, error_model="numpy")
def _moments(s, first, last):  # type: ignore[no-untyped-def]
    """(n,) second derivatives of the cubic spline that vanishes at `s` (n,), given those at its ends."""
    moments, share = np.zeros(len(s)), np.zeros(len(s))
    moments[0], moments[-1] = first, last
    for k in range(1, len(s) - 1):
        before, after = s[k] - s[k - 1], s[k + 1] - s[k]
        pivot = 2.0 * (before + after) - before * share[k - 1]
        share[k] = after / pivot
        moments[k] = -before * moments[k - 1] / pivot
    for k in range(len(s) - 2, 0, -1):
        moments[k] -= share[k] * moments[k + 1]
    return moments
