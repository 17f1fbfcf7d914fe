"""The symbolic phase of a multifrontal factorisation: from a pattern and an order to the maps of the numeric one.

All but the last maps is done on *blocks*, unknowns that lie at one point and are coupled alike: a node's directions
of motion. Tree, supernodes and fronts are found from a graph some ten times smaller than the matrix. The plan also says
how the fronts share threads and memory.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rodshell.arrays import Longs
from rodshell.kernels import njit
from rodshell.model import BlockRows
from rodshell.solve.dense import padded


class Plan(NamedTuple):
    """What the numeric phase needs; supernodes s in postorder, `n_s` of them."""

    child_start: Longs  # (n_s + 1,) where the children of each supernode begin in `children`
    children: Longs
    order: Longs  # (n,) original index of each permuted unknown
    first: Longs  # (n_s + 1,) first column of each supernode
    row_start: Longs  # (n_s + 1,) where its rows begin in `rows`
    rows: Longs  # permuted row indices of each front, its own columns first
    run_start: Longs  # (c + 1,) where the runs of each of the `children` begin
    runs: (
        Longs  # (r, 2) rows of a child's update matrix that stay contiguous in the front: the first, and its row there
    )
    entry_start: Longs  # (n_s + 1,)
    entry_source: Longs  # which value of the matrix
    entry_place: Longs  # where it goes in the rows of the front's pivots
    panel_start: Longs  # (n_s + 1,) where its part of the factor begins
    update_start: Longs  # (n_s,) where its update matrix lies in `stacks`
    part_start: Longs  # (p + 1,) parts that can be eliminated at the same time, except the last, which needs them all
    parts: Longs  # (n_s,) the supernodes of each part, ascending
    stack_size: int
    largest_front: int
    largest_panel: int

    @property
    def each(self) -> list[Longs]:
        """The supernodes of each part."""
        starts = self.part_start.tolist()
        return [self.parts[begin:stop] for begin, stop in pairwise(starts)]

    @property
    def levels(self) -> list[list[Longs]]:
        """Supernodes to eliminate at the same time, each level after those before: first the separate parts, then the
        supernodes of the last part, from the leaves of its tree to the root."""
        *separate, last = self.each
        if not separate:
            return [[last]]
        level = dict[int, int]()
        for s in last.tolist():
            children = self.children[self.child_start[s] : self.child_start[s + 1]].tolist()
            level[s] = 1 + max((level[c] for c in children if c in level), default=0)
        above = [[np.array([s]) for s in level if level[s] == k + 1] for k in range(max(level.values()))]
        return [separate, *above]


class Blocks(NamedTuple):
    """Unknowns in blocks of consecutive ones, `begin` (b + 1,), and the blocks that each is coupled to:
    neighbours[start[k] : start[k + 1]]. All unknowns of two blocks are coupled, or none. In the upper triangle the
    columns of block k have above[k] rows before the block's own; `source` says where the values of each pair begin.
    """

    begin: Longs
    start: Longs
    neighbours: Longs
    source: Longs
    above: Longs


def blocks_of(indptr: Longs, indices: Longs, begin: Longs) -> BlockRows:
    """The blocks of a pattern (upper triangle, compressed columns); single unknowns, where some unknown of a block is
    not coupled as the others are; `begin` (b + 1,) holds the first unknown of each, and the number of unknowns."""
    whole, start, rows = _block_rows(indptr, indices, begin)
    return BlockRows(begin, start, rows) if whole else blocks_of(indptr, indices, np.arange(begin[-1] + 1))


def coupled(indptr: Longs, blocks: BlockRows) -> Blocks:
    """The graph of blocks; `indptr` says where columns begin in the pattern of the upper triangle."""
    return Blocks(blocks.begin, *_coupled(indptr, *blocks))


def plan_of(indptr: Longs, blocks: Blocks, order: Longs) -> Plan:
    """Of a pattern whose `blocks` are eliminated in `order` (b,), except what the tree leaves open; parameters as of
    `coupled`."""
    order, tree, weight, count, *earlier = _tree(blocks.begin, blocks.start, blocks.neighbours, order.astype(np.int64))
    first = _supernodes(tree, count, weight)
    up, child_start, children = _children(tree, first)
    row_start, rows = _fronts(first, *earlier, up)
    maps = _maps(indptr, *blocks, order, weight, first, up, row_start, rows, child_start, children)
    return Plan(child_start, children, *maps)


@njit()
def _start_after(count, start):  # type: ignore[no-untyped-def]
    """Where each of some runs starts, `start` (n + 1,), that lie one after the other and have `count` (n,) entries."""
    start[0] = 0
    for k in range(len(count)):
        start[k + 1] = start[k] + count[k]


@njit("i1 i1 i1")
def _block_rows(indptr, indices, begin):  # type: ignore[no-untyped-def]
    """Whether these are blocks that are coupled as wholes; and their `BlockRows`."""
    n, used, other = len(begin) - 1, 0, 0  # entries that are not where those of blocks are
    block, start, rows = np.empty(begin[n], dtype=np.int64), np.zeros(n + 1, dtype=np.int64), np.empty_like(indices)
    for b in range(n):
        j, last = begin[b], begin[b + 1] - 1
        e, above = indptr[j], indptr[last + 1] - indptr[last] - (last + 1 - j)
        stop = e + above
        for k in range(j, last + 1):  # every column has the rows of the first, and the block's own
            block[k] = b
            other += indptr[k + 1] - indptr[k] != above + k - j + 1
        if other > 0:
            break
        for k in range(j + 1, last + 1):
            for d in range(above):
                other += indices[indptr[k] + d] != indices[e + d]
        while e < stop:
            rows[used] = block[indices[e]]
            for k in range(begin[rows[used]], begin[rows[used] + 1]):
                other += e == stop or indices[e] != k
                e += 1
            used += 1
        start[b + 1] = used
    return other == 0, start, rows[:used].copy()


@njit("i1 i1 i1 i1")
def _coupled(indptr, begin, row_start, rows):  # type: ignore[no-untyped-def]
    """The other blocks to which each block of unknowns is coupled, and more: see `Blocks`."""
    n = len(begin) - 1
    count, start, above = np.empty(n, dtype=np.int64), np.empty(n + 1, dtype=np.int64), np.empty(n, dtype=np.int64)
    for b in range(n):
        count[b] = row_start[b + 1] - row_start[b]
        above[b] = indptr[begin[b] + 1] - indptr[begin[b]] - 1
    for a in rows:
        count[a] += 1
    _start_after(count, start)
    neighbours, source, place = np.empty(start[n], dtype=np.int64), np.empty(start[n], dtype=np.int64), count
    for b in range(n):
        place[b] = start[b]
    for b in range(n):
        at = indptr[begin[b]]
        for e in range(row_start[b], row_start[b + 1]):
            a = rows[e]
            neighbours[place[a]], neighbours[place[b]] = b, a
            source[place[a]] = source[place[b]] = at
            place[a] += 1
            place[b] += 1
            at += begin[a + 1] - begin[a]
    return start, neighbours, source, above


@njit("i1 i1 i1 i1")
def _tree(begin, start, neighbours, order):  # type: ignore[no-untyped-def]
    """Blocks in a postorder of their elimination tree; for each, its parent, unknowns, and rows of its columns; and the
    earlier ones to which block k is coupled, earlier[first[k] : first[k + 1]]."""
    n = len(order)
    first, earlier = _earlier(start, neighbours, order)
    parent = _elimination_tree(first, earlier)
    post = _postorder(parent)
    back = np.empty(n, dtype=np.int64)
    for k in range(n):
        back[post[k]] = k
    sorted_order, above, weight = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    count, mark = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    sorted_first, sorted_earlier = np.zeros(n + 1, dtype=np.int64), np.empty(len(earlier), dtype=np.int64)
    for k in range(n):
        j, used = post[k], sorted_first[k]
        sorted_order[k], mark[k] = order[j], -1
        above[k] = back[parent[j]] if parent[j] >= 0 else -1
        weight[k] = count[k] = begin[order[j] + 1] - begin[order[j]]
        for e in range(first[j], first[j + 1]):
            sorted_earlier[used] = back[earlier[e]]
            used += 1
        sorted_first[k + 1] = used
    for k in range(n):  # every nonzero of row k of the factor once
        mark[k] = k
        for e in range(sorted_first[k], sorted_first[k + 1]):
            j = sorted_earlier[e]
            while mark[j] != k:
                mark[j] = k
                count[j] += weight[k]
                j = above[j]
    return sorted_order, above, weight, count, sorted_first, sorted_earlier


@njit(inline="always")
def _earlier(start, neighbours, order):  # type: ignore[no-untyped-def]
    """The blocks before the k-th in the order to which that is coupled, earlier[first[k] : first[k + 1]]."""
    n, used = len(order), 0
    place = np.empty(n, dtype=np.int64)
    for k in range(n):
        place[order[k]] = k
    first, earlier = np.zeros(n + 1, dtype=np.int64), np.empty(len(neighbours) // 2, dtype=np.int64)
    for k in range(n):
        for e in range(start[order[k]], start[order[k] + 1]):
            if place[neighbours[e]] < k:
                earlier[used] = place[neighbours[e]]
                used += 1
        first[k + 1] = used
    return first, earlier


@njit(inline="always")
def _elimination_tree(first, earlier):  # type: ignore[no-untyped-def]
    """Parent of each permuted block (Liu 1990), -1 for roots."""
    n = len(first) - 1
    parent, ancestor = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    for k in range(n):
        parent[k] = ancestor[k] = -1
        for e in range(first[k], first[k + 1]):
            j = earlier[e]
            while j != -1 and j < k:
                above = ancestor[j]
                ancestor[j] = k
                if above == -1:
                    parent[j] = k
                j = above
    return parent


@njit(inline="always")
def _postorder(parent):  # type: ignore[no-untyped-def]
    """Nodes of the forest, children before parents and every subtree in a row."""
    n = len(parent)
    head, following = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    for j in range(n):
        head[j] = following[j] = -1
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


@njit("i1 i1 i1")
def _supernodes(parent, count, weight):  # type: ignore[no-untyped-def]
    """First block of each supernode: blocks of one structure, and small ones merged for a few zeros more."""
    n = len(parent)
    first = np.empty(n + 1, dtype=np.int64)
    zeros = np.zeros(n, dtype=np.int64)
    size = np.empty(n, dtype=np.int64)  # rows of the front
    width = np.empty(n, dtype=np.int64)  # its own columns
    supers = 0
    for j in range(n):
        if supers > 0 and parent[j - 1] == j and count[j] == count[j - 1] - weight[j - 1]:
            width[supers - 1] += weight[j]
            continue
        first[supers], size[supers], width[supers], zeros[supers] = j, count[j], weight[j], 0
        supers += 1
    first[supers] = n
    kept = 0  # supernodes kept so far; the last is tried on its parent, which follows it
    for s in range(supers):
        begin, rows, wide, empty = first[s], size[s], width[s], zeros[s]
        while kept > 0 and parent[begin - 1] == begin:
            narrow = width[kept - 1]
            taller, wider = narrow + rows, narrow + wide
            more = empty + zeros[kept - 1] + narrow * (taller - size[kept - 1])
            total = wider * taller - wider * (wider - 1) // 2
            share = 0.6 if wider <= 8 else (0.35 if wider <= 24 else (0.12 if wider <= 64 else 0.04))
            if more > share * total:
                break
            kept -= 1
            begin, rows, wide, empty = first[kept], taller, wider, more
        first[kept], size[kept], width[kept], zeros[kept] = begin, rows, wide, empty
        kept += 1
    first[kept] = n
    return first[: kept + 1]


@njit("i1 i1")
def _children(parent, first):  # type: ignore[no-untyped-def]
    """Parent of each supernode, -1 for roots; and the children of each, ascending."""
    supers = len(first) - 1
    owner, up = np.empty(len(parent), dtype=np.int64), np.empty(supers, dtype=np.int64)
    start, filled = np.empty(supers + 1, dtype=np.int64), np.zeros(supers, dtype=np.int64)
    for s in range(supers):
        for k in range(first[s], first[s + 1]):
            owner[k] = s
    for s in range(supers):
        p = parent[first[s + 1] - 1]
        up[s] = owner[p] if p >= 0 else -1
        if p >= 0:
            filled[owner[p]] += 1
    _start_after(filled, start)
    children = np.empty(start[supers], dtype=np.int64)
    for s in range(supers):
        filled[s] = start[s]
    for s in range(supers):
        if up[s] >= 0:
            children[filled[up[s]]] = s
            filled[up[s]] += 1
    return up, start, children


@njit("i1 i1 i1 i1")
def _fronts(first, start, earlier, up):  # type: ignore[no-untyped-def]
    """Blocks of each front, ascending, its own ones first: rows[row_start[s] : row_start[s + 1]].

    Block i is in its own front, and in all those between that of an `earlier` block it is coupled to (see `_tree`) and
    its own.
    """
    supers, n = len(first) - 1, len(start) - 1
    owner, mark = np.empty(n, dtype=np.int64), np.empty(supers, dtype=np.int64)
    for s in range(supers):
        for k in range(first[s], first[s + 1]):
            owner[k] = s
    row_start, used, rows = np.zeros(supers + 1, dtype=np.int64), np.empty(supers, dtype=np.int64), owner
    for sweep in range(2):  # count, then fill
        for s in range(supers):
            used[s], mark[s] = row_start[s], -1
        for i in range(n):
            s = owner[i]
            mark[s] = i
            if sweep == 1:
                rows[used[s]] = i
            used[s] += 1
            for e in range(start[i], start[i + 1]):
                s = owner[earlier[e]]
                while mark[s] != i:
                    mark[s] = i
                    if sweep == 1:
                        rows[used[s]] = i
                    used[s] += 1
                    s = up[s]
        if sweep == 0:
            _start_after(used, row_start)
            rows = np.empty(row_start[supers], dtype=np.int64)
    return row_start, rows


@njit("i1 i1 i1 i1 i1 i1 i1 i1 i1 i1 i1 i1 i1 i1")
def _maps(  # type: ignore[no-untyped-def]
    indptr, begin, start, neighbours, source, above, order, weight, first, up, row_start, rows, child_start, children
):
    """From blocks to unknowns: all that `Plan` holds but the children."""
    supers, n, unknowns, values = len(first) - 1, len(order), begin[len(begin) - 1], indptr[len(indptr) - 1]
    column, place = np.empty(n + 1, dtype=np.int64), np.empty(n, dtype=np.int64)
    _start_after(weight, column)  # first permuted unknown of each block
    first_column, width_of = np.empty(supers + 1, dtype=np.int64), np.empty(supers, dtype=np.int64)
    original = np.empty(unknowns, dtype=np.int64)
    for k in range(n):
        place[order[k]] = k
        for d in range(weight[k]):
            original[column[k] + d] = begin[order[k]] + d
    total = 0
    for k in rows:
        total += weight[k]
    all_rows = np.empty(total, dtype=np.int64)
    all_start, panel_start = np.zeros(supers + 1, dtype=np.int64), np.zeros(supers + 1, dtype=np.int64)
    entry_start, entry = np.zeros(supers + 1, dtype=np.int64), 0
    entry_source, entry_place = np.empty(values, dtype=np.int64), np.empty(values, dtype=np.int64)
    local = np.empty(n, dtype=np.int64)
    below = np.empty(supers, dtype=np.int64)
    run_start, runs = np.zeros(len(children) + 1, dtype=np.int64), np.empty((len(rows), 2), dtype=np.int64)
    used, largest, widest = 0, 0, 0
    for s in range(supers):
        for e in range(row_start[s], row_start[s + 1]):
            k = rows[e]
            local[k] = used - all_start[s]
            for d in range(weight[k]):
                all_rows[used] = column[k] + d
                used += 1
        all_start[s + 1] = used
        size, width = used - all_start[s], column[first[s + 1]] - column[first[s]]
        first_column[s], width_of[s], below[s] = column[first[s]], width, size - width
        stride = padded(size)
        panel_start[s + 1] = panel_start[s] + width * stride
        largest, widest = max(largest, size), max(widest, width * stride)
        for e in range(child_start[s], child_start[s + 1]):
            c, count, at, past = children[e], run_start[e], 0, -1
            for k in rows[row_start[c] + first[c + 1] - first[c] : row_start[c + 1]]:
                if local[k] != past:
                    runs[count, 0], runs[count, 1] = at, local[k]
                    count += 1
                at, past = at + weight[k], local[k] + weight[k]
            run_start[e + 1] = count
        for k in range(first[s], first[s + 1]):  # the values in the rows of its pivots, pair by pair of blocks
            b = order[k]
            for e in range(start[b] - 1, start[b + 1]):  # first the block itself
                a = neighbours[e] if e >= start[b] else b
                if place[a] < k:
                    continue
                right, pivot = max(a, b), local[k] * stride + local[place[a]]  # where its first value goes
                at, rows_of, columns_of, down, across = indptr[begin[b]] + above[b], weight[k], weight[k], stride, 1
                if b < a:
                    at, columns_of = source[e], begin[a + 1] - begin[a]
                elif a < b:
                    at, rows_of, down, across = source[e], begin[a + 1] - begin[a], 1, stride
                for c in range(columns_of):
                    for r in range(rows_of if a != b else c + 1):
                        entry_source[entry], entry_place[entry] = at + r, pivot + down * r + across * c
                        entry += 1
                    at += above[right] + c + 1
        entry_start[s + 1] = entry
    first_column[supers] = column[n]
    part_start, parts = _parts_of(up, width_of, below)
    update_start, deepest = _stacks_of(up, below, child_start, children, part_start, parts)
    return (
        original, first_column, all_start, all_rows, run_start, runs, entry_start, entry_source, entry_place,
        panel_start, update_start, part_start, parts, deepest, largest, widest,
    )  # fmt: skip


SHARE = 1 / 12  # of all work: no part that is eliminated by itself holds more
WORTHWHILE = 1e8  # multiplications from which on work is shared


@njit(inline="always")
def _parts_of(up, width, below):  # type: ignore[no-untyped-def]
    """Subtrees of at most a `SHARE` of the work each, every one a part; and last what lies above them.

    Args:
        up, width, below: (n_s,) parent of each supernode, negative for a root; numbers of its pivots and of the rows of
            its update matrix.
    """
    supers = len(up)
    lowest, work, total = np.empty(supers, dtype=np.int64), np.empty(supers), 0.0
    for s in range(supers):
        lowest[s], work[s] = s, width[s] * float(width[s] + below[s]) ** 2
        total += work[s]
    for s in range(supers):  # children come before their parents, and a subtree is a run that ends with its root
        if up[s] >= 0:
            work[up[s]] += work[s]
            lowest[up[s]] = min(lowest[up[s]], lowest[s])
    start, parts = np.zeros(supers + 2, dtype=np.int64), np.empty(supers, dtype=np.int64)
    count, used = 0, 0
    above = np.zeros(supers, dtype=np.bool_)
    for s in range(supers):
        above[s] = total > WORTHWHILE and work[s] > SHARE * total
    for s in range(supers):
        if not above[s] and total > WORTHWHILE and (up[s] < 0 or above[up[s]]):
            for c in range(lowest[s], s + 1):
                parts[used] = c
                used += 1
            count += 1
            start[count] = used
    for s in range(supers):
        if above[s] or total <= WORTHWHILE:
            parts[used] = s
            used += 1
    count += 1
    start[count] = used
    return start[: count + 1], parts


@njit(inline="always")
def _stacks_of(up, below, child_start, children, part_start, parts):  # type: ignore[no-untyped-def]
    """Where update matrices lie, and room for all; arguments as of `_parts_of` and `Plan`.

    Each part has two stacks, for even and for odd depths of the tree: what a supernode reads, its children's, and what
    it writes are then never on the same stack, and the children's lie on top of theirs. The last that a part writes
    stays there for the part that needs all; in that one every matrix stays, since threads share its supernodes.
    """
    supers = len(up)
    odd, part = np.zeros(supers, dtype=np.int64), np.zeros(supers, dtype=np.int64)
    for s in range(supers - 1, -1, -1):  # parents come after their children
        odd[s] = 1 - odd[up[s]] if up[s] >= 0 else 0
    start, room = np.empty(supers, dtype=np.int64), 0
    for p in range(len(part_start) - 1):
        here = parts[part_start[p] : part_start[p + 1]]
        for s in here:
            part[s] = p
        height, deepest = np.zeros(2, dtype=np.int64), np.zeros(2, dtype=np.int64)
        stays = 0 < p == len(part_start) - 2
        for s in here:
            for e in range(child_start[s], child_start[s + 1]):
                if part[children[e]] == p and not stays:
                    height[1 - odd[s]] -= below[children[e]] * padded(below[children[e]])
            start[s] = height[odd[s]]
            height[odd[s]] += below[s] * padded(below[s])
            deepest[odd[s]] = max(deepest[odd[s]], height[odd[s]])
        for s in here:
            start[s] += room + odd[s] * deepest[0]
        room += deepest[0] + deepest[1]
    return start, room
