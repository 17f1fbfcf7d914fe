"""Sizes of stock: a design with values in between is rounded to sizes that are available, and repaired.

Rounding loses what the search gained by sizes in between. It is repaired on the linear model at the rounded design:
sizes go up or down by one in the list, one at a time, as long as the sum of squares decreases; then the shell is solved
again.
"""

from collections.abc import Callable, Sequence

import numpy as np

from rodshell.arrays import Floats
from rodshell.refining.objectives import Objective, residuals, slopes
from rodshell.refining.structure import Point
from rodshell.refining.variables import Design

_REPAIRS = 4
GAIN = 1e-3  # relative decrease of the sum of squares for which a size is changed
PARTS = (1, 2, 4)  # the way to the rounded design, in so many steps where fewer do not lead there


def rounded(
    variables: Design,
    found: Point,
    objectives: Sequence[Objective],
    allows: Callable[[Point], bool],
) -> tuple[Point | None, int]:
    """The best design of sizes of stock near one with values in between that was found.

    Args:
        allows: limits that a design must keep.

    Returns:
        The design, or None where none near it is stable and allowed; and the number of factorisations.
    """
    stock = variables.stock
    here, made = _towards(variables, found, nearest(stock, found.values))
    best = here if here is not None and allows(here) else None
    for _ in range(_REPAIRS):
        if here is None:
            break
        made += 1
        r, jacobian = residuals(objectives, here), slopes(objectives, here)
        values = repaired(stock, here.values, r, jacobian)
        if (values == here.values).all():
            break
        here, more = _towards(variables, here, values)
        made += more
        if here is None or not allows(here) or float(np.sum(residuals(objectives, here) ** 2)) > float(r @ r):
            break
        best = here
    return best, made


def nearest(stock: Sequence[Floats | None], values: Floats) -> Floats:
    """(n,) the nearest values that are available; of variables without stock their own."""
    chosen = [
        value if list_ is None else float(list_[np.argmin(np.abs(list_ - value))])
        for list_, value in zip(stock, values.tolist(), strict=True)
    ]
    return np.array(chosen)


def repaired(stock: Sequence[Floats | None], values: Floats, r: Floats, jacobian: Floats) -> Floats:
    """(n,) values that make the sum of squares of a linear model small, each at most one in its list away.

    Args:
        stock: of each variable, or None for those that stay.
        values: (n,) now, in their lists.
        r, jacobian: (q,) residuals and (q, n) their slopes there.
    """
    result, left = values.copy(), r.copy()
    open_ = {k for k, list_ in enumerate(stock) if list_ is not None}
    while open_:
        moves = []
        for k in open_:
            list_ = stock[k]
            assert list_ is not None
            at = int(np.argmin(np.abs(list_ - result[k])))
            for there in (at - 1, at + 1):
                if 0 <= there < len(list_):
                    step = float(list_[there] - result[k])
                    moves.append((float(np.sum((left + step * jacobian[:, k]) ** 2)), k, step))
        least, k, step = min(moves)
        if least > (1.0 - GAIN) * float(left @ left):
            break
        result[k] += step
        left += step * jacobian[:, k]
        open_.remove(k)
    return result


def _towards(variables: Design, here: Point, values: Floats) -> tuple[Point | None, int]:
    """The design with these values, in one step or, where that fails, in several."""
    made = 0
    for parts in PARTS:
        there: Point | None = here
        for part in range(1, parts + 1):
            assert there is not None
            between = here.values + part / parts * (values - here.values)
            between = values if part == parts else between
            made += 1
            there, more = there.tried(between, variables.change(between))
            made += more
            if there is None:
                break
        if there is not None:
            return there, made
    return None, made
