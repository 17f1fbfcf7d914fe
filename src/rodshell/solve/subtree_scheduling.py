"""How the fronts of an elimination tree share threads and memory."""

import numba as nb
import numpy as np

from rodshell.solve.dense import padded

SHARE = 1 / 12  # of all work: no part that is eliminated by itself holds more
WORTHWHILE = 1e8  # multiplications from which on work is shared


@nb.njit(cache=True)
def parts_of(up, width, below):  # type: ignore[no-untyped-def]
    """Subtrees of at most a `SHARE` of the work each, every one a part; and last what lies above them."""
    supers = len(up)
    lowest, work = np.arange(supers), np.empty(supers)
    for s in range(supers):
        work[s] = width[s] * float(width[s] + below[s]) ** 2
    total = work.sum()
    for s in range(supers):  # children come before their parents, and a subtree is a run that ends with its root
        if up[s] >= 0:
            work[up[s]] += work[s]
            lowest[up[s]] = min(lowest[up[s]], lowest[s])
    start, parts, used = [0], np.empty(supers, dtype=np.int64), 0
    above = np.zeros(supers, dtype=np.bool_)
    for s in range(supers):
        above[s] = total > WORTHWHILE and work[s] > SHARE * total
    for s in range(supers):
        if not above[s] and total > WORTHWHILE and (up[s] < 0 or above[up[s]]):
            for c in range(lowest[s], s + 1):
                parts[used] = c
                used += 1
            start.append(used)
    for s in range(supers):
        if above[s] or total <= WORTHWHILE:
            parts[used] = s
            used += 1
    start.append(used)
    return np.array(start), parts


@nb.njit(cache=True)
def stacks_of(up, below, child_start, children, part_start, parts):  # type: ignore[no-untyped-def]
    """Where update matrices (rows `below`) lie, and room for all.

    Each part has two stacks, for even and for odd depths of the tree: what a supernode reads, its children's, and what
    it writes are then never on the same stack, and the children's lie on top of theirs. The last that a part writes
    stays there for the part that needs all.
    """
    supers = len(up)
    odd, part = np.zeros(supers, dtype=np.int64), np.zeros(supers, dtype=np.int64)
    for s in range(supers - 1, -1, -1):  # parents come after their children
        odd[s] = 1 - odd[up[s]] if up[s] >= 0 else 0
    start, room = np.empty(supers, dtype=np.int64), 0
    for p in range(len(part_start) - 1):
        here = parts[part_start[p] : part_start[p + 1]]
        part[here] = p
        height, deepest = np.zeros(2, dtype=np.int64), np.zeros(2, dtype=np.int64)
        for s in here:
            for e in range(child_start[s], child_start[s + 1]):
                if part[children[e]] == p:
                    height[1 - odd[s]] -= below[children[e]] * padded(below[children[e]])
            start[s] = height[odd[s]]
            height[odd[s]] += below[s] * padded(below[s])
            deepest[odd[s]] = max(deepest[odd[s]], height[odd[s]])
        for s in here:
            start[s] += room + odd[s] * deepest[0]
        room += deepest[0] + deepest[1]
    return start, room
