"""Shells under loads: balance, work, the two bare shells against the twin, bracing, cables, bad input."""

import contextlib
import io
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

import rodshell as rs
from rodshell.cli import main
from rodshell.loads.check import _load, _locked, tributary_of
from rodshell.loads.locked_joints import locked as with_locked_joints
from rodshell.loads.nodes import LoadedNodes
from rodshell.loads.structure import Structure
from rodshell.rods.cable import CableStretch
from rodshell.solve.equilibrium import find_equilibrium
from rodshell.solve.imperfection import imperfect
from rodshell.solve.load_path import load_path
from rodshell.solve.modes import linear_buckling
from tests.acceptance.rows import Row
from tests.loads.braced_twin import BracedTwin

TUBE = rs.Rod(rs.Tube(radius=0.0417 / 2, thickness=0.0035), rs.Material(25e9, 1750, 0.3))
LARCH = rs.Rod(rs.RectangularSection(width=0.035, height=0.05), rs.Material.preset("larch"))
ROPE = rs.Rod(rs.Circle(0.003), rs.Material(160e9, 7850, 0.3))
SNOW = 1000.0  # N/m2
NAMES = {"cap": "tube 41.7 x 3.5, cap R 10 base 4", "paraboloid": "larch 50 x 35, 16 m, rise 4"}
BRACING = {
    "cables": rs.Cables(rod=ROPE, prestrain=1e-3),
    "cables to the supports": rs.Cables(rod=ROPE, prestrain=1e-3, ends_at="supports"),
    "third layer": rs.Laths(),
    "third layer, 40 mm above": rs.Laths(eccentricity=0.04),
}


@cache
def shell(name: str, spacing: float = 1.0, edge: float = 1 / 6, joint: rs.Pin | rs.Ball | None = rs.Pin()) -> rs.Form:
    """The two shells; `joint` is that of the laths."""
    layout = rs.GridLayout.orthogonal(spacing=spacing, edge=edge)
    if name == "cap":
        return rs.find_form(rs.Cap(10.0, 4.0), layout, TUBE, ends="both")
    return rs.find_form(rs.Paraboloid(8.0, 4.0), layout, LARCH, ends="both", joint=joint)


def asked(bracing: object = None, **loads: object) -> rs.Loads:
    """Each load as a combination of its own, and all together."""
    combinations = {name: {name: 1.0} for name in loads} | {"all": dict.fromkeys(loads, 1.0)}
    return rs.Loads(
        loads=loads, combinations=combinations, bracing=bracing,  # type: ignore[arg-type]
        stability=rs.Stability(imperfection="span/500"),
    )  # fmt: skip


def nodes_of(form: rs.Form, ends: str) -> LoadedNodes:
    popped = form.popped[ends]  # type: ignore[index]
    mass = popped.shell.mass[: popped.shell.node_count, 2]
    return LoadedNodes(popped.positions, mass, tributary_of(form.patches[0]), min(form.layout.spacing))


def balance_rows() -> Iterator[Row]:
    """Reactions of every combination, both end conditions, bare and braced."""
    for name in NAMES:
        for words, bracing in {"bare": None, **BRACING}.items():
            loads = asked(bracing, own=rs.SelfWeight(cladding=1.0), wind=rs.Wind(20.0, "-0.8 + 0.05*x"))
            found = rs.check_loads(shell(name), replace(loads, stability=rs.Stability(modes=1)))
            shells = [loaded for by_ends in found.shells.values() for loaded in by_ends.values()]
            off = max(np.abs(one.reaction_sum + one.load_sum).max() / np.linalg.norm(one.load_sum) for one in shells)
            note = f"{len(shells)} of combinations and ends"
            yield Row(NAMES[name], f"{words}: reactions off minus the loads", float(off), 1e-9, note=note)


