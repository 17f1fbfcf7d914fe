"""The symbolic phase of a multifrontal factorisation: from a pattern and an order to the maps of the numeric one."""

from typing import NamedTuple

import numba as nb
import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]


class Plan(NamedTuple):
    """What the numeric phase needs; supernodes s in postorder, `n_s` of them."""

    order: Ints  # (n,) original index of each permuted unknown
    first: Ints  # (n_s + 1,) first column of each supernode
    row_start: Ints  # (n_s + 1,) where its rows begin in `rows`
    rows: Ints  # permuted row indices of each front, its own columns first
    relative: Ints  # beside `rows`: place of each update row in the parent's front
    child_start: Ints  # (n_s + 1,)
    children: Ints
    entry_start: Ints  # (n_s + 1,)
    entry_source: Ints  # which value of the matrix
    entry_place: Ints  # where it goes in the front
    panel_start: Ints  # (n_s + 1,) where its part of the factor begins
    stack_size: int
    largest_front: int


def plan_of(indptr: Ints, indices: Ints, order: Ints) -> Plan:
    """Of a pattern (upper triangle, compressed columns) whose unknowns are eliminated in `order`, but for ties."""
    return Plan(*_symbolic(indptr.astype(np.int64), indices.astype(np.int64), order.astype(np.int64)))


@nb.njit(cache=True)
def _symbolic(indptr, indices, order):  # type: ignore[no-untyped-def]
    """Elimination tree, postorder, supernodes, row structures and all index maps of the numeric phase."""
    n, stored = len(indptr) - 1, len(indices)
    place = np.empty(n, dtype=np.int64)
    for k in range(n):
        place[order[k]] = k
    parent = _elimination_tree(indptr, indices, place)
    post = _postorder(parent)
    new_order, back = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    for k in range(n):
        new_order[k] = order[post[k]]
        back[post[k]] = k
    new_parent = np.empty(n, dtype=np.int64)
    for k in range(n):
        p = parent[post[k]]
        new_parent[k] = back[p] if p >= 0 else -1
    order, parent = new_order, new_parent
    for k in range(n):
        place[order[k]] = k
    # entries below the diagonal by column, and by row, of the permuted matrix
    low, high = np.empty(stored, dtype=np.int64), np.empty(stored, dtype=np.int64)
    for j in range(n):
        for k in range(indptr[j], indptr[j + 1]):
            a, b = place[indices[k]], place[j]
            low[k], high[k] = min(a, b), max(a, b)
    column_start, by_column = _group(low, n)
    row_start_, by_row = _group(high, n)
    count = np.ones(n, dtype=np.int64)
    mark = np.full(n, -1, dtype=np.int64)
    for k in range(n):  # every nonzero of row k of the factor once
        mark[k] = k
        for e in range(row_start_[k], row_start_[k + 1]):
            j = low[by_row[e]]
            while mark[j] != k:
                mark[j] = k
                count[j] += 1
                j = parent[j]
    first = _supernodes(parent, count)
    supers = len(first) - 1
    owner = np.empty(n, dtype=np.int64)
    for s in range(supers):
        for j in range(first[s], first[s + 1]):
            owner[j] = s
    # rows of each front
    up = np.full(supers, -1, dtype=np.int64)
    for s in range(supers):
        p = parent[first[s + 1] - 1]
        up[s] = owner[p] if p >= 0 else -1
    child_start, children = _group(np.where(up < 0, supers, up), supers + 1)
    row_start = np.zeros(supers + 1, dtype=np.int64)
    rows = np.empty(max(16, 4 * n), dtype=np.int64)
    used = 0
    mark[:] = -1
    for s in range(supers):
        begin = used
        for j in range(first[s], first[s + 1]):
            rows, used = _push(rows, used, j)
            mark[j] = s
        own = used
        for j in range(first[s], first[s + 1]):
            for e in range(column_start[j], column_start[j + 1]):
                i = high[by_column[e]]
                if mark[i] != s:
                    mark[i] = s
                    rows, used = _push(rows, used, i)
        for e in range(child_start[s], child_start[s + 1]):
            c = children[e]
            for k in range(row_start[c] + first[c + 1] - first[c], row_start[c + 1]):
                i = rows[k]
                if mark[i] != s:
                    mark[i] = s
                    rows, used = _push(rows, used, i)
        rows[own:used].sort()
        row_start[s] = begin
        row_start[s + 1] = used
    rows = rows[:used].copy()
    # where update rows go in the parent's front, and where matrix values go in their front
    relative = np.zeros(used, dtype=np.int64)
    entry_start = np.zeros(supers + 1, dtype=np.int64)
    entry_source, entry_place = np.empty(stored, dtype=np.int64), np.empty(stored, dtype=np.int64)
    local = np.empty(n, dtype=np.int64)
    filled = 0
    for s in range(supers):
        size = row_start[s + 1] - row_start[s]
        for k in range(size):
            local[rows[row_start[s] + k]] = k
        for e in range(child_start[s], child_start[s + 1]):
            c = children[e]
            for k in range(row_start[c] + first[c + 1] - first[c], row_start[c + 1]):
                relative[k] = local[rows[k]]
        for j in range(first[s], first[s + 1]):
            for e in range(column_start[j], column_start[j + 1]):
                source = by_column[e]
                entry_source[filled] = source
                entry_place[filled] = local[high[source]] * size + local[j]
                filled += 1
        entry_start[s + 1] = filled
    panel_start = np.zeros(supers + 1, dtype=np.int64)
    largest, height, deepest = 0, 0, 0
    for s in range(supers):
        size, own = row_start[s + 1] - row_start[s], first[s + 1] - first[s]
        panel_start[s + 1] = panel_start[s] + size * own
        largest = max(largest, size)
        for e in range(child_start[s], child_start[s + 1]):
            c = children[e]
            height -= (row_start[c + 1] - row_start[c] - first[c + 1] + first[c]) ** 2
        height += (size - own) ** 2
        deepest = max(deepest, height)
    return (
        order, first, row_start, rows, relative, child_start[: supers + 1].copy(), children, entry_start,
        entry_source, entry_place, panel_start, deepest, largest,
    )  # fmt: skip


