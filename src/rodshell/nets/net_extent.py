"""How far a net is marched: the lines of the lattice that can touch the target, and the nodes that are needed.

These are the nodes inside the target's end and up to a margin past it: the net that is bound to a target continues past
its end (`with_apron`), and a rod is cut between nodes on both sides. They are known beforehand from the
same net in longer steps; the first of these nets has only a few long steps.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.errors import InputError
from rodshell.layout import GridLayout
from rodshell.layout.gridlayout import auto_edge
from rodshell.layout.mesh import MOST_NODES, edge_counts
from rodshell.nets.compass import ON_SURFACE, Axes, Heights, Net, fill_quadrants, lay_axes
from rodshell.nets.net_ends import inside_nodes
from rodshell.nets.net_refinement import CONVERGED, march_near
from rodshell.targets import Target
from rodshell.units import length_text
from rodshell.untrusted import limit, raised

SURELY = 0.96  # of the margin: the ends of two nets in different steps differ slightly
MARGIN = 2.3  # spacings marched past the end of the target: two rings of joints are bound there, see `with_apron`
_STRIDE = 0.2  # of the target's size: steps of the first march
STRIDES = 10  # steps of the first march, from the anchor each way
ROUGH = 5e-2  # of a step: tolerance of the first march, which leaves its square
_FAIR = 1e-2  # of the size: last motion of the march that finds the lines, see `march_near`
_FEWEST_STEPS = 6  # from each line to the next


@dataclass(frozen=True, eq=False, repr=False)
class Covering(Net):
    """A net that covers a target: its points are known inside the target's end, and some way past it.

    Args:
        inside: (nu, nv) nodes inside the target's end, see `inside_nodes`.
    """

    inside: Bools

    def reach(self, past: int) -> Floats:
        """How far (4,) [m] the inside nodes, and `past` nodes more, reach towards -u, +u, -v and +v."""
        result = list[float]()
        for s, touched in ((self.u, self.inside.any(axis=1)), (self.v, self.inside.any(axis=0))):
            on = np.flatnonzero(touched)
            first, last = (on[0], on[-1]) if len(on) else (0, len(s) - 1)
            result += [-s[max(first - past, 0)], s[min(last + past, len(s) - 1)]]
        return np.array(result)


def march_covering(
    target: Target,
    u: Floats,
    v: Floats,
    start: Axes,
    margin: Floats,
    near: Covering,
    coarser: Net | None = None,
    *,
    heights: Heights = ON_SURFACE,
    converged: float = CONVERGED,
) -> Covering:
    """March a net as far as the target, and a margin past its end.

    Where the target ends is taken from a net in longer steps; where that was wrong, the march is continued.

    Args:
        u, v: (nu,), (nv,) ascending material coordinates of the lines, both containing 0 [m].
        margin: (2,) along u and v [m].
        near, coarser: the net in longer steps, and in yet longer ones, see `march_near`.
        converged: see `march_near`.
    """
    wanted = wanted_nodes(near, 1, u, v, margin)
    net = march_near(target, u, v, start, near, coarser=coarser, wanted=wanted, heights=heights, converged=converged)
    while True:
        found = Covering(u, v, net.points, inside_nodes(target, net), heights=heights)
        if not _want_nodes(found, 0, u, v, SURELY * margin, wanted):
            return found
        fill_quadrants(target, net, wanted, tolerance=converged**1.5)


def wanted_nodes(near: Covering, past: int, u: Floats, v: Floats, margin: Floats) -> Bools:
    """Nodes (nu, nv) inside the target's end or within a margin of it, and all between these and the axes.

    Args:
        near: a net in longer steps; if it has no inside nodes, all nodes are wanted.
        past: the end may be so many of its nodes past the inside ones.
        u, v: (nu,), (nv,) material coordinates of the lines [m].
        margin: (2,) along u and v [m].
    """
    wanted = np.zeros((len(u), len(v)), dtype=bool)
    _want_nodes(near, past, u, v, margin, wanted)
    return wanted


def _want_nodes(near: Covering, past: int, u: Floats, v: Floats, margin: Floats, wanted: Bools) -> bool:
    """Add to the nodes `wanted` (nu, nv) those of `wanted_nodes`; return whether any was not wanted before. In each
    quadrant they are below a staircase that only descends, away from the axis."""
    before, (i, j) = int(wanted.sum()), (int(np.abs(s).argmin()) for s in (u, v))
    if not near.inside.any():
        wanted[:] = True
        return before < wanted.size
    for i_side, j_side in product((1, -1), (1, -1)):
        inside = near.inside[::i_side, ::j_side]
        ends, heights = (
            side * known[::side][np.clip(np.arange(len(known)) + past, 0, len(known) - 1)]
            for side, known in ((i_side, near.u), (j_side, near.v))
        )
        last = inside.shape[1] - 1 - inside[:, ::-1].argmax(axis=1)
        steps = np.append(np.where(inside.any(axis=1), heights[last], -np.inf), -np.inf)
        steps = np.maximum.accumulate(steps[::-1])[::-1]  # height of each step up to its end
        along, across = np.abs(u[i::i_side]), np.abs(v[j::j_side])
        here, shifted = np.searchsorted(ends, along), np.searchsorted(ends + margin[0], along)
        highest = np.maximum(steps[shifted], steps[here] + margin[1])
        wanted[i::i_side, j::j_side] |= across <= highest[:, None]
    return int(wanted.sum()) > before


@dataclass(frozen=True, eq=False)
class LatticeLines:
    """The lines of the lattice that can touch a target.

    Args:
        u: offsets of the lines of family v, which cross the u axis [m].
        v: offsets of the lines of family u [m].
        nodes: the u and the v of all nodes of the finer march [m].
    """

    u: Floats
    v: Floats
    nodes: tuple[Floats, Floats]


def find_lines(
    target: Target,
    layout: GridLayout,
    start: Axes,
    near: Covering | None,
    parts: int,
    heights: Heights = ON_SURFACE,
) -> tuple[LatticeLines, Covering]:
    """The lattice lines that can touch the target, and `MARGIN` spacings more; and the march that found them.

    Args:
        near: a net that may be similar, or None.
        parts: steps of the march per spacing.

    Raises:
        InputError: there would be too many lines or nodes, or none inside the target.
    """
    step, margin = _across(layout) / parts, MARGIN * _across(layout)
    spare = np.repeat(margin, 2)
    near = near or _stride(target, start, heights)
    reach = np.minimum(near.reach(1) + spare, 4 * target.size)
    for _ in range(12):
        steps = np.ceil(reach / step.repeat(2)).reshape(2, 2)
        counts = steps.sum(axis=1) + 1
        if counts.prod() > limit(MOST_NODES) / 10:
            counted = " x ".join(f"{count // parts:.0f}" for count in counts)
            raise InputError(
                f"the net needs more than {counted} lines, {length_text(min(layout.spacing))} apart on a target "
                f"{length_text(2 * target.size)} wide: check its unit, use {_coarser(target)}, "
                f"{raised(MOST_NODES, 10 * counts.prod())}"
            )
        u, v = (np.arange(-steps[k, 0], steps[k, 1] + 1) * step[k] for k in (0, 1))
        near = march_covering(target, u, v, start, margin, near, heights=heights, converged=_FAIR)
        if not near.inside.any():
            raise InputError("no node of the net is inside the target: move the anchor away from the rim")
        needed = near.reach(0) + spare
        if (needed <= reach + 1e-12).all():
            break
        reach = np.where(needed > reach, np.maximum(needed, 1.5 * reach), reach)
    u, v = _lattice(layout, 1, needed[0], needed[1]), _lattice(layout, 0, needed[2], needed[3])
    across, along = _steps(u, layout.edge), _steps(v, layout.edge)
    _refuse_too_many(target, layout, int(across.sum()) + 1, int(along.sum()) + 1)
    return LatticeLines(u, v, (_divided(u, across), _divided(v, along))), near


def _across(layout: GridLayout) -> Floats:
    """(2,) distance of the lines crossed along u, which are those of family v, and along v [m]."""
    return np.array(layout.spacing[::-1])


def _stride(target: Target, start: Axes, heights: Heights) -> Covering:
    """The first net, in long steps: its axes, and the nodes between the parts of them that are inside."""
    s: Floats = np.arange(-STRIDES, STRIDES + 1) * np.float64(_STRIDE * target.size)
    net = Net(s, s, np.full((len(s), len(s), 3), np.nan), heights=heights)
    lay_axes(target, net, start, tolerance=ROUGH)
    inside = target.margin(np.concatenate([net.points[:, STRIDES], net.points[STRIDES]])).reshape(2, -1) > 0
    rows, columns = (_around(axis) for axis in inside)
    fill_quadrants(target, net, rows[:, None] & columns, tolerance=ROUGH)
    return Covering(s, s, net.points, inside_nodes(target, net), heights=heights)


def _around(inside: Bools) -> Bools:
    """Nodes of an axis from one before the first inside, or the anchor, to one past the last; all where none is."""
    on = np.flatnonzero(inside).tolist() or [0, len(inside)]
    around = np.zeros_like(inside)
    around[max(min(on[0], STRIDES) - 1, 0) : max(on[-1], STRIDES) + 2] = True
    return around


def _lattice(layout: GridLayout, family: int, below: float, above: float) -> Floats:
    """Offsets of the lattice lines of a family from -below to above, and of the axis."""
    spacing = layout.spacing[family]
    offsets = layout.lattice(family, -below, above)
    offsets[np.abs(offsets) < 1e-9 * spacing] = 0.0
    return offsets if (offsets == 0.0).any() else np.sort(np.append(offsets, 0.0))


def march_lines(
    target: Target,
    layout: GridLayout,
    lines: LatticeLines,
    start: Axes,
    every: int,
    *near: Covering,
    heights: Heights = ON_SURFACE,
) -> Covering:
    """March the net of lines at every node, or at every second.

    Args:
        near: one or two nets in longer steps, the finer first.
    """
    u, v = (np.ascontiguousarray(nodes[::every]) for nodes in lines.nodes)
    return march_covering(target, u, v, start, MARGIN * _across(layout), *near, heights=heights)


def _refuse_too_many(target: Target, layout: GridLayout, across: int, along: int) -> None:
    """Refuse a finer march with more nodes than the memory should hold."""
    if across * along > limit(MOST_NODES):
        auto = auto_edge(layout.spacing)
        fine = layout.edge < 0.99 * auto
        remedy = f'set layout.edge = "auto" ({length_text(auto)} here)' if fine else f"use {_coarser(target)}"
        raise InputError(
            f"the net would have {across} x {along} nodes, with edges of {length_text(layout.edge)} on a target "
            f"{length_text(2 * target.size)} wide: check its unit, {remedy}, {raised(MOST_NODES, across * along)}"
        )


def _coarser(target: Target) -> str:
    return f"a larger spacing, such as {length_text(target.size / 8)}"


def _steps(offsets: Floats, edge: float) -> Ints:
    """Steps from line to line: an even number of at least six, as many as edges if these are enough."""
    edges = edge_counts(np.diff(offsets), edge)
    return np.where(edges < _FEWEST_STEPS, 2 * np.maximum(_FEWEST_STEPS // 2, edges), edges + edges % 2)


def _divided(offsets: Floats, steps: Ints) -> Floats:
    """Material coordinates of nodes, in `steps` (n - 1,) from each of the `offsets` (n,) to the next."""
    part, count = np.repeat(np.arange(len(steps)), steps), int(steps.sum())
    step = np.arange(count) - (np.cumsum(steps) - steps)[part]
    return np.append(offsets[part] + np.diff(offsets)[part] * step / steps[part], offsets[-1])
