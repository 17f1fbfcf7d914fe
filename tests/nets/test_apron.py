"""The apron of a net, against a twin in plain loops, line by line as `with_apron` says."""

import numpy as np
import pytest

import rodshell as rs
from rodshell.layout.flatgrid import whole_rods
from rodshell.layout.gridlayout import lattice_rod
from rodshell.nets.apron import RINGS, with_apron
from rodshell.nets.compass import Net

LINES = np.arange(-4.0, 5.0)
CLEARANCE = 0.3


def random_net(seed: int) -> tuple[np.random.Generator, Net, np.ndarray]:
    """A net of 9 x 9 lines with two nodes between them, of which a sixth is missing; and where the lines cross."""
    random = np.random.default_rng(seed)
    s = np.linspace(-4.0, 4.0, 25)
    points = np.zeros((25, 25, 3))
    points[random.random((25, 25)) < 1 / 6] = np.nan
    return random, Net(s, s, points), np.isfinite(points[::3, ::3, 0])


def random_rods(random: np.random.Generator) -> list[rs.FlatRod]:
    """Pieces of half of the lines, one or two on each."""
    rods = []
    for family, letter in enumerate("UV"):
        for k in random.choice(9, 5, replace=False).tolist():
            cuts = np.sort(random.uniform(-3.5, 3.5, 4)).tolist()
            rods += [
                lattice_rod(family, f"{letter}{k}{n}", float(LINES[k]), *cuts[2 * n : 2 * n + 2])
                for n in range(1 + k % 2)
            ]
    return rods


def stretches(live: np.ndarray) -> list[list[int]]:
    """Runs of nodes of a line that the net has."""
    runs: list[list[int]] = [[]]
    for node, there in enumerate(live):
        if there:
            runs[-1].append(node)
        elif runs[-1]:
            runs.append([])
    return [run for run in runs if run]


def home(rod: rs.FlatRod, live: np.ndarray) -> list[int]:
    """The stretch of a line with the node nearest to the middle of a rod."""
    nearest = min(np.flatnonzero(live), key=lambda node: abs(LINES[node] - 0.5 * (rod.start + rod.end)))
    (run,) = (run for run in stretches(live) if nearest in run)
    return run


def twin(rods: list[rs.FlatRod], crossings: np.ndarray) -> set[tuple[str, float, float, float, str]]:
    """Family, offset, start, end and name (of virtual rods "") of each rod of the flat grid."""
    alive = {"u": crossings.T, "v": crossings}  # by line and by the line that crosses it
    held: dict[tuple[str, int, tuple[int, ...]], list[rs.FlatRod]] = {}
    for rod in rods:
        line = int(np.flatnonzero(rod.offset == LINES)[0])
        held.setdefault((rod.family, line, tuple(home(rod, alive[rod.family][line]))), []).append(rod)
    joints = set()  # (line of family u, line of family v)
    for (family, line, _), pieces in held.items():
        start, end = min(rod.start for rod in pieces), max(rod.end for rod in pieces)
        before = [node for node in range(9) if LINES[node] <= start - CLEARANCE][-RINGS:]
        after = [node for node in range(9) if LINES[node] >= end + CLEARANCE][:RINGS]
        within = [node for node in range(9) if start - CLEARANCE < LINES[node] < end + CLEARANCE]
        for node in before + within + after:
            if alive[family][line, node]:
                joints.add((line, node) if family == "u" else (node, line))
    found = set()
    for family in ("u", "v"):
        for line in range(9):
            for run in stretches(alive[family][line]):
                own = held.get((family, line, tuple(run)), [])
                there = [n for n in run if ((line, n) if family == "u" else (n, line)) in joints]
                if own or len(there) > 1:
                    reach = [float(LINES[n]) for n in there] + [s for rod in own for s in (rod.start, rod.end)]
                    name = own[0].name if own else ""
                    found.add((family, float(LINES[line]), min(reach), max(reach), name))
    return found


@pytest.mark.parametrize("seed", range(12))
def test_rods_are_prolonged_as_a_twin_in_plain_loops_prolongs_them(seed: int) -> None:
    random, net, crossings = random_net(seed)
    rods = random_rods(random)
    grid, whole = with_apron(rods, net, (LINES, LINES), CLEARANCE)
    found = {(rod.family, rod.offset, rod.start, rod.end, "" if rod.virtual else rod.name) for rod in grid.rods}
    assert found == twin(rods, crossings)
    assert any(rod.virtual for rod in grid.rods)
    np.testing.assert_array_equal(whole, whole_rods(grid.rods, rods))