@nb.njit(cache=True)
def _elimination_tree(indptr, indices, place):  # type: ignore[no-untyped-def]
    """Parent of each permuted column (Liu 1990), -1 for roots."""
    n = len(indptr) - 1
    low, high = np.empty(len(indices), dtype=np.int64), np.empty(len(indices), dtype=np.int64)
    for j in range(n):
        for k in range(indptr[j], indptr[j + 1]):
            a, b = place[indices[k]], place[j]
            low[k], high[k] = min(a, b), max(a, b)
    start, by_row = _group(high, n)
    parent, ancestor = np.full(n, -1, dtype=np.int64), np.full(n, -1, dtype=np.int64)
    for k in range(n):
        for e in range(start[k], start[k + 1]):
            j = low[by_row[e]]
            while j != -1 and j < k:
                above = ancestor[j]
                ancestor[j] = k
                if above == -1:
                    parent[j] = k
                j = above
    return parent


@nb.njit(cache=True)
def _postorder(parent):  # type: ignore[no-untyped-def]
    """Nodes of the forest, children before parents and every subtree in a row."""
    n = len(parent)
    head, following = np.full(n, -1, dtype=np.int64), np.full(n, -1, dtype=np.int64)
    for j in range(n - 1, -1, -1):
        if parent[j] >= 0:
            following[j] = head[parent[j]]
            head[parent[j]] = j
    post, stack = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    done = 0
    for root in range(n):
        if parent[root] >= 0:
            continue
        stack[0], top = root, 0
        while top >= 0:
            j = stack[top]
            child = head[j]
            if child == -1:
                post[done] = j
                done += 1
                top -= 1
            else:
                head[j] = following[child]
                top += 1
                stack[top] = child
    return post


@nb.njit(cache=True)
def _group(keys, groups):  # type: ignore[no-untyped-def]
    """Start of each group and the indices of `keys` in groups, in a counting sort."""
    start = np.zeros(groups + 1, dtype=np.int64)
    for key in keys:
        start[key + 1] += 1
    for g in range(groups):
        start[g + 1] += start[g]
    filled, members = start[:-1].copy(), np.empty(len(keys), dtype=np.int64)
    for k in range(len(keys)):
        members[filled[keys[k]]] = k
        filled[keys[k]] += 1
    return start, members


@nb.njit(cache=True)
def _push(array, used, value):  # type: ignore[no-untyped-def]
    """Append to an array that doubles when it is full."""
    if used == len(array):
        larger = np.empty(2 * used, dtype=array.dtype)
        larger[:used] = array
        array = larger
    array[used] = value
    return array, used + 1


@nb.njit(cache=True)
def _supernodes(parent, count):  # type: ignore[no-untyped-def]
    """First column of each supernode: columns of one structure, and small ones merged for a few zeros more."""
    n = len(parent)
    first = np.empty(n + 1, dtype=np.int64)
    zeros = np.zeros(n, dtype=np.int64)
    size = np.empty(n, dtype=np.int64)  # rows of the front
    supers = 0
    for j in range(n):
        if supers > 0 and parent[j - 1] == j and count[j] == count[j - 1] - 1:
            continue
        first[supers], size[supers], zeros[supers] = j, count[j], 0
        supers += 1
    first[supers] = n
    kept = 0  # supernodes kept so far; the last is tried on its parent, which follows it
    for s in range(supers):
        begin, rows, empty = first[s], size[s], zeros[s]
        while kept > 0:
            before = first[kept - 1]
            if parent[begin - 1] != begin:
                break
            narrow, wide = begin - before, first[s + 1] - begin
            taller = narrow + rows
            more = empty + zeros[kept - 1] + narrow * (taller - size[kept - 1])
            own = narrow + wide
            total = own * taller - own * (own - 1) // 2
            share = 0.6 if own <= 8 else (0.35 if own <= 24 else (0.12 if own <= 64 else 0.04))
            if more > share * total:
                break
            begin, rows, empty = before, taller, more
            kept -= 1
        first[kept], size[kept], zeros[kept] = begin, rows, empty
        kept += 1
    first[kept] = n
    return first[: kept + 1].copy()
