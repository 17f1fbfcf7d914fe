"""Balance, symmetry, superposition and rigid motions of shells under loads; what is refused."""

from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import eigh

import rodshell as rs
from rodshell.checks.self_weight import self_weight
from rodshell.errors import ConvergenceError, InputError
from rodshell.formfinding.popup import Ends
from rodshell.layout.cells import diagonals
from rodshell.loads.bracing import outer_nodes, stressed
from rodshell.loads.check import LoadedShell, _load, mechanism, tributary_of
from rodshell.loads.laths import laid
from rodshell.loads.nodes import LoadedNodes
from rodshell.loads.strength import area_of, preset_limits
from rodshell.loads.structure import Structure
from rodshell.solve.imperfection import imperfect
from rodshell.solve.load_path import load_path
from rodshell.solve.modes import linear_buckling
from rodshell.targets.tributary import Tributary
from tests.loads.shells import LARCH, ROPE, TUBE, grid, one, shell


def nodes_of(form: rs.Form, ends: str = "pinned") -> LoadedNodes:
    popped = form.popped[ends]
    mass = popped.shell.mass[: popped.shell.node_count, 2]
    return LoadedNodes(popped.positions, mass, tributary_of(form.patches[0]), min(form.layout.spacing))


PERFECT = rs.Stability(imperfection=0, modes=1)
LOADS = {
    "own": rs.SelfWeight(cladding=2.0),
    "snow": rs.Snow(150.0),
    "half": rs.Snow(100.0, "half", 0.3),
    "drift": rs.Snow(100.0, "drifted", 1.0),
    "wind": rs.Wind(200.0, "-0.8 + 0.1*x"),
    "point": rs.PointLoad((1.0, 0.5), (50.0, 0.0, -200.0)),
    "line": rs.LineLoad(((-3.0, 0.0), (3.0, 1.0)), (0.0, 0.0, -30.0)),
}
BRACED = {"none": None, "cables": rs.Cables(rod=ROPE, prestrain=5e-4), "laths": rs.Laths(eccentricity=0.03)}


@pytest.mark.parametrize(
    "bracing", ["none", pytest.param("cables", marks=pytest.mark.slow), pytest.param("laths", marks=pytest.mark.slow)]
)
def test_reactions_balance_every_kind_of_load(bracing: str) -> None:
    """Forces to 1e-9, with two layers of rods, both end conditions and each kind of bracing, all loads at once."""
    loads = rs.Loads(
        loads=dict(LOADS), combinations={"all": dict.fromkeys(LOADS, 0.05), "wind": {"wind": 0.3}},
        bracing=BRACED[bracing], stability=rs.Stability(modes=1),
    )  # fmt: skip
    found = rs.check_loads(shell("oval"), loads)
    assert list(found.shells) == ["all", "wind"]
    for by_ends in found.shells.values():
        assert list(by_ends) == ["pinned", "clamped"]
        for loaded in by_ends.values():
            assert loaded.at_factor == 1.0
            size = np.linalg.norm(loaded.load_sum)
            assert np.abs(loaded.reaction_sum + loaded.load_sum).max() < 1e-9 * size


def test_snow_and_wind_have_the_sums_of_their_surface() -> None:
    """Half the snow on half a disc; of a drift three eighths on a rectangle; pressure on a cap lifts by its plan."""
    form = shell("tubes")
    nodes, plan = nodes_of(form), pi * 84.0
    assert rs.Snow(1.0).forces(nodes).sum(axis=0) == pytest.approx([0, 0, -plan], rel=1e-3)
    assert rs.Snow(1.0, "half", 0.7).forces(nodes).sum(axis=0)[2] == pytest.approx(-plan / 2, rel=0.01)
    assert rs.Wind(2.0, -0.5).forces(nodes).sum(axis=0) == pytest.approx([0, 0, plan], abs=1e-3 * plan)
    ground = -rs.Snow(1.0, of="ground").forces(nodes).sum(axis=0)[2]
    a, b = pi / 6, pi / 3  # angles of the surface's slope, of which a sphere of radius R has R^2 sin cos of plan
    falling = quad(lambda t: (b - t) / (b - a) * np.sin(t) * np.cos(t), a, b)[0]
    assert ground == pytest.approx(2 * pi * 100.0 * 0.8 * (np.sin(a) ** 2 / 2 + falling), rel=0.02)
    roof = rs.HeightField(formula="1 - 0.05*x^2 - 0.04*y^2", domain=rs.Rectangle((6.0, 4.0)))
    flat = rs.find_form(roof, grid(0.5, 0.25), TUBE, ends="pinned")
    drift = rs.Snow(1.0, "drifted", 0.0).forces(nodes_of(flat))
    assert drift[:, 2].sum() == pytest.approx(-24.0 * 3 / 8, rel=0.02)
    right = flat.popped["pinned"].positions[:, 0] > 0
    assert drift[right, 2].sum() / drift[~right, 2].sum() == pytest.approx(2.0, rel=0.1)


