"""Kernels of `RelativeRotation`: the strains between two sections, their derivatives, and the joint's response.

y = (TA, NA, TB, NB), 12 components: tangent and normal of the section of rod A, then those of rod B. The strains are
(s, eA, eB), five numbers, as `relative_rotation` defines them.
"""

import numba as nb
import numpy as np


@nb.njit(cache=True, error_model="numpy")
def respond(strain, rest_angle, stiffness, deviators, force, tangent):  # type: ignore[no-untyped-def]
    """Energy of a joint at the strains (s, eA, eB) (5,); its derivatives by them, `force` (5,) and `tangent` (5, 5).

    A symmetric 2 x 2 matrix is its mean p and its deviator z, e -> p e + z e*. K at rest being (p0, z0) with the
    determinant d, and dC being (0, w), (1/K + dC)^-1 is (p0, z0 - d w) over 1 + 2 Re z0 w* - d |w|^2.
    """
    s = strain[0]
    p0, z0 = (
        0.5 * (stiffness[1, 1] + stiffness[2, 2]),
        complex(0.5 * (stiffness[1, 1] - stiffness[2, 2]), stiffness[1, 2]),
    )
    d = p0 * p0 - abs(z0) ** 2
    ahead = complex(np.cos(s), np.sin(s))
    of_a, of_b = deviators[0] * ahead, deviators[1] * ahead.conjugate()
    w, w1, w2 = of_a + of_b - deviators[0] - deviators[1], 1j * (of_a - of_b), -of_a - of_b
    n = z0 - d * w
    over = 1.0 + 2 * (z0 * w.conjugate()).real - d * abs(w) ** 2
    over1, over2 = 2 * (n * w1.conjugate()).real, 2 * (n * w2.conjugate()).real - 2 * d * abs(w1) ** 2
    u = 1.0 / over
    u1, u2 = -over1 * u**2, 2 * over1**2 * u**3 - over2 * u**2
    p, p1, p2 = p0 * u, p0 * u1, p0 * u2
    z, z1, z2 = n * u, n * u1 - d * w1 * u, n * u2 - 2 * d * w1 * u1 - d * w2 * u

    half = 0.5 * complex(np.cos(0.5 * s), np.sin(0.5 * s))
    other = half.conjugate() * complex(np.cos(rest_angle), -np.sin(rest_angle))
    part_a, part_b = complex(strain[1], strain[2]) * half, complex(strain[3], strain[4]) * other
    e, by_s = part_a + part_b, 0.5j * (part_a - part_b)
    f, f1, turned = p * e + z * e.conjugate(), p1 * e + z1 * e.conjugate(), p * by_s + z * by_s.conjugate()
    by_tilt, more = (half, 1j * half, other, 1j * other), f1 + turned
    force[0] = stiffness[0, 0] * s + 0.5 * (f1.conjugate() * e).real + (f.conjugate() * by_s).real
    tangent[0, 0] = stiffness[0, 0] + 0.5 * (p2 * abs(e) ** 2 + (z2 * (e * e).conjugate()).real)
    tangent[0, 0] += 2 * (f1.conjugate() * by_s).real + (turned.conjugate() * by_s).real
    tangent[0, 0] -= 0.25 * (f.conjugate() * e).real
    for i in range(4):
        v, way = by_tilt[i], 0.5j if i < 2 else -0.5j
        force[1 + i] = (f.conjugate() * v).real
        tangent[0, 1 + i] = tangent[1 + i, 0] = (more.conjugate() * v).real + (f.conjugate() * way * v).real
        stiff = (p * v + z * v.conjugate()).conjugate()
        for j in range(4):
            tangent[1 + i, 1 + j] = (stiff * by_tilt[j]).real
    return 0.5 * (stiffness[0, 0] * s * s + (f.conjugate() * e).real)


@nb.njit(cache=True, error_model="numpy")
def _shear_parts(y, by_up, by_flat):  # type: ignore[no-untyped-def]
    """Of the shear's tangent up / flat, n.(TA x TB) over |n| TA.TB with n = NA + NB: up, TA.TB, |n|, n, and slopes."""
    normal = (y[3] + y[9], y[4] + y[10], y[5] + y[11])
    up, along, square = 0.0, 0.0, 0.0
    for k in range(3):
        along += y[k] * y[6 + k]
        square += normal[k] * normal[k]
    size = np.sqrt(square)
    for k in range(3):
        k1, k2 = (k + 1) % 3, (k + 2) % 3
        by_up[k], by_flat[k] = y[6 + k1] * normal[k2] - y[6 + k2] * normal[k1], size * y[6 + k]
        by_up[6 + k], by_flat[6 + k] = normal[k1] * y[k2] - normal[k2] * y[k1], size * y[k]
        by_up[3 + k] = by_up[9 + k] = y[k1] * y[6 + k2] - y[k2] * y[6 + k1]
        by_flat[3 + k] = by_flat[9 + k] = along * normal[k] / size
        up += y[k] * by_up[k]
    return up, along, size, normal