def locked_rows() -> Iterator[Row]:
    """Pins tightened after erection: nothing changes until loads come, and then the shell resists shear."""
    form = shell("paraboloid")
    structure = Structure.erected(form.popped["pinned"], form.rod)
    locked = with_locked_joints(rs.LockedJoints(shear=5e3), structure)
    again = find_equilibrium(locked.equilibrium.problem, locked.equilibrium.state, locked.equilibrium.forces)
    moved = 1e3 * float(np.abs(again.state - structure.equilibrium.state).max())
    yield Row(NAMES["paraboloid"], "joints locked at 5 kN m/rad: the shell moves", moved, 1e-6, "mm")
    snow = rs.Loads(loads={"snow": rs.Snow(SNOW)}, combinations={"snow": {"snow": 1.0}})
    free, tight = (
        rs.check_loads(form, replace(snow, locked_joints=joints)).shells["snow"]["pinned"]
        for joints in (None, rs.LockedJoints(shear=5e3))
    )
    assert free.limit_factor
    assert tight.limit_factor
    gain = free.limit_factor / tight.limit_factor
    note = f"{free.limit_factor:.3f} and {tight.limit_factor:.3f} kN/m2"
    yield Row(NAMES["paraboloid"], "snow: limit with free joints, over locked ones", gain, 0.8, note=note)
    off = np.abs(tight.reaction_sum + tight.load_sum).max() / np.linalg.norm(tight.load_sum)
    yield Row(NAMES["paraboloid"], "joints locked: reactions off minus the loads", float(off), 1e-9)


def work_rows() -> Iterator[Row]:
    """Snow and then wind, wind and then snow, both at once: one state, one energy, one work."""
    form = shell("cap")
    structure = Structure.erected(form.popped["pinned"], form.rod)
    loads = asked(snow=rs.Snow(15.0), wind=rs.Wind(30.0, "-0.5 + 0.05*x"))
    nodes = nodes_of(form, "pinned")
    acting = {name: _load(structure, nodes, loads, factors) for name, factors in loads.combinations.items()}
    ways = []
    for order in (("all",), ("snow", "wind"), ("wind", "snow")):
        found = structure.equilibrium
        for name in order:
            reached = load_path(found, acting[name], most=1.5).at(1.0)
            assert reached is not None
            found = reached
        forces = acting["all"].forces
        assert forces is not None
        work = float(np.sum(forces * (found.state - structure.equilibrium.state)))
        ways.append((work, replace(found.problem, load=None).potential(found.state) - structure.equilibrium.energy))
    for what, column in (("work", 0), ("elastic energy", 1)):
        off = max(abs(way[column] / ways[0][column] - 1) for way in ways[1:])
        yield Row(NAMES["cap"], f"{what} depends on the order of loads", off, 1e-8)


def bare_rows() -> Iterator[Row]:
    """Snow on the bare shells: path, linear factor, twin. The twin is slow and has ball joints: both shells are
    compared with it at 2 m, with these."""
    heights = {
        "cap": (lambda x, y: np.sqrt(np.maximum(100.0 - x**2 - y**2, 0.0)), np.sqrt(84.0)),
        "paraboloid": (lambda x, y: 4.0 * (1 - (x**2 + y**2) / 64), 8.0),
    }
    for name in NAMES:
        found = rs.check_loads(shell(name), asked(snow=rs.Snow(SNOW))).shells["snow"]["pinned"]
        assert found.limit_factor
        assert found.linear_factor
        note = f"{found.limit_factor:.4f} kN/m2 ({found.limit_kind}), linear {found.linear_factor:.4f}"
        off = 100 * abs(found.linear_factor / found.limit_factor - 1)
        yield Row(NAMES[name], "snow: linear factor off the path's", off, 10, "%", note)
        coarse = shell(name, 2.0, 1.0, None)
        ours = rs.check_loads(coarse, asked(snow=rs.Snow(SNOW))).shells["snow"]["pinned"]
        height, radius = heights[name]
        twin = BracedTwin(coarse.popped["pinned"], coarse.rod, snow=SNOW, height=height, radius=radius)
        limit, _ = twin.load_factor(accuracy=2e-3)
        linear = twin.linear_factor(twin.state)
        assert ours.limit_factor
        assert ours.linear_factor
        off = 100 * abs(ours.limit_factor / limit - 1)
        yield Row(NAMES[name], "limit off the twin's", off, 1, "%", f"{ours.limit_factor:.4f}, {limit:.4f}")
        off = 100 * abs(ours.linear_factor / linear - 1)
        yield Row(NAMES[name], "linear factor off the twin's", off, 1, "%", f"{ours.linear_factor:.4f}, {linear:.4f}")


