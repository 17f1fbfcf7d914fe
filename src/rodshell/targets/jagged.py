"""Jagged edges of a mesh, as faces that were left out leave them, and the smooth curves that they stand for."""

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.geometry.vectors import cross, dot

SHARP = 0.35  # [rad], 20 degrees: an edge between two such turns to opposite sides is a jog
FEWEST = 4  # jogs in a row that make an edge jagged: a real corner or notch has fewer
RUN = 2.5  # times sqrt(n): edges between jogs of a row; a lattice cut along a circle of n edges has runs of 1.1 sqrt(n)
MOST, RMS = 1.0, 0.35  # edges by which a vertex may be moved; uniform steps of a lattice are 0.29 off their mean, rms
HALVINGS = 20


def smooth_loop(loop: Floats, normals: Floats) -> Floats | None:
    """The loop (n, 3) with its jagged parts smoothed, or None if it has none.

    Of all curves that keep within an edge length of the vertices, and in the mean within what the steps of a lattice
    explain, it is the smoothest: a smoothing spline with third differences [Eilers and Marx 1996], which hardly shrink
    a circle. Vertices outside of jagged parts stay where they are.

    Parameters
    ----------
    loop : (n, 3) closed polyline [m].
    normals : (n, 3) of the surface there.
    """
    free = _jagged(loop, normals)
    if not free.any():
        return None
    length = np.linalg.norm(np.roll(loop, -1, axis=0) - loop, axis=1)
    edge = np.max([np.roll(length, k) for k in (-1, 0, 1, 2)], axis=0)[:, None]  # the longest nearby
    low, high, best = -4.0, 10.0, loop  # powers of ten
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        tried = _splined(loop, edge, free, 10**middle)
        off = np.linalg.norm((tried - loop) / edge, axis=1)[free]
        if off.max() <= MOST and np.sqrt(np.mean(off**2)) <= RMS:
            low, best = middle, tried
        else:
            high = middle
    return best


def _jagged(loop: Floats, normals: Floats) -> Bools:
    """(n,) vertices of jagged parts: of rows of jogs that follow each other closely."""
    count = len(loop)
    ahead = np.roll(loop, -1, axis=0) - loop
    before = np.roll(ahead, 1, axis=0)
    turn = np.arctan2(dot(cross(before, ahead), normals), dot(before, ahead))
    after = np.roll(turn, -1)
    jogs = np.flatnonzero((turn * after < 0) & (np.minimum(np.abs(turn), np.abs(after)) > SHARP))
    result = np.zeros(count, dtype=bool)
    for row in _rows(jogs, count):
        if len(row) >= FEWEST:
            result[np.arange(row[0], row[-1] + 2) % count] = True
    return result


def _rows(jogs: Ints, count: int) -> list[Ints]:
    """The jogs of a closed loop in rows whose gaps are short; the last may go on past `count`."""
    if len(jogs) == 0:
        return []
    gaps = np.diff(jogs, append=jogs[0] + count)
    long = np.flatnonzero(gaps > RUN * np.sqrt(count))
    if len(long) == 0:
        return [np.append(jogs, jogs[0] + count)]
    first = long[-1] + 1  # a row begins after a long gap
    turned = np.concatenate([jogs[first:], jogs[:first] + count])
    return np.split(turned, np.flatnonzero(np.diff(turned) > RUN * np.sqrt(count)) + 1)


def _splined(loop: Floats, edge: Floats, free: Bools, weight: float) -> Floats:
    """The z (n, 3) that minimise |(z - loop) / edge|^2 + weight |third differences of z around the loop / edge|^2,
    those that are not free kept."""
    from scipy.sparse import coo_matrix, diags_array
    from scipy.sparse.linalg import spsolve

    count = len(loop)
    rows = np.arange(count)
    third = coo_matrix(
        (
            np.concatenate([np.full(count, factor) for factor in (-1.0, 3.0, -3.0, 1.0)]),
            (np.tile(rows, 4), np.concatenate([(rows + k) % count for k in range(4)])),
        )
    ).tocsr()
    third = diags_array(2 / (np.roll(edge[:, 0], -1) + np.roll(edge[:, 0], -2))) @ third
    keep = diags_array(1 / edge[:, 0] ** 2)
    system = (keep + weight * (third.T @ third)).tocsc()
    result = loop.copy()
    right = (keep @ loop - system[:, ~free] @ loop[~free])[free]
    result[free] = spsolve(system[free][:, free].tocsc(), right)
    return result