@nb.njit(cache=True, error_model="numpy")
def strains_by(y, rest_angle, strain, slope, by_up, by_flat):  # type: ignore[no-untyped-def]
    """The strains (s, eA, eB) and their derivatives (5, 12) by y."""
    up, along, size, _ = _shear_parts(y, by_up, by_flat)
    flat = size * along
    square = up * up + flat * flat
    shear = np.arctan2(up, flat) - rest_angle
    strain[0] = shear - 2.0 * np.pi * np.floor(shear / (2.0 * np.pi) + 0.5)
    for k in range(12):
        slope[0, k] = (flat * by_up[k] - up * by_flat[k]) / square
    strain[1:] = 0.0
    slope[1:] = 0.0
    for k in range(3):
        k1, k2 = (k + 1) % 3, (k + 2) % 3
        lean = y[9 + k1] * y[3 + k2] - y[9 + k2] * y[3 + k1]
        for row, t in ((1, 0), (3, 6)):  # NB.(NA x T)
            slope[row, t + k] = lean
            slope[row, 3 + k] = y[t + k1] * y[9 + k2] - y[t + k2] * y[9 + k1]
            slope[row, 9 + k] = y[3 + k1] * y[t + k2] - y[3 + k2] * y[t + k1]
            strain[row] += lean * y[t + k]
        slope[2, k], slope[2, 9 + k] = y[9 + k], y[k]
        slope[4, 6 + k], slope[4, 3 + k] = -y[3 + k], -y[6 + k]
        strain[2] += y[9 + k] * y[k]
        strain[4] -= y[3 + k] * y[6 + k]


@nb.njit(cache=True, error_model="numpy")
def curvatures(y, force, stiffness, slope, by_up, by_flat, curve):  # type: ignore[no-untyped-def]
    """(12, 12) second derivatives of the energy by y; `stiffness` (5, 5) are those by the strains."""
    up, along, size, normal = _shear_parts(y, by_up, by_flat)
    flat = size * along
    square = up * up + flat * flat
    twice, mixed = 2.0 * force[0] * up * flat / square**2, force[0] * (up * up - flat * flat) / square**2
    for i in range(12):
        for j in range(12):
            curve[i, j] = twice * (by_flat[i] * by_flat[j] - by_up[i] * by_up[j])
            curve[i, j] += mixed * (by_up[i] * by_flat[j] + by_flat[i] * by_up[j])
            for r in range(5):
                for s in range(5):
                    curve[i, j] += stiffness[r, s] * slope[r, i] * slope[s, j]
    of_up, of_flat = force[0] * flat / square, -force[0] * up / square
    _add_triple(of_up, 0, 6, normal, curve)
    for n in (3, 9):
        _add_triple(of_up, 6, n, y[0:3], curve)
        _add_triple(of_up, n, 0, y[6:9], curve)
    for i in range(3):
        curve[i, 6 + i] += of_flat * size
        curve[6 + i, i] += of_flat * size
        for j in range(3):
            one = 1.0 if i == j else 0.0
            direct = of_flat * along * (one - normal[i] * normal[j] / (size * size)) / size
            for n in (3, 9):
                for t, other in ((0, 6), (6, 0)):
                    curve[t + i, n + j] += of_flat * y[other + i] * normal[j] / size
                    curve[n + j, t + i] += of_flat * y[other + i] * normal[j] / size
                curve[n + i, 3 + j] += direct
                curve[n + i, 9 + j] += direct
    for row, t in ((1, 0), (3, 6)):
        _add_triple(force[row], 9, 3, y[t : t + 3], curve)
        _add_triple(force[row], 3, t, y[9:12], curve)
        _add_triple(force[row], t, 9, y[3:6], curve)
    for i in range(3):
        curve[i, 9 + i] += force[2]
        curve[9 + i, i] += force[2]
        curve[3 + i, 6 + i] -= force[4]
        curve[6 + i, 3 + i] -= force[4]


@nb.njit(cache=True, error_model="numpy")
def _add_triple(factor, a, b, c, curve):  # type: ignore[no-untyped-def]
    """Add factor times the second derivatives of the triple product a.(b x c) by its arguments at a and b of y."""
    for i in range(3):
        i1, i2 = (i + 1) % 3, (i + 2) % 3
        curve[a + i, b + i1] += factor * c[i2]
        curve[b + i1, a + i] += factor * c[i2]
        curve[a + i, b + i2] -= factor * c[i1]
        curve[b + i2, a + i] -= factor * c[i1]