def test_wind_on_a_dome_presses_its_edge_and_lifts_its_middle_whatever_its_size() -> None:
    """Along 4 m of plan and along 40 m: 0.5 of the pressure at the windward edge, -0.8 half-way, -0.2 in the lee."""
    for size in (2.0, 20.0):
        plan = np.column_stack([np.linspace(0.0, 2.0 * size, 5), np.zeros(5)]) + [7.0, 3.0]
        one, up = np.ones(5), np.tile([0.0, 0.0, 1.0], (5, 1))
        nodes = LoadedNodes(np.column_stack([plan, np.zeros(5)]), one, Tributary(one, one, up, plan), 0.01)
        pressed = -rs.Wind(3.0, "dome").forces(nodes)[:, 2] / 3.0
        assert pressed[[0, 2, 4]] == pytest.approx([0.5, -0.8, -0.2])
        turned = -rs.Wind(3.0, "dome", direction=pi).forces(nodes)[:, 2] / 3.0
        assert turned == pytest.approx(pressed[::-1])


def test_half_of_a_plan_is_what_lies_beyond_the_middle_of_its_extent() -> None:
    """Of a right triangle three quarters towards its right angle's far side or a quarter, and of a drift both halves:
    a triangle's load on each side of the middle."""
    ticks = (np.arange(400) + 0.5) / 400
    x, y = (side.ravel() for side in np.meshgrid(ticks, ticks))
    inside = x + y < 1.0
    plan = np.column_stack([x, y])[inside]
    area = np.full(len(plan), 0.5 / len(plan))
    positions = np.column_stack([plan, np.zeros(len(plan))])
    areas = Tributary(area, area, area[:, None] * [0.0, 0.0, 1.0], plan)
    nodes = LoadedNodes(positions, area, areas, 0.01)
    for direction, share in ((pi / 4, 0.75), (5 * pi / 4, 0.25), (0.0, 0.25), (pi, 0.75)):
        half = rs.Snow(1.0, "half", direction).forces(nodes).sum(axis=0)[2]
        assert half == pytest.approx(-0.5 * share, rel=0.01)
    drift = rs.Snow(1.0, "drifted", pi / 4).forces(nodes)[:, 2]
    beyond = plan.sum(axis=1) > 0.5
    assert drift[beyond].sum() < 0 > drift[~beyond].sum()
    assert drift.min() == pytest.approx(-1.0 * area[0], rel=0.01)
    assert drift[~beyond].min() == pytest.approx(-0.5 * area[0], rel=0.01)


def test_a_combination_that_moves_nothing_is_named() -> None:
    loads = rs.Loads(
        loads={"own": rs.SelfWeight(), "none": rs.Snow(0.0)}, combinations={"all": {"own": 1.0}, "bare": {"none": 1.0}}
    )
    with pytest.raises(InputError, match='combination "bare": the load moves nothing'):
        rs.check_loads(shell("tubes"), loads)


def test_bracing_whose_strength_is_not_known_is_named_as_not_judged() -> None:
    bare = rs.Cables(rod=rs.Rod(ROPE.section, rs.Material(160e9, 7850, 0.3)), prestrain=5e-4)
    gfrp = rs.Cables(rod=rs.Rod(ROPE.section, rs.Material.preset("gfrp")), prestrain=5e-4)
    for bracing, said in ((bare, True), (gfrp, False)):
        found = rs.check_loads(shell("tubes"), one(rs.Snow(10.0), bracing=bracing))
        assert any("strength of the bracing is not known" in word for word in found.warnings) == said


def test_prestressed_cables_are_judged_by_the_permanent_strength() -> None:
    """Nearly all of their force is prestress, which stays."""
    rod = rs.Rod(ROPE.section, rs.Material.preset("gfrp"))
    bracing = rs.Cables(rod=rod, prestrain=1e-3)
    found = rs.check_loads(shell("tubes"), one(rs.Snow(1.0), bracing=bracing)).shells["all"]["pinned"]
    known, area = preset_limits(rod, None).bending, area_of(rod)
    short = found.bracing_forces.max() / (known["short"] * area)
    assert found.bracing_utilisation is not None
    assert found.bracing_utilisation > 1.3 * short
    assert found.bracing_utilisation == pytest.approx(short * known["short"] / known["permanent"], rel=0.05)