def braced_rows() -> Iterator[Row]:
    """Work of the braced shells' paths under snow."""
    for name in NAMES:
        form = shell(name)
        for words, bracing in BRACING.items():
            loads = asked(bracing, snow=rs.Snow(SNOW))
            structure = _locked(form.popped["pinned"], "pinned", loads, form.patches[0])
            nodes = replace(nodes_of(form, "pinned"), mass=structure.mass)
            load = _load(structure, nodes, loads, {"snow": 1.0})
            path = load_path(structure.equilibrium, load)
            buckling = linear_buckling(structure.equilibrium, load, 3, most=100.0)
            note = f"{path.factor:.3f} kN/m2 ({path.limit}), linear {buckling.factors[0]:.3f}"
            yield Row(NAMES[name], f"{words}: factorisations of the path", path.factorizations, 60, note=note)
            yield Row(NAMES[name], f"{words}: path not followed to its end", float(path.limit == "lost"), 0)
            bent = load_path(imperfect(structure.equilibrium, buckling.shapes, 0.032), load)
            note = f"{bent.factor:.3f} kN/m2 ({bent.limit})"
            yield Row(NAMES[name], f"{words}: the same, imperfect", bent.factorizations, 60, note=note)


def cable_rows() -> Iterator[Row]:
    """Two cables in a line, loaded across at the middle; and slack."""
    for share in (0.01, 0.05):
        state = np.array([[-3.0, 0, 0], [0, 0, -3.0 * share], [3.0, 0, 0]])
        cables = CableStretch(np.array([[0, 1], [1, 2]]), np.array([3.0, 3.0]), np.array([4e6, 4e6]))
        gradient = np.zeros((3, 3))
        cables.evaluate(state, gradient)
        off = 100 * abs(-gradient[1, 2] / (4e6 * share**3) - 1)
        yield Row(f"flat cable, d/L = {share}", "force off EA (d/L)^3", off, 0.5, "%")
    gradient, hessians = np.zeros((3, 3)), np.ones((2, 6, 6))
    slack = CableStretch(cables.blocks, np.array([3.1, 3.1]), cables.stiffness)
    carried = abs(slack.evaluate(state, gradient, hessians)) + np.abs(gradient).sum() + np.abs(hessians).sum()
    yield Row("slack cable", "energy, force and stiffness", float(carried), 0)


