"""Curves given by points: local cubic interpolation."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def lagrange(knots: Floats, points: Floats, s: Floats) -> Floats:
    """Points (n, 3) at `s` (n,) of the polynomials through `points` (n, p, 3) at `knots` (n, p)."""
    apart = s[:, None] - knots
    weight = np.ones_like(knots)
    for j in range(knots.shape[1]):
        for k in range(knots.shape[1]):
            if j != k:
                weight[:, j] *= apart[:, k] / (knots[:, j] - knots[:, k])
    return np.asarray(np.einsum("nj,njd->nd", weight, points))


def on_curve(knots: Floats, points: Floats, s: Floats) -> Floats:
    """Points (n, 3) at `s` (n,) of a curve through `points` (m, 3) at ascending `knots` (m,).

    Fourth order: through each interval goes the cubic of the four nearest knots, or of all if there are fewer.
    """
    count = min(4, len(knots))
    first = np.clip(np.searchsorted(knots, s) - count // 2, 0, len(knots) - count)
    window = first[:, None] + np.arange(count)
    return lagrange(knots[window], points[window], s)
