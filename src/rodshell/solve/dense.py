"""The dense work on a front: elimination of its pivots, the update of what is left, and the two substitutions.

A front of `width` pivots is stored row after row, its rows padded to a multiple of `PAD` numbers. Memory comes from
`room`: kernels read up to a register past the end of what they need, and begin where a register would.
"""

import numpy as np

from rodshell.arrays import Floats
from rodshell.kernels import njit
from rodshell.solve.simd_kernels import BYTES, LANES, REGISTERS, ROWS, adding, eliminating, multiplying, subtracting

PAD = 8  # numbers in the largest register
BLOCK = 32  # pivots after which all rows below are updated
DEPTH = 128  # pivots whose rows are multiplied at a time: so many stay in the nearest cache
TALL = 48  # rows of a product from which on they are packed first
# What becomes of what a product is subtracted from; of this type, since Numba compiles a kernel again for plain numbers
KEPT, OVERWRITTEN = np.int64(1), np.int64(0)

_WIDE = LANES * REGISTERS
_FACTORS = ROWS * PAD  # where they lie in the workspace, behind the rows they are found from
_PACKED = 2 * _FACTORS  # where packed rows begin

_subtract_43, _subtract_42, _subtract_41 = (subtracting(ROWS, k) for k in (3, 2, 1))
_subtract_13, _subtract_12, _subtract_11 = (subtracting(1, k) for k in (3, 2, 1))
_eliminate_43, _eliminate_42, _eliminate_41 = (eliminating(ROWS, k) for k in (3, 2, 1))
_eliminate_13, _eliminate_12, _eliminate_11 = (eliminating(1, k) for k in (3, 2, 1))
_multiply_4, _multiply_1 = multiplying(ROWS), multiplying(1)
_add = adding()


