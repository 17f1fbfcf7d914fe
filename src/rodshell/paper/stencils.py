"""Figures 2, 3 and 5 in one: unknowns and stencils of a rod, of rods with linkers, and of a node in contact.

Which nodes and angles belong together is read from the elements themselves, and contact is asked of the target.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from rodshell.arrays import Floats
from rodshell.joints import Coupling, ImplicitPenalty, Linker, SharedDofs
from rodshell.layout import mesh_grid, straight_rods
from rodshell.model import Shell
from rodshell.model.elastic_rod import ElasticRod
from rodshell.output.drawing import FAMILIES
from rodshell.output.svg import label, tag
from rodshell.paper.figure import FINAL, FLAT, INK, PANEL, ROD, SOFT, Figure, Part, Row, joined, rows_of_panels
from rodshell.progress import Progress
from rodshell.rods.elements import is_bends
from rodshell.targets import Hemisphere

EDGE, NODES = 5e-3, 5
RADIUS, DEPTH = 0.2, 0.02  # [m] of the section in contact; deep, to be seen
COLUMNS = ("figure", "what", "unknowns", "bend stencils", "ties of nodes", "of angles")
Drawn = dict[int, Floats]  # of blocks, in a panel


@dataclass(frozen=True)
class Counted(Part):
    """The unknowns and stencils of one drawing, as the table shows them."""

    cells: Row

    def rows(self) -> list[Row]:
        return [self.cells]

    def result(self) -> dict[str, Any]:
        return dict(zip(COLUMNS, self.cells, strict=True))


@dataclass(frozen=True)
class Stencils(Figure):
    """A rod, and the basic element with shared and with separate unknowns."""

    parts: tuple[Counted, ...]
    rod: ElasticRod
    shared: Shell
    separate: Shell
    name, columns, key = "stencils", COLUMNS, "rows"
    title = "Figs 2, 3, 5 [HQK]: unknowns and stencils, of a rod of 5 nodes and of two such rods with two linkers"

    def pictures(self) -> dict[str, str]:
        """Both rows of panels."""
        rods = [
            ("Fig 2: nodes, angles, one bend's stencil (bold)", list(_rod(self.rod))),
            ("Fig 3 (a): one node at the joint, two linkers", list(_element(self.shared))),
            ("Fig 3 (b): rods and linkers apart, ties dashed", list(_element(self.separate))),
            ("Fig 5: depth and normal (green); as printed (violet)", list(_contact())),
        ]
        return {"stencils": rows_of_panels([("Unknowns and stencils", rods)])}


def make(_: Progress) -> Stencils:
    """The rod and the elements."""
    line = np.linspace([0.0, 0.0, 0.0], [(NODES - 1) * EDGE, 0.0, 0.0], NODES)
    rod, shared, separate = ElasticRod.of(line, ROD), _shell(SharedDofs()), _shell(ImplicitPenalty())
    rows = (
        ("Fig 2", f"rod of N = {NODES} nodes, 4N - 1", str(rod.freedom().size), str(NODES - 2), "-", "-"),
        ("Fig 3 (a)", "two rods and linkers on shared unknowns", *_counts(shared)),
        ("Fig 3 (b)", "the same as rods of their own", *_counts(separate)),
        ("Fig 5", "node in contact", "2 of 3", "-", "-", "-"),
    )
    return Stencils(tuple(map(Counted, rows)), rod, shared, separate)


def _shell(coupling: Coupling) -> Shell:
    half = 2 * EDGE
    grid = straight_rods([[[half, 0], [-half, 0]], [[0, -half], [0, half]]])
    return Shell.of(mesh_grid(grid, EDGE), ROD, joint=Linker(), coupling=coupling, twist=True)


def _counts(shell: Shell) -> Row:
    bends = sum(len(element.blocks) for element in shell.elements if element.blocks.shape[1] == NODES)
    nodes = shell.like < shell.mesh.node_count
    of_nodes = [bool(nodes[tie[0]]) for element in shell.between for tie in element.blocks]
    return str(shell.freedom().size), str(bends), str(sum(of_nodes)), str(len(of_nodes) - sum(of_nodes))


def _rod(rod: ElasticRod) -> Iterator[str]:
    """An arc: nodes x_i, angles theta_i at the middles of edges, and the second of three stencils."""
    turn = np.linspace(-0.9, 0.9, NODES)
    nodes = 0.5 * PANEL + 0.42 * PANEL * np.column_stack([np.sin(turn) / np.sin(0.9), 1.2 - 1.6 * np.cos(turn)])
    drawn = dict(enumerate(nodes)) | {NODES + k: (nodes[k] + nodes[k + 1]) / 2 for k in range(NODES - 1)}
    yield _line(nodes, INK, 1.2)
    yield _line(np.array([drawn[block] for block in rod.elements[0].blocks[1]]), FAMILIES[0], 3.5)
    for block, at in drawn.items():
        node, number = block < NODES, block % NODES + 1
        yield from _mark(at, f"x{number}" if node else f"\N{GREEK SMALL LETTER THETA}{number}", INK, hollow=not node)


def _element(shell: Shell) -> Iterator[str]:
    """Two rods and two linkers, each on its own blocks; those that are tied are joined by dashed lines."""
    linkers = next(element for element in shell.within if not is_bends(element)).blocks
    apart = _apart(shell)
    drawn = _drawn(shell, linkers)
    for number, blocks in enumerate(linkers.tolist()):
        yield _line(np.array([drawn[block] for block in blocks[::2]]), FLAT, 3.0 if apart else 8.0, stroke_opacity=0.6)
        for k, block in enumerate(blocks[::2] if apart else ()):
            yield from _mark(drawn[block], f"x^{number + 1},{k + 1}", FLAT)
    for rod in (0, 1):
        blocks = shell.node_blocks[rod * NODES : (rod + 1) * NODES]
        yield _line(np.array([drawn[block] for block in blocks.tolist()]), FAMILIES[rod], 1.6)
        for k, block in enumerate(blocks.tolist()):
            yield from _mark(
                drawn[block], f"x{rod + 1},{k + 1}" if apart or k != 2 else "joint" if rod else "", FAMILIES[rod]
            )
    for element in shell.between:
        for a, b in element.blocks.tolist():
            yield _line(np.array([drawn[a], drawn[b]]), SOFT, 0.9, stroke_dasharray="3 2")


def _apart(shell: Shell) -> bool:
    """Whether both rods have a node of their own at the joint."""
    return len(set(shell.node_blocks.tolist())) == len(shell.node_blocks)


def _drawn(shell: Shell, linkers: np.ndarray) -> Drawn:
    """Where each block is drawn: in the flat grid; rods and linkers that are apart aside from each other."""
    mesh, scale = shell.mesh, 0.42 * PANEL / (2 * EDGE)
    flat = 0.5 * PANEL + scale * mesh.flat[:, :2] * [1.0, -1.0]
    middles = (flat[mesh.edges[:, 0]] + flat[mesh.edges[:, 1]]) / 2
    at = np.vstack([flat, middles])
    drawn: Drawn = {block: at[like].copy() for block, like in enumerate(shell.like.tolist())}
    if not _apart(shell):
        return drawn
    angles = shell.first_angle + NODES - 1  # of rod 2
    for block in (*range(NODES, 2 * NODES), *range(angles, angles + NODES - 1)):
        drawn[block] += [9.0, -9.0]
    for blocks in linkers.tolist():
        ends = (drawn[blocks[0]] + drawn[blocks[-1]]) / 2 - drawn[blocks[2]]
        for block in blocks:
            drawn[block] += 1.3 * ends
    return drawn


def _contact() -> Iterator[str]:
    """A section of the hemisphere with its wall: a node that fell in, and a tail inside the wall."""
    target, scale = Hemisphere(RADIUS), 0.8 * PANEL / RADIUS

    def at(points: Iterable[Iterable[float]]) -> Floats:
        x = np.array([list(point) for point in points])
        return np.asarray(np.column_stack([0.04 * PANEL + scale * x[:, 0], 0.86 * PANEL - scale * x[:, 2]]))

    turn = np.linspace(0, np.pi / 2, 60)
    rim = [(RADIUS, 0.0, -0.028)]
    yield _line(at([*(RADIUS * np.column_stack([np.sin(turn), 0 * turn, np.cos(turn)])).tolist(), *rim]), INK, 1.6)
    fallen = (RADIUS - DEPTH) * np.array([np.sin(0.6), 0.0, np.cos(0.6)])
    tail = np.array([RADIUS - DEPTH, 0.0, -0.02])
    for node, name in ((fallen, "x'"), (tail, "tail")):
        gap = target.contact(node[None])
        yield _line(at([node, node - gap.distance[0] * gap.normal[0]]), FLAT, 2.5)
        height = float(target.height_at(node[None, :2])[0])
        normal = np.array([node[0] / height, 0.0, 1.0])
        yield _line(
            at([node, node + (height - node[2]) / (normal @ normal) * normal]), FINAL, 1.2, stroke_dasharray="4 2"
        )
        yield from _mark(at([node])[0], name, INK)
    start = fallen * 1.18
    yield _line(at([start, fallen]), SOFT, 0.9, stroke_dasharray="2 2")
    yield from _mark(at([start])[0], "x(t)", SOFT)
    for text, place in (("z = f(x, y)", (0.02, 0.0, RADIUS - 0.02)), ("wall", (RADIUS + 0.004, 0.0, -0.02))):
        x, y = at([place])[0].tolist()
        yield label(text, x, y, 10.0, fill=SOFT)


def _line(points: Floats, colour: str, width: float, **more: str | float) -> str:
    return tag("polyline", points=joined(points), fill="none", stroke=colour, stroke_width=width, **more)


def _mark(at: Floats, text: str, colour: str, *, hollow: bool = False) -> Iterator[str]:
    x, y = at.tolist()
    yield tag("circle", cx=x, cy=y, r=2.6, fill="#ffffff" if hollow else colour, stroke=colour)
    yield label(text, x + 4, y - 5, 9.0, fill=colour)
