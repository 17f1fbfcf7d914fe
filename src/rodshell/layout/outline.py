"""The outlines of a flat grid: closed curves through its rod ends, around it and around each of its openings.

Nothing but the rods says in which order their ends follow each other: the grid is a plane graph, and a walk around one
of its faces, keeping it on the left, meets the ends that stick out into that face in their order.
"""

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.layout.flatgrid import FlatGrid, FlatRod
from rodshell.layout.mesh import mesh_grid

FEWEST = 3  # ends of an outline


def outlines(rods: Floats) -> list[Ints]:
    """Find the outlines of a flat grid.

    Grids that do not touch each other have one outline each. No end is in two outlines, and none has fewer than three.

    Parameters
    ----------
    rods : (m, 2, 2) the two ends of each straight rod [m].

    Returns
    -------
    For each outline the ends (k,) along it, 2 r for the start of rod r and 2 r + 1 for its end: counterclockwise around
    a grid, clockwise around an opening. Outlines with most ends come first.
    """
    if not len(rods):
        return []
    graph = mesh_grid(FlatGrid.of([_line(ends) for ends in rods]), np.inf)
    ends_at = dict[int, list[int]]()
    for end, node in enumerate(graph.ends.ravel().tolist()):
        ends_at.setdefault(node, []).append(end)
    faces = [[node for node in face if node in ends_at] for face in _faces(graph.edges, graph.flat)]
    result, done = list[Ints](), set[int]()
    for face in sorted(faces, key=len, reverse=True):
        here = [node for node in dict.fromkeys(face) if node not in done]
        ends = [end for node in here for end in ends_at[node]]
        if len(ends) >= FEWEST:
            result.append(np.array(ends[::-1], dtype=np.intp))
            done.update(here)
    return result


def _line(ends: Floats) -> FlatRod:
    along = ends[1] - ends[0]
    length = float(np.hypot(*along))
    (x, y), (dx, dy) = ends[0].tolist(), (along / length).tolist()
    return FlatRod("", "free", 0.0, 0.0, length, (x, y), (dx, dy))


def opens(outline: Floats) -> bool:
    """Whether an outline of points (k, 2) runs around an opening."""
    x, y = outline.T
    return bool(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) < 0)


def _faces(edges: Ints, flat: Floats) -> list[list[int]]:
    """Nodes around each face of a plane graph: from an edge to the next one on its left."""
    both = np.concatenate([edges, edges[:, ::-1]])
    along = flat[both[:, 1], :2] - flat[both[:, 0], :2]
    turned = np.lexsort((np.arctan2(along[:, 1], along[:, 0]), both[:, 0]))
    fans = dict[int, list[int]]()
    for start, stop in both[turned].tolist():
        fans.setdefault(start, []).append(stop)
    onward = dict[tuple[int, int], tuple[int, int]]()
    for node, fan in fans.items():
        for k, other in enumerate(fan):
            onward[other, node] = (node, fan[k - 1])  # the next one clockwise from where it came
    faces = list[list[int]]()
    while onward:
        step, face = next(iter(onward)), list[int]()
        while step in onward:
            face.append(step[1])
            step = onward.pop(step)
        faces.append(face)
    return faces