def test_each_mode_is_an_imperfection_of_its_own() -> None:
    """The smallest factor of all; of their sum each has a part of the amplitude, and its sign is arbitrary. Of a shell
    without symmetry, whose modes are not double."""
    form = shell("oval")
    asked = one(rs.Snow(300.0), stability=rs.Stability(imperfection=0.1, modes=2))
    found = rs.check_loads(form, asked).shells["all"]["pinned"]
    structure = Structure.erected(form.popped["pinned"], form.rod)
    load = _load(structure, nodes_of(form), asked, asked.combinations["all"])
    modes = linear_buckling(structure.equilibrium, load, 2).shapes
    each = [
        load_path(imperfect(structure.equilibrium, shape, amplitude), load).factor
        for shape in modes
        for amplitude in (0.1, -0.1)
    ]
    assert found.imperfect_factor == pytest.approx(min(each), rel=5e-3)
    assert max(each) > 1.02 * min(each)


def test_an_imperfection_that_is_not_found_hides_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """A shell that falls in one mode falls; one that falls in none is not known to stand."""
    from importlib import import_module

    def found(snow: float, missing: int) -> LoadedShell:
        calls = iter(range(100))

        def start(*given: Any) -> Any:
            if next(calls) == missing:
                raise ConvergenceError("no equilibrium")
            return imperfect(*given)

        monkeypatch.setattr(import_module("rodshell.loads.stability"), "imperfect", start)
        asked = one(rs.Snow(snow), stability=rs.Stability(imperfection=0.1, modes=2))
        return rs.check_loads(shell("oval"), asked).shells["all"]["pinned"]

    whole = found(300.0, -1)
    assert whole.imperfect_factor is not None
    few = 300.0 * whole.imperfect_factor
    for missing in (0, 3):
        weak, strong = found(2.0 * few, missing), found(0.2 * few, missing)
        assert weak.imperfect_factor == pytest.approx(0.5, rel=0.3)
        assert weak.imperfect_kind == whole.imperfect_kind
        assert (strong.imperfect_factor, strong.imperfect_kind) == (None, "not followed")


def test_point_and_line_loads_have_their_forces() -> None:
    nodes = nodes_of(shell("tubes"))
    assert rs.PointLoad((0.0, 0.0), (1.0, 2.0, -3.0)).forces(nodes).sum(axis=0).tolist() == [1.0, 2.0, -3.0]
    line = rs.LineLoad(((-3.0, -4.0), (0.0, 0.0), (3.0, 0.0)), (0.0, 1.0, -2.0)).forces(nodes)
    assert line.sum(axis=0) == pytest.approx([0.0, 8.0, -16.0])


def test_self_weight_is_that_of_rods_joints_bracing_and_cladding() -> None:
    form = shell("tubes")
    rods = sum(rod.length for rod in form.footprint.rods) * TUBE.mass_per_length
    cladding = 3.0 * 2 * pi * 10.0 * 6.0
    found = rs.check_loads(form, one(rs.SelfWeight(cladding=3.0), bracing=BRACED["cables"]))
    pairs, places = found.braced, form.popped["pinned"].positions[form.footprint.mesh.joint_nodes]
    ropes = np.linalg.norm(places[pairs[:, 0]] - places[pairs[:, 1]], axis=1).sum() * ROPE.mass_per_length
    total = -found.shells["all"]["pinned"].load_sum[2] / found.shells["all"]["pinned"].at_factor
    assert total == pytest.approx(9.81 * (rods + cladding + ropes), rel=1e-3)


def test_the_own_weight_of_a_braced_shell_is_carried_as_the_load_that_is_this_weight() -> None:
    found = rs.check_loads(shell("tubes"), one(rs.SelfWeight(), bracing=BRACED["cables"]))
    limit, braced = found.shells["all"]["pinned"].limit_factor, found.self_weight["pinned"].load_factor
    assert braced == pytest.approx(limit, rel=4e-3)  # both at most .2 % below
    bare = shell("tubes").popped["pinned"]
    assert braced > 3 * self_weight(bare.shell, bare.equilibrium)[0].load_factor
    assert not rs.check_loads(shell("tubes"), one(rs.SelfWeight())).self_weight


