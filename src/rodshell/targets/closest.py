"""Kernels of a surface F = 0 at many points: steps to the closest points, and shape operators."""

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy")
def newton_to_closest(x, y, value, gradient, hessian, damping, step, convex):  # type: ignore[no-untyped-def]
    """One step (n, 3) of Newton on y + t F'(y) = x, F(y) = 0; and whether the distance is convex at y.

    Across the tangent plane the step leads to F = 0, within it to where B step = x - y, with B = (1 + damping) + t F''.
    It has no part within the plane at a centre of curvature, where B is singular there.
    """
    for m in range(len(x)):
        gx, gy, gz = gradient[m]
        steep = np.sqrt(gx * gx + gy * gy + gz * gz)
        nx, ny, nz = gx / steep, gy / steep, gz / steep
        dx, dy, dz = x[m, 0] - y[m, 0], x[m, 1] - y[m, 1], x[m, 2] - y[m, 2]
        t = (dx * nx + dy * ny + dz * nz) / steep
        # two tangents [Duff et al. 2017, Building an orthonormal basis, revisited]
        sign = 1.0 if nz >= 0.0 else -1.0
        a = -1.0 / (sign + nz)
        b = nx * ny * a
        px, py, pz = 1.0 + sign * nx * nx * a, sign * b, -sign * nx
        qx, qy, qz = b, sign + ny * ny * a, -ny
        h = hessian[m]
        hpx, hpy, hpz = _times(h, px, py, pz)
        hqx, hqy, hqz = _times(h, qx, qy, qz)
        stiff = 1.0 + damping[m]
        pp = stiff + t * (px * hpx + py * hpy + pz * hpz)
        pq = t * (px * hqx + py * hqy + pz * hqz)
        qq = stiff + t * (qx * hqx + qy * hqy + qz * hqz)
        out = -value[m] / steep
        right_p = px * dx + py * dy + pz * dz - out * t * (nx * hpx + ny * hpy + nz * hpz)
        right_q = qx * dx + qy * dy + qz * dz - out * t * (nx * hqx + ny * hqy + nz * hqz)
        det = pp * qq - pq * pq
        convex[m] = det > 0.0 and pp + qq > 0.0
        along_p, along_q = (qq * right_p - pq * right_q) / det, (pp * right_q - pq * right_p) / det
        if det == 0.0:
            along_p = along_q = 0.0
        step[m, 0] = out * nx + along_p * px + along_q * qx
        step[m, 1] = out * ny + along_p * py + along_q * qy
        step[m, 2] = out * nz + along_p * pz + along_q * qz


@njit(cache=True)
def _times(h, x, y, z):  # type: ignore[no-untyped-def]
    return (
        h[0, 0] * x + h[0, 1] * y + h[0, 2] * z,
        h[1, 0] * x + h[1, 1] * y + h[1, 2] * z,
        h[2, 0] * x + h[2, 1] * y + h[2, 2] * z,
    )


@njit(cache=True, error_model="numpy")
def shape_operators(gradient, hessian, normal, shape):  # type: ignore[no-untyped-def]
    """Unit normals n (m, 3), and P F'' P / |F'| (m, 3, 3) with P = 1 - n n."""
    for m in range(len(gradient)):
        gx, gy, gz = gradient[m]
        steep = np.sqrt(gx * gx + gy * gy + gz * gz)
        n, h = normal[m], hessian[m]
        n[0], n[1], n[2] = gx / steep, gy / steep, gz / steep
        hx, hy, hz = _times(h, n[0], n[1], n[2])
        twice = n[0] * hx + n[1] * hy + n[2] * hz
        hn = hx - 0.5 * twice * n[0], hy - 0.5 * twice * n[1], hz - 0.5 * twice * n[2]
        for i in range(3):
            for j in range(3):
                shape[m, i, j] = (h[i, j] - hn[i] * n[j] - n[i] * hn[j]) / steep