OWN = '[[loads]]\nname = "own"\nkind = "self_weight"\n'
SNOWY = '[[loads]]\nname = "snow"\nkind = "snow"\nvalue = "0.5 kN/m2"\n'
WINTER = '[[combinations]]\nname = "winter"\nfactors = { snow = 1.5 }\n'
ROOF = """[target]
kind = "paraboloid"
radius = 6.0
height = 3.0
[layout]
spacing = 2.0
edge = 1.0
[pop_up]
ends = "pinned"
[rod]
"""
TUBES = 'section = { kind = "tube", radius = 0.021, thickness = 0.0035 }\nmaterial = { preset = "gfrp" }\n'
GIVEN = 'section = { kind = "given", EA = 1e7, EI1 = 2e3, EI2 = 2e3, GJ = 1e3, mass = 1.0 }\n[checks]\nstrength = 1e8\n'
MESH = 'kind = "mesh"\nfile = "vault.obj"\nunit = "m"'
VAULT = ROOF.replace('kind = "paraboloid"\nradius = 6.0\nheight = 3.0', MESH).replace("2.0", "1.0")
ROPES = (
    '[bracing]\nkind = "cables"\nsection = { kind = "circle", radius = 0.003 }\nmaterial = { youngs_modulus = 160e9 }\n'
)
PLANE = """[target]
kind = "heightfield"
formula = "1 + 0*x"
domain = "rectangle"
size = [8.0, 6.0]
[layout]
spacing = 1.5
[pop_up]
ends = "clamped"
[rod]
section = { kind = "rectangle", width = 0.035, height = 0.05 }
material = { preset = "larch" }
"""
BAD = {
    "a negative load": (ROOF + TUBES, SNOWY.replace("0.5", "-0.5") + WINTER, "must not be negative"),
    "a load's unknown kind": (
        ROOF + TUBES, SNOWY.replace('"snow"\nv', '"hail"\nv') + WINTER, 'kind of load 1 ("snow") must be',
    ),
    "an unknown load in a combination": (ROOF + TUBES, OWN + WINTER, 'factor for "snow", which is not a load'),
    "an unknown key": (ROOF + TUBES, SNOWY + "depth = 3\n" + WINTER, 'unknown key depth of load 1 ("snow")'),
    "loads without combinations": (ROOF + TUBES, SNOWY, "has no combinations"),
    "bracing without a section": (
        ROOF + TUBES, SNOWY + WINTER + '[bracing]\nkind = "cables"\n', "bracing.section is missing",
    ),
    "an unknown support": (
        ROOF + TUBES,
        '[[loads]]\nname = "snow"\nkind = "settlement"\nsupports = ["X1.0"]\nmove = ["0 m", "0 m", "-1 mm"]\n' + WINTER,
        "which the shell does not have",
    ),
    "strength without fibres": (ROOF + GIVEN, SNOWY + WINTER, "fibre"),
    "bracing across an opening": (VAULT + TUBES, SNOWY + WINTER + ROPES, "cross an opening"),
    "locked joints that are balls": (
        ROOF + TUBES, SNOWY + WINTER + '[locked_joints]\nshear = "2 kN m/rad"\n', "ball joints cannot be locked",
    ),
    "supports that leave a mechanism": (PLANE, SNOWY + WINTER, "turning about itself (a mechanism)"),
    "no such file": (ROOF + TUBES, None, "there is no such file"),
}  # fmt: skip


def vault() -> str:
    """A vault of 6 by 6 m with a hole within a cell, as OBJ."""
    ticks = np.linspace(-3.0, 3.0, 61)
    x, y = (part.ravel() for part in np.meshgrid(ticks, ticks, indexing="ij"))
    index = np.arange(61 * 61).reshape(61, 61)
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1).reshape(-1, 4)
    quads = quads[(np.hypot(x - 0.5, y - 0.5) > 0.28)[quads].all(axis=1)]
    lines = [f"v {a} {b} {1.0 - 0.04 * a * a - 0.05 * b * b}" for a, b in zip(x, y, strict=True)]
    return "\n".join([*lines, *("f " + " ".join(str(k + 1) for k in quad) for quad in quads.tolist())])


def bad_rows() -> Iterator[Row]:
    """Bad input: exit 2 and one sentence on stderr."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "vault.obj").write_text(vault())
        for what, (case, loads, wanted) in BAD.items():
            (folder / "roof.toml").write_text(case)
            (folder / "loads.toml").unlink(missing_ok=True)
            if loads is not None:
                (folder / "loads.toml").write_text(loads)
            said = io.StringIO()
            with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
                files = [str(folder / "roof.toml"), "--loads", str(folder / "loads.toml")]
                code = main(["check", *files, "--out", str(folder / "out"), "--quiet"])
            sentence = said.getvalue().strip()
            wrong = code != 2 or wanted not in sentence or "\n" in sentence
            yield Row("bad input", what, float(wrong), 0, note=f"exit {code}: {sentence[:110]}")


def all_rows() -> Iterator[Row]:
    for rows in (cable_rows, bad_rows, work_rows, balance_rows, locked_rows, bare_rows, braced_rows):
        yield from rows()