def room(numbers: int) -> Floats:
    """Memory for so many numbers, and a register's more."""
    memory = np.empty(numbers + 2 * PAD)
    begin = -(memory.ctypes.data // BYTES) % PAD
    return memory[begin : begin + numbers + PAD]


def workspace(largest: int) -> Floats:
    """What `eliminate` and `subtract_product` need for fronts of up to `largest` rows."""
    return room(_PACKED + DEPTH * (largest + ROWS))


@njit(inline="always")
def padded(length):  # type: ignore[no-untyped-def]
    """The length of a row with its padding."""
    return (length + PAD - 1) // PAD * PAD


@njit(inline="always")
def _place(matrix, row, column):  # type: ignore[no-untyped-def]
    """The address of an element."""
    return matrix.ctypes.data + row * matrix.strides[0] + column * BYTES


@njit(error_model="numpy", inline="always")
def eliminate(rows, panel, pivots, work):  # type: ignore[no-untyped-def]
    """Eliminate the pivots of a front; False where one vanishes or is not finite.

    Args:
        rows: (width, stride) the front's upper triangle, overwritten with D L^T.
        panel: (width, stride), filled with L^T.
        pivots: (width,), filled with D.
        work: `workspace`.
    """
    width = len(rows)
    for begin in range(0, width, BLOCK):
        end = min(begin + BLOCK, width)
        k = begin
        while k < end:
            count = ROWS if k + ROWS <= end else 1
            if not _find_factors(rows, panel, begin, k, count, pivots, work):
                return False
            _eliminate_rows(rows, panel, begin, k, count, work)
            k += count
        if end < width:
            subtract_product(panel[begin:end], rows[begin:end], end, KEPT, rows[end:, end:], work)
    return True


@njit(error_model="numpy", inline="always")
def _find_factors(rows, panel, begin, k, count, pivots, work):  # type: ignore[no-untyped-def]
    """The `count` pivots from k on, and in the workspace the factors that the kernel asks for."""
    left, stride = k // LANES * LANES, rows.shape[1]
    for r in range(count):
        for c in range(LANES):
            work[r * LANES + c] = rows[k + r, left + c]
    _subtract(
        count, 1, work.ctypes.data, LANES, _place(panel, begin, k), stride, _place(rows, begin, left), stride,
        k - begin, 1,
    )  # fmt: skip
    at, here = _FACTORS, k - left
    for r in range(count):
        for above in range(r):
            factor = work[above * LANES + here + r] / pivots[k + above]
            for c in range(here + r, here + count):
                work[r * LANES + c] -= factor * work[above * LANES + c]
            work[at] = -factor
            at += 1
        pivot = work[r * LANES + here + r]
        if not (np.isfinite(pivot) and np.isfinite(1.0 / pivot)):
            return False
        pivots[k + r], work[at] = pivot, 1.0 / pivot
        at += 1
    return True


@njit(error_model="numpy", inline="always")
def _eliminate_rows(rows, panel, begin, k, count, work):  # type: ignore[no-untyped-def]
    """The rows of `count` pivots from k on, whose factors are known, after those of the pivots from `begin` on."""
    stride, depth = rows.shape[1], k - begin
    a, factors = _place(panel, begin, k), work.ctypes.data + _FACTORS * BYTES
    for j in range(k // LANES * LANES, stride, _WIDE):
        registers = min(REGISTERS, (stride - j) // LANES)
        b, c, d = _place(rows, begin, j), _place(rows, k, j), _place(panel, k, j)
        if count == ROWS:
            if registers == 3:
                _eliminate_43(c, d, a, b, stride, depth, factors)
            elif registers == 2:
                _eliminate_42(c, d, a, b, stride, depth, factors)
            else:
                _eliminate_41(c, d, a, b, stride, depth, factors)
        elif registers == 3:
            _eliminate_13(c, d, a, b, stride, depth, factors)
        elif registers == 2:
            _eliminate_12(c, d, a, b, stride, depth, factors)
        else:
            _eliminate_11(c, d, a, b, stride, depth, factors)


@njit(error_model="numpy")
def subtract_product(panel, rows, first, kept, target, work):  # type: ignore[no-untyped-def]
    """target = kept target - panel[:, first:]^T rows[:, first:], except below the diagonal.

    Args:
        panel, rows: (width, stride).
        kept: `KEPT` or `OVERWRITTEN`.
        target: (n, m), part of a matrix, for as many columns from `first` on.
        work: `workspace`.
    """
    n, m = target.shape
    for start in range(0, len(panel), DEPTH):
        depth, a, step, apart = min(DEPTH, len(panel) - start), _place(panel, start, first), panel.shape[1], 1
        if n >= TALL:
            _pack(panel, start, depth, first, n, work)
            a, step, apart = work.ctypes.data + _PACKED * BYTES, ROWS, depth
        for j in range(0, m, _WIDE):
            registers, b = min(REGISTERS, (m - j + LANES - 1) // LANES), _place(rows, start, first + j)
            for i in range(0, min(n, j + _WIDE), ROWS):
                _subtract(
                    min(ROWS, n - i), registers, _place(target, i, j), target.strides[0] // BYTES,
                    a + i * apart * BYTES, step, b, rows.shape[1], depth, kept,
                )  # fmt: skip
        kept = KEPT


@njit(inline="always")
def _pack(panel, start, depth, first, n, work):  # type: ignore[no-untyped-def]
    """`n` columns of the panel into the workspace, packed `ROWS` at a time."""
    at = _PACKED
    for i in range(first, first + n, ROWS):
        wide = min(ROWS, first + n - i)
        for k in range(start, start + depth):
            for r in range(wide):
                work[at + r] = panel[k, i + r]
            at += ROWS


@njit(inline="always")
def _subtract(rows, registers, c, stride_c, a, stride_a, b, stride_b, depth, keep):  # type: ignore[no-untyped-def]
    """A tile; one of fewer rows row by row."""
    for _ in range(1 if rows == ROWS else rows):
        if rows == ROWS:
            if registers == 3:
                _subtract_43(c, stride_c, a, stride_a, b, stride_b, depth, keep)
            elif registers == 2:
                _subtract_42(c, stride_c, a, stride_a, b, stride_b, depth, keep)
            else:
                _subtract_41(c, stride_c, a, stride_a, b, stride_b, depth, keep)
        elif registers == 3:
            _subtract_13(c, stride_c, a, stride_a, b, stride_b, depth, keep)
        elif registers == 2:
            _subtract_12(c, stride_c, a, stride_a, b, stride_b, depth, keep)
        else:
            _subtract_11(c, stride_c, a, stride_a, b, stride_b, depth, keep)
        c, a = c + stride_c * BYTES, a + BYTES


@njit()
def add_rows(target, update, runs, end):  # type: ignore[no-untyped-def]
    """Add to the rows of a front up to `end`, the last of which are `target`, what a child's update matrix has for
    them, upper triangle. Its rows go there in `runs` (k, 2): from which on, and where to.

    Args:
        target: the rows of the front from some row `begin` to `end`, its columns from `begin` on.
        update: the child's update matrix, of which the upper triangle is read.
        runs: (k, 2) rows of the update matrix that stay contiguous: the first, and its row in the front.
        end: the row of the front after the last that is added to.
    """
    count, begin = len(runs), end - len(target)
    for low in range(count):
        past = runs[low + 1, 0] if low + 1 < count else len(update)
        shift = runs[low, 1] - runs[low, 0] - begin
        for i in range(max(runs[low, 0], -shift), min(past, len(target) - shift)):
            _add(_place(target, i + shift, i + shift), _place(update, i, i), past - i)
            for high in range(low + 1, count):
                first, stop = runs[high, 0], runs[high + 1, 0] if high + 1 < count else len(update)
                _add(_place(target, i + shift, runs[high, 1] - begin), _place(update, i, first), stop - first)


@njit(error_model="numpy", inline="always")
def forward(panel, values, count, aside):  # type: ignore[no-untyped-def]
    """Solve L y = b for the pivots of a front and up to `ROWS` right-hand sides, and subtract from the other unknowns
    what that takes. The bits do not depend on how many there are.

    Args:
        panel: (width, stride) L^T.
        values: (count, stride) each row first b, overwritten with y; from what is behind the pivots, the product with
            L is subtracted.
        count: of right-hand sides; a constant 1 saves a tenth of the time.
        aside: (count width,) scratch.
    """
    width, stride = panel.shape
    for k in range(width):
        row = panel[k]
        for r in range(count):
            value, right = values[r, k], values[r]
            for i in range(k + 1, width):
                right[i] -= row[i] * value
            aside[count * k + r] = value
    begin = width // LANES * LANES
    for j in range(begin, stride, _WIDE):
        _subtract(
            count, min(REGISTERS, (stride - j) // LANES), _place(values, 0, j), stride, aside.ctypes.data, count,
            _place(panel, 0, j), stride, width, 1,
        )  # fmt: skip
    for k in range(begin, width):
        for r in range(count):
            values[r, k] = aside[count * k + r]


@njit(error_model="numpy", inline="always")
def backward(panel, pivots, values, count, aside):  # type: ignore[no-untyped-def]
    """Solve D L^T x = y for the pivots of a front and up to `ROWS` right-hand sides. The bits do not depend on how many
    there are.

    Args:
        panel: (width, stride) L^T, its padding 0.
        pivots: (width,) D.
        values: (count, stride) each row first y, overwritten with x; behind the pivots, the x that is already known; in
            the padding 0.
        count: see `forward`.
        aside: (2 width,) scratch.
    """
    width, stride = panel.shape
    begin, whole = width // LANES * LANES, width // ROWS * ROWS
    known = aside.ctypes.data + width * BYTES
    for r in range(count):
        right, x = values[r], _place(values, r, begin)
        for k in range(width):
            aside[k] = right[k] / pivots[k]
        for k in range(begin, width):
            right[k] = 0.0
        for k in range(0, whole, ROWS):
            _multiply_4(known + k * BYTES, _place(panel, k, begin), stride, x, stride - begin)
        for k in range(whole, width):
            _multiply_1(known + k * BYTES, _place(panel, k, begin), stride, x, stride - begin)
        for k in range(width - 1, -1, -1):
            value, row = aside[k] - aside[width + k], panel[k]
            for i in range(k + 1, width if count < ROWS else k + 1):
                value -= row[i] * right[i]
            right[k] = value
    for k in range(width - 1 if count == ROWS else -1, -1, -1):
        row, a, b, c, d = panel[k], values[0, k], values[1, k], values[2, k], values[3, k]
        for i in range(k + 1, width):  # side by side: each sum alone would wait for its last addition
            factor = row[i]
            a -= factor * values[0, i]
            b -= factor * values[1, i]
            c -= factor * values[2, i]
            d -= factor * values[3, i]
        values[0, k], values[1, k], values[2, k], values[3, k] = a, b, c, d