def test_supports_that_all_settle_alike_stress_nothing() -> None:
    form = shell("tubes")
    names = tuple(f"{rod.name}.{end}" for rod in form.footprint.rods for end in (0, 1))
    found = rs.check_loads(form, one(rs.Settlement(names, (0.02, -0.01, -0.05)))).shells["all"]["pinned"]
    np.testing.assert_allclose(found.displacements, np.broadcast_to([0.02, -0.01, -0.05], (len(found.positions), 3)))
    assert np.abs(found.reactions).max() < 1e-6 * np.abs(found.support_forces).max()
    assert found.limit_factor is None


def test_a_shell_that_is_warmed_while_its_supports_move_apart_alike_grows_as_a_whole() -> None:
    """Rods longer by the strain e between supports farther apart by e: the same shape, larger by e."""
    form, strain = shell("tubes"), 1e-3
    points, rods = form.boundary.points, form.footprint.rods
    loads = {"warm": rs.Temperature(change=100.0, expansion=strain / 100.0)}
    for k, rod in enumerate(rods):
        for end in (0, 1):
            loads[f"{rod.name}.{end}"] = rs.Settlement((f"{rod.name}.{end}",), tuple(strain * points[2 * k + end]))
    asked = rs.Loads(loads=loads, combinations={"all": dict.fromkeys(loads, 1.0)})
    found = rs.check_loads(form, asked).shells["all"]["pinned"]
    before = form.popped["pinned"].positions
    np.testing.assert_allclose(found.displacements, strain * before, atol=2e-2 * strain * np.abs(before).max())


def test_final_state_and_energy_do_not_depend_on_the_order_of_fixed_loads() -> None:
    """Snow and then wind, wind and then snow, and both at once do the same work, to 1e-8."""
    form = shell("tubes")
    structure = Structure.erected(form.popped["pinned"], form.rod)
    asked = rs.Loads(
        loads={"snow": rs.Snow(8.0), "wind": rs.Wind(30.0, "-0.5 + 0.05*x")},
        combinations={"both": {"snow": 1.0, "wind": 1.0}, "snow": {"snow": 1.0}, "wind": {"wind": 1.0}},
    )
    loads = {name: _load(structure, nodes_of(form), asked, factors) for name, factors in asked.combinations.items()}
    ways, unloaded = [], structure.equilibrium
    for order in (("both",), ("snow", "wind"), ("wind", "snow")):
        found = unloaded
        for name in order:
            reached = load_path(found, loads[name], most=1.5).at(1.0)
            assert reached is not None
            found = reached
        elastic = replace(found.problem, load=None).potential(found.state)
        work = float(np.sum(loads["both"].forces * (found.state - unloaded.state)))
        ways.append((found.state, elastic, work))
    for state, elastic, work in ways[1:]:
        assert np.abs(state - ways[0][0]).max() < 1e-8
        assert work == pytest.approx(ways[0][2], rel=1e-8)
        assert elastic - unloaded.energy == pytest.approx(ways[0][1] - unloaded.energy, rel=1e-8)


@pytest.mark.parametrize("pattern", ["both", "one"])
def test_cables_to_the_supports_are_anchored_there(pattern: str) -> None:
    """The same cables and more, whose pull the supports carry: forces balance with them and without loads."""
    form = shell("tubes")
    reach = rs.Cables(rod=ROPE, prestrain=5e-4, pattern=pattern, ends_at="supports")
    inner = replace(reach, ends_at="joints")
    loads = one(rs.Snow(100.0), stability=rs.Stability(modes=1))
    found, less = (rs.check_loads(form, replace(loads, bracing=bracing)) for bracing in (reach, inner))
    shells = found.shells["all"]["pinned"]
    joints = len(form.footprint.mesh.grid.crossings)
    at_supports = found.braced[:, 1] >= joints
    np.testing.assert_array_equal(found.braced[~at_supports], less.braced)
    assert at_supports.sum() > 0
    assert np.abs(shells.reaction_sum + shells.load_sum).max() < 1e-9 * np.linalg.norm(shells.load_sum)
    structure = Structure.erected(form.popped["pinned"], form.rod)
    braced = stressed(reach, structure, form.target)
    places = np.vstack(
        [structure.positions(structure.equilibrium)[form.footprint.mesh.joint_nodes], form.boundary.points]
    )
    lengths = np.linalg.norm(np.diff(places[braced.braced], axis=1)[:, 0], axis=1)
    assert braced.bracing_mass.sum() == pytest.approx(lengths.sum() * ROPE.mass_per_length)
    pulls = braced.support_forces(braced.equilibrium)
    assert np.abs(pulls.force_sum).max() < 1e-9 * np.abs(pulls.forces).max()


