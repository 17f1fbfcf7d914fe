"""Which pieces are cut from which bar of stock, so that few bars do: the cutting stock problem in one dimension.

A pattern is how many pieces of each kind are cut from one bar. In the linear program of the fewest bars, shares of bars
are allowed; a pattern is added to it while its pieces are worth more, by the program's prices, than the bar it takes
[Gilmore and Gomory 1961]. Its value, rounded up, is a bound for all plans. A plan is made of it by rounding: whole bars
are cut, or the most of a bar, and the program is solved again for what is left.
"""

from collections.abc import Sequence
from math import ceil

import numpy as np
from scipy.optimize import linprog

from rodshell.arrays import Floats, Ints
from rodshell.figures.fabrication import Bar, Piece, Stock

TINY = 1e-9  # of a bar: round-off
SAME = 1e-6  # of a bar: by which pieces of one kind differ
WORTH = 1e-7  # of a bar: what a pattern has to gain
ROUNDS = 400  # patterns that are added at most
ROUNDED = 0.2  # of a bar, from which a share is rounded up


def nest(pieces: Sequence[Piece], stock: float, *, kerf: float = 0.0) -> Stock:
    """Cut pieces from bars of the length `stock` [m], the longest of a bar first.

    Of up to about 200 kinds of pieces it seldom takes more than the fewest bars, and then one more. Every piece but one
    that uses a bar to its end costs one `kerf` [m]. No piece may be longer than a bar. Saw cuts count as waste.
    """
    ordered = sorted(pieces, key=lambda piece: -piece.length)
    shares = (np.array([piece.length for piece in ordered]) + kerf) / (stock + kerf)
    kinds, first, kind = np.unique(np.round(shares / SAME), return_index=True, return_inverse=True)
    patterns, fewest = _cut(shares[first], np.bincount(kind, minlength=len(kinds)))
    queues = [[piece for piece, of in zip(ordered, kind, strict=True) if of == k] for k in range(len(kinds))]
    bars = list[Bar]()
    for pattern in patterns:
        inside = [queues[k].pop(0) for k in reversed(range(len(kinds))) for _ in range(pattern[k])]
        left = max(stock - sum(piece.length + kerf for piece in inside), 0.0)
        bars.append(Bar(pieces=tuple(inside), left=left))
    used = sum(piece.length for piece in pieces)
    waste = 1.0 - used / (stock * len(bars)) if bars else 0.0
    bars.sort(key=lambda bar: [-piece.length for piece in bar.pieces])
    return Stock(waste=waste, fewest=fewest, bars=tuple(bars))


def _cut(sizes: Floats, wanted: Ints) -> tuple[list[Ints], int]:
    """A pattern (n,) for each bar, and how many bars it takes at least.

    Args:
        sizes: (n,) ascending shares of a bar that a piece of each kind takes, its saw cut included.
        wanted: (n,) pieces of each kind.
    """
    left, done, rounds = wanted.copy(), list[Ints](), 0
    best, fewest = _first_fit(sizes, wanted), _at_least(sizes, wanted)
    patterns = np.unique([*best, *np.diag(np.minimum(1.0 // sizes, wanted).astype(np.intp))], axis=0)
    while len(best) > fewest and left.any():
        needed = 0 if done else fewest
        while True:
            found = linprog(np.ones(len(patterns)), A_ub=-patterns.T, b_ub=-left, method="highs")
            value, shares = float(found.fun or 0.0), np.asarray(found.x, dtype=np.float64)
            if rounds == ROUNDS or needed >= ceil(value - WORTH):
                break
            more, worth = _worth_most(sizes, left, -found.ineqlin.marginals)
            needed = max(needed, ceil(value / worth - WORTH))  # a bound, whatever the patterns [Farley 1990]
            patterns, rounds = np.vstack([patterns, more]), rounds + 1
        fewest = fewest if done else needed
        times = np.floor(shares + ROUNDED).astype(np.intp)
        if not times.any():  # the most of a bar, and of those the fullest
            times[np.lexsort((patterns @ sizes, np.round(shares, 6)))[-1]] = 1
        for pattern in np.repeat(patterns, times, axis=0):
            done.append(np.minimum(pattern, left))
            left = left - done[-1]
        patterns = np.unique(np.minimum(patterns, left), axis=0)
        patterns = patterns[patterns.any(axis=1)]
        best = min(best, [*filter(np.any, done), *_first_fit(sizes, left)], key=len)
    return best, fewest


def _at_least(sizes: Floats, wanted: Ints) -> int:
    """Bars that it takes at least [Martello and Toth 1990, L2]: pieces of more than half a bar need one each, and those
    of some size or more what room these leave them."""
    large, bounds = sizes > 0.5 + TINY, list[int]()
    for least in (0.0, *sizes[~large]):
        shared, small = large & (sizes <= 1.0 - least + TINY), ~large & (sizes >= least)
        over = float(sizes[shared | small] @ wanted[shared | small]) - int(wanted[shared].sum())
        bounds.append(int(wanted[large].sum()) + max(0, ceil(over - TINY * len(sizes))))
    return max(bounds)


def _first_fit(sizes: Floats, wanted: Ints) -> list[Ints]:
    """Patterns by putting the longest pieces first, each into the first bar that has room."""
    made, room = list[Ints](), list[float]()
    for kind in np.repeat(np.arange(len(sizes)), wanted)[::-1]:
        bar = next((k for k, rest in enumerate(room) if rest >= sizes[kind] - TINY), len(room))
        if bar == len(room):
            made.append(np.zeros(len(sizes), dtype=np.intp))
            room.append(1.0)
        made[bar][kind] += 1
        room[bar] -= sizes[kind]
    return made


def _worth_most(sizes: Floats, most: Ints, prices: Floats) -> tuple[Ints, float]:
    """The pattern (1, n) whose pieces are worth the most, at most so many of a kind, and its worth; no pattern and 1
    where none is worth more than a bar.

    Kind by kind, the dearest for its size first, all patterns are kept that no other of their size or less is worth as
    much as, and that can still come to be worth more than a bar.
    """
    order = [kind for kind in np.argsort(-prices / sizes) if prices[kind] > 0]
    made, used, worth = np.zeros((1, len(sizes)), dtype=np.intp), np.zeros(1), np.zeros(1)
    for kind, after in zip(order, [*order[1:], None], strict=True):
        times = np.arange(min(int(most[kind]), int((1.0 + TINY) // sizes[kind])) + 1)
        used, worth = (np.add.outer(a, times * b[kind]).ravel() for a, b in ((used, sizes), (worth, prices)))
        dear = 0.0 if after is None else prices[after] / sizes[after]
        kept = np.flatnonzero((used <= 1.0 + TINY) & (worth + (1.0 + TINY - used) * dear > 1.0 + WORTH))
        kept = kept[np.lexsort((-worth[kept], used[kept]))]
        kept = kept[np.diff(np.maximum.accumulate(worth[kept]), prepend=-1.0) > 0]
        made, used, worth = made[kept // len(times)], used[kept], worth[kept]
        made[:, kind] = kept % len(times)
    return (made[[worth.argmax()]], float(worth.max())) if len(worth) else (made, 1.0)
