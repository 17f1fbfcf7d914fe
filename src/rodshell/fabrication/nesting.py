"""Cutting pieces from bars of stock."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

TINY = 1e-9  # of a bar: round-off


@dataclass(frozen=True)
class Bar:
    """One bar: the indices of the pieces that are cut from it, longest first, and what is left of it [m]."""

    pieces: tuple[int, ...]
    left: float


@dataclass(frozen=True)
class Nesting:
    """All bars.

    Parameters
    ----------
    waste : share of the stock that is not in a piece, saw cuts included.
    fewest : no cutting plan needs fewer bars than this (the pieces' total length over the stock's); a bound, which
        there need be no plan to reach.
    """

    bars: tuple[Bar, ...]
    waste: float
    fewest: int


def nest(lengths: Sequence[float], stock: float, *, kerf: float = 0.0) -> Nesting:
    """Cut pieces of these `lengths` [m] from bars of the length `stock` [m], first fit decreasing.

    It takes at most 11/9 of the fewest bars that could do, and two thirds of one more [Dosa 2007]. Every piece but
    one that uses a bar to its end costs one `kerf` [m]. No piece may be longer than a bar.
    """
    content, left = list[list[int]](), list[float]()
    for piece in sorted(range(len(lengths)), key=lambda k: (-lengths[k], k)):
        need = lengths[piece]
        bar = next((k for k, rest in enumerate(left) if rest >= need - TINY * stock), len(left))
        if bar == len(left):
            content.append([])
            left.append(stock)
        content[bar].append(piece)
        left[bar] = max(left[bar] - need - kerf, 0.0)
    used = sum(lengths)
    bars = tuple(Bar(tuple(pieces), rest) for pieces, rest in zip(content, left, strict=True))
    whole = stock * len(bars)
    return Nesting(bars, 1.0 - used / whole if bars else 0.0, ceil(used / stock - TINY))