def test_bracing_of_a_symmetric_shell_is_stressed_symmetrically() -> None:
    form = shell("tubes")
    found = rs.check_loads(form, one(rs.Snow(100.0), bracing=BRACED["cables"]))
    forces = found.shells["all"]["pinned"].bracing_forces
    middles = form.popped["pinned"].positions[form.footprint.mesh.joint_nodes][found.braced].mean(axis=1)
    for image in ([-1, 1, 1], [1, -1, 1]):
        partner = np.linalg.norm(middles[None] - (middles * image)[:, None], axis=2)
        for k, row in enumerate(partner):
            same = forces[row < 1e-6 * row.max()]
            assert np.abs(same - forces[k]).min() < 1e-5 * forces.max()


def test_bracing_stiffens_a_shell_and_laths_feel_their_own_bending() -> None:
    """Cables and laths carry many times what the bare shell does; laths are bent, cables are taut."""
    form = shell("laths")
    limits = {}
    for name, bracing in {"none": None, "cables": BRACED["cables"], "laths": rs.Laths(pattern="both")}.items():
        found = rs.check_loads(form, one(rs.Snow(1000.0), bracing=bracing)).shells["all"]["pinned"]
        limits[name] = found.limit_factor
    assert limits["cables"] > 3 * limits["none"]
    assert limits["laths"] > 3 * limits["none"]


