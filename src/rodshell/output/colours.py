"""Colours of numbers: three maps of even lightness steps, given by a few control points."""

from functools import lru_cache

import numpy as np

from rodshell.arrays import Floats

# Signed: dark in the middle, so that rods without a gap are drawn in ink on light paper.
SIGNED = ("#39b5e6", "#2f86b4", "#2f5a7a", "#333b46", "#7c4a35", "#bf6434", "#f28c3a")
STRESS = ("#2b3a55", "#3f6f8f", "#6fa287", "#c9b458", "#dd8a3a", "#b3372c")
HEIGHT = ("#352a6b", "#33508a", "#24768e", "#26988a", "#4cb873", "#9bc94f")


def hex_colours(points: tuple[str, ...], shares: Floats) -> list[str]:
    """Colours at `shares` (k,) of the way through a map, 0 to 1."""
    table = np.array([[int(point[i : i + 2], 16) for i in (1, 3, 5)] for point in points], dtype=float)
    at = np.linspace(0.0, 1.0, len(points))
    channels = [np.interp(shares, at, table[:, k]) for k in range(3)]
    return [f"#{r:02x}{g:02x}{b:02x}" for r, g, b in np.rint(channels).astype(int).T.tolist()]


@lru_cache(maxsize=4096)
def mixed(colour: str, other: str, share: float) -> str:
    """`colour` with a `share` of the `other`, 0 to 1."""
    pairs = ((int(colour[k : k + 2], 16), int(other[k : k + 2], 16)) for k in (1, 3, 5))
    return "#" + "".join(f"{round(a + share * (b - a)):02x}" for a, b in pairs)