@pytest.mark.parametrize(
    ("form", "loads", "message"),
    [
        ("tubes", one(rs.PointLoad((30.0, 0.0), (0, 0, -1))), "away from the nearest rod"),
        ("tubes", one(rs.Settlement(("U99.0",), (0, 0, -1))), 'the support "U99.0", which the shell does not have'),
        ("tubes", one(rs.Wind(1.0, "sqrt(x)")), "give a formula that is finite"),
        ("tubes", one(rs.Wind(1.0, "1/(x - 0.001)")), "pressure coefficients lie between -3 and 3"),
        ("tubes", one(rs.Snow(1.0), bracing=rs.Cables(rod=ROPE, prestrain=0.5)), "pulls the shell out of its shape"),
    ],
)
def test_what_does_not_fit_the_form_is_refused_in_one_sentence(form: str, loads: rs.Loads, message: str) -> None:
    with pytest.raises(InputError, match=message):
        rs.check_loads(shell(form), loads)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: rs.Snow(-1.0), "must be 0 or more, not -1"),
        (lambda: rs.SelfWeight(cladding=-1.0), "must be 0 or more"),
        (lambda: rs.Wind(-1.0, 0.5), "must be 0 or more"),
        (lambda: rs.Wind(1.0, "z"), '"z" is not allowed'),
        (lambda: rs.Wind(1.0, -30), "the wind's coefficient -30.0 reaches 30: pressure coefficients lie"),
        (lambda: rs.Snow(1.0, "quarter"), "must be"),
        (lambda: rs.Loads(loads={}, combinations={"a": {"b": 1.0}}), "has no loads"),
        (lambda: rs.Loads(loads={"b": rs.Snow(1.0)}, combinations={}), "has no combinations"),
        (lambda: rs.Loads(loads={"b": rs.Snow(1.0)}, combinations={"a": {"c": 1.0}}), '"c", which is not a load'),
        (lambda: rs.Loads(loads={"b": rs.Snow(1.0)}, combinations={"a": {"b": -1.0}}), "must be 0 or more"),
        (lambda: rs.Stability(imperfection="span/0"), "the imperfection must be"),
        (lambda: rs.Stability(reserve=0.9), "give 1 or more"),
        (lambda: one(rs.Snow(1.0), deflections={"none": 0.1}), "which is not a combination"),
        (lambda: one(rs.Snow(1.0), deflections={"all": "span/x"}), "the deflection allowed under"),
        (lambda: rs.Cables(rod=ROPE, pattern="all"), "a pattern of diagonals must be"),
        (lambda: rs.Cables(rod=ROPE, prestrain=-0.1), "must be 0 or more"),
    ],
)
def test_a_wrong_argument_is_refused_in_one_sentence(make: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()  # type: ignore[operator]


def test_patches_carry_what_each_carries_alone() -> None:
    """A cap cut in two: the limit is that of its weaker half, to what encloses it; loads have the sums of the whole."""
    seam = [[[-12.0, 1.0], [12.0, 1.0]]]
    both = rs.find_form(rs.Cap(10.0, 4.0), grid(3.0, 1.5), TUBE, ends="pinned", seams=seam)
    loads = one(rs.Snow(20.0), stability=rs.Stability(modes=2))
    found = rs.check_loads(both, loads).shells["all"]["pinned"]
    assert found.load_sum[2] / found.at_factor == pytest.approx(-20.0 * 84 * pi, rel=1e-3)
    assert np.abs(found.reaction_sum + found.load_sum).max() < 1e-9 * np.linalg.norm(found.load_sum)
    forces = rs.Snow(20.0).forces(
        LoadedNodes(both.popped["pinned"].positions, np.zeros(0), tributary_of(both.stages), 3.0)
    )
    limits, first = list[float](), 0
    for patch in both.patches:
        structure = Structure.erected(patch.popped["pinned"], TUBE)
        count = structure.shell.node_count
        alone = np.zeros((structure.size, 3))
        alone[:count] = forces[first : first + count]
        limits.append(load_path(structure.equilibrium, alone).factor)
        first += count
    assert first == len(forces)
    assert found.limit_factor == pytest.approx(min(limits), rel=4e-3)  # each within 0.2 %
    assert max(limits) > 1.05 * min(limits)


@pytest.mark.slow
def test_the_report_of_patches_says_that_their_seams_are_held(tmp_path: Path) -> None:
    case = {
        "target": {"kind": "cap", "radius": 10.0, "base": 4.0}, "layout": {"spacing": 3.0, "edge": 1.5},
        "rod": {"section": {"kind": "tube", "radius": 0.021, "thickness": 0.0035}, "material": {"preset": "gfrp"}},
        "pop_up": {"ends": "pinned"}, "checks": {"stages": 0}, "seams": {"lines": [[[-12.0, 1.0], [12.0, 1.0]]]},
        "loads": [{"name": "snow", "kind": "snow", "value": "0.02 kN/m2"}],
        "combinations": [{"name": "winter", "factors": {"snow": 1.0}}],
        "bracing": {
            "kind": "cables", "prestrain": 5e-4, "ends_at": "supports", "section": {"kind": "circle", "radius": 0.003},
            "material": {"youngs_modulus": "160 GPa", "density": 7850},
        },
    }  # fmt: skip
    form = rs.Job.load(case).run()
    found = form.archive().results.loads["winter"]["pinned"]
    assert len(found.bracing) == len(form.fabrication.bracing)
    assert None not in found.bracing
    assert len(found.support_forces) == 2 * len(form.footprint.rods)
    folder = form.save(tmp_path / "out", kinds="report, csv")
    assert "The seams between patches are held" in (folder / "report.html").read_text(encoding="utf-8")
    rows = (folder / "schedule" / "bracing.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 1 + len(found.bracing)


PLANE = rs.HeightField(formula="1 + 0*x", domain=rs.Rectangle((8.0, 6.0)))


@pytest.mark.parametrize("ends", ["pinned", "clamped"])
@pytest.mark.parametrize("edge", [0.75, 0.1])
def test_straight_laths_on_ball_joints_are_a_mechanism(ends: Ends, edge: float) -> None:
    """They turn about themselves without any moment, whatever holds their ends; by round-off alone pivots may be
    zero, positive or negative. Pins hold them, and so does the least curvature."""
    form = rs.find_form(PLANE, grid(1.5, edge), LARCH, ends=ends)
    with pytest.raises(InputError, match=rf"with {ends} ends nothing keeps [UV]0\d from turning about itself"):
        rs.check_loads(form, one(rs.Snow(10.0)))
    vault = rs.HeightField(formula="1 - 0.08*y^2", domain=rs.Rectangle((8.0, 6.0)))
    for target, joint in ((PLANE, rs.Pin()), (vault, None)):
        held = rs.find_form(target, grid(1.5, edge), LARCH, ends=ends, joint=joint)
        assert mechanism(Structure.erected(held.popped[ends], LARCH)) is None


def test_a_load_across_a_plane_grid_has_no_buckling_factor() -> None:
    """It bends the rods, and draws them in the second order only."""
    form = rs.find_form(PLANE, grid(1.5, 0.75), TUBE, ends="pinned")
    found = rs.check_loads(form, one(rs.Snow(10.0))).shells["all"]["pinned"]
    assert found.linear_factor is None
    assert found.limit_kind == "none"
    assert found.max_deflection > 1e-3


def test_rods_without_mass_have_no_weight_to_check() -> None:
    bare = rs.Rod(rs.GivenSection(EA=1e7, EI1=2e3, EI2=2e3, GJ=1e3))
    form = rs.find_form(rs.Cap(10.0, 4.0), grid(3.0, 1.5), bare, ends="pinned")
    with pytest.raises(InputError, match="no mass"):
        rs.check_loads(form, one(rs.SelfWeight()))


@pytest.mark.slow
def test_bracing_across_an_opening_is_refused_or_leaves_diagonals_out(tmp_path: Path) -> None:
    """A hole in one cell of a vault, from a mesh."""
    ticks = np.linspace(-3.0, 3.0, 61)
    x, y = (part.ravel() for part in np.meshgrid(ticks, ticks, indexing="ij"))
    inside = np.hypot(x - 0.5, y - 0.5) > 0.28
    index = np.arange(61 * 61).reshape(61, 61)
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1).reshape(-1, 4)
    quads = quads[inside[quads].all(axis=1)]
    lines = [f"v {a} {b} {1.0 - 0.04 * a * a - 0.05 * b * b}" for a, b in zip(x, y, strict=True)]
    lines += ["f " + " ".join(str(k + 1) for k in quad) for quad in quads.tolist()]
    path = tmp_path / "vault.obj"
    path.write_text("\n".join(lines))
    job = rs.Job.load(
        {"target": {"kind": "mesh", "file": str(path), "unit": "m"}, "pop_up": {"ends": "pinned"}}, layout__spacing=1.0,
        rod__section={"kind": "tube", "radius": 0.02, "thickness": 0.003}, rod__material={"preset": "gfrp"},
    )  # fmt: skip
    form = job.run(until="pop-up")
    with pytest.raises(InputError, match=r"2 of .* diagonals of the bracing cross an opening"):
        rs.check_loads(form, one(rs.Snow(10.0), bracing=rs.Cables(rod=ROPE, prestrain=1e-4)))
    left = rs.Cables(rod=ROPE, prestrain=1e-4, across_openings="leave out")
    found = rs.check_loads(form, one(rs.Snow(10.0), bracing=left))
    mesh = form.footprint.mesh
    assert len(found.braced) == len(diagonals(mesh.grid)) - 2
    places = form.popped["pinned"].positions[mesh.joint_nodes][found.braced].mean(axis=1)
    assert np.hypot(places[:, 0] - 0.5, places[:, 1] - 0.5).min() > 0.3


def test_a_table_of_rods_has_no_areas() -> None:
    form = shell("tubes")
    flat = rs.straight_rods([[[0, y], [4, y]] for y in (1.0, 2.0, 3.0)] + [[[x, 0], [x, 4]] for x in (1.0, 2.0, 3.0)])
    finals = np.array([[[*rod.point(rod.start + 0.02), 0.0], [*rod.point(rod.end - 0.02), 0.0]] for rod in flat.rods])
    table = rs.pop_up_table(flat, finals, LARCH)
    assert form is not table
    with pytest.raises(InputError, match="comes from a table of rods"):
        rs.check_loads(table, one(rs.Snow(1.0)))


def test_cladding_swings_with_the_shell() -> None:
    """So heavy that the rods' mass counts little, the frequency falls with the root of its mass."""
    form, masses = shell("tubes"), (400.0, 1600.0)
    first, second = (
        rs.check_loads(form, one(rs.SelfWeight(cladding=mass), stability=PERFECT))
        .shells["all"]["pinned"]
        .frequencies[0]
        for mass in masses
    )
    assert first / second == pytest.approx(2.0, rel=0.01)
    alone = rs.check_loads(form, one(rs.Snow(1.0), stability=PERFECT)).shells["all"]["pinned"].frequencies[0]
    assert alone > 5 * first


def test_wind_from_several_directions_is_a_combination_for_each() -> None:
    """Each is that of a wind that blows so; a shell of four mirror planes and more withstands two of them alike."""
    wind = rs.Wind(20.0, "0.5 - 0.1*x", direction=0.1, directions=4)
    storm, own = {"own": 1.0, "it": 1.5}, rs.SelfWeight()
    every = rs.Loads(
        loads={"own": own, "it": wind}, combinations={"storm": storm, "rest": {"own": 1.0}},
        durations={"it": "instantaneous"}, deflections={"storm": "span/100"}, stability=PERFECT,
    )  # fmt: skip
    *turned, rest = every.combinations
    assert (turned[0], len(turned), rest) == ("storm, wind at 5.73 deg", 4, "rest")
    assert {every.duration(name) for name in turned} == {"instantaneous"}
    found = rs.check_loads(shell("tubes"), every).shells
    for k, name in enumerate(turned):
        single = replace(wind, direction=0.1 + k * pi / 2, directions=1)
        alone = rs.Loads(
            loads={"own": rs.SelfWeight(), "it": single},
            combinations={"storm": {"own": 1.0, "it": 1.5}},
            stability=PERFECT,
        )
        other = rs.check_loads(shell("tubes"), alone).shells["storm"]["pinned"]
        assert found[name]["pinned"].limit_factor == other.limit_factor
        assert found[name]["pinned"].deflection_limit == pytest.approx(np.ptp(other.positions[:, 0]) / 100, rel=0.05)
    assert found["rest"]["pinned"].deflection_limit is None
    with pytest.raises(InputError, match="two winds from several directions"):
        rs.Loads(loads={"a": wind, "b": wind}, combinations={"storm": {"a": 1.0, "b": 1.0}})


def test_frequencies_are_those_of_the_rods_mass_wherever_nodes_are() -> None:
    """Against twice as many edges: of fourth order in bending; an added lump at each joint slows by its share."""
    cap, found = rs.Cap(10.0, 4.0), []
    for edge in (1.5, 0.75):
        form = rs.find_form(cap, grid(3.0, edge), TUBE, ends="pinned")
        found.append(
            rs.check_loads(form, one(rs.Snow(1.0), stability=rs.Stability(modes=4))).shells["all"]["pinned"].frequencies
        )
    assert len(found[1]) == 4
    np.testing.assert_allclose(found[0], found[1], rtol=0.03)
    rods = sum(rod.length for rod in form.footprint.rods) * TUBE.mass_per_length
    lump = rods / len(form.footprint.mesh.grid.crossings)
    heavy = rs.find_form(cap, grid(3.0, 0.75), TUBE, ends="pinned", joint=rs.Ball(mass=lump))
    slower = rs.check_loads(heavy, one(rs.Snow(1.0))).shells["all"]["pinned"].frequencies
    # as much mass again, where modes of the whole shell move: between none of it and twice it at the crests
    assert np.sqrt(1 / 3) < slower[0] / found[1][0] < np.sqrt(1 / 2) * 1.05


@pytest.mark.parametrize("laths", [None, rs.Laths(rod=TUBE), rs.Laths(rod=TUBE, eccentricity=0.1)])
def test_frequencies_of_a_shell_are_those_of_its_stiffness_and_mass(laths: rs.Laths | None) -> None:
    """A second way: all modes of both matrices by LAPACK, the mass of edges put together from elements of Hermite's
    linear shape functions; that of a third layer too lies along its laths."""
    form = shell("tubes")
    structure = Structure.erected(form.popped["pinned"], form.rod)
    structure = structure if laths is None else laid(laths, structure, form.target)
    tangent = structure.equilibrium.tangent
    stiffness = tangent.pattern.assembly.matrix(tangent.values).toarray()
    size = structure.size
    mass = np.zeros((3 * size, 3 * size))
    layers = [structure.shell, *([] if structure.laths is None else [structure.laths.shell])]
    lengths = np.concatenate([layer.mesh.edge_lengths for layer in layers])
    for (a, b), length in zip(structure.equilibrium.problem.stretch.blocks.tolist(), lengths.tolist(), strict=True):
        part = TUBE.mass_per_length * length / 6.0
        for axis in range(3):
            p, q = 3 * a + axis, 3 * b + axis
            mass[p, p] += 2 * part
            mass[q, q] += 2 * part
            mass[p, q] += part
            mass[q, p] += part
    units = np.array([tangent.freedom.expand(row).ravel() for row in np.eye(tangent.freedom.size)])
    squares = eigh(stiffness, units @ mass @ units.T, eigvals_only=True)
    np.testing.assert_allclose(structure.frequencies(3), np.sqrt(squares[:3]) / (2 * pi), rtol=1e-6)


def test_the_weight_of_each_span_of_a_lath_goes_to_the_joints_at_its_ends() -> None:
    form = shell("tubes")
    structure = Structure.erected(form.popped["pinned"], form.rod)
    braced = laid(rs.Laths(rod=TUBE), structure, form.target)
    nodes, halves = outer_nodes(braced.mesh)[braced.braced], np.zeros(structure.shell.node_count)
    chords = np.linalg.norm(np.diff(structure.positions(structure.equilibrium)[nodes], axis=1)[:, 0], axis=1)
    np.add.at(halves, nodes, 0.5 * TUBE.mass_per_length * chords[:, None])
    np.testing.assert_allclose(braced.bracing_mass, halves, rtol=0.02)  # chords for arcs: 3 m on a radius of 10 m, .4 %
