"""Design strengths by their codes, forces at cuts by the supports, net sections by counting points."""

from dataclasses import replace

import numpy as np
import pytest

import rodshell as rs
from rodshell.checks.bending import Bending, bending, bending_of
from rodshell.checks.reactions import cut_forces, reactions
from rodshell.errors import InputError
from rodshell.geometry.frames import dot, unit
from rodshell.loads.strength import Limits, Spans, Utilisation, net_section, preset_limits
from tests.loads.shells import ROPE, TUBE, grid, one, shell

THIN = rs.Rod(rs.Tube(0.02, 0.003), rs.Material.preset("gfrp"))
TIMBER = rs.Rod(rs.RectangularSection(width=0.035, height=0.05), rs.Material.preset("larch"))


@pytest.mark.parametrize(
    ("name", "service", "duration", "strength"),
    [  # k_mod f_k / gamma_M by hand, EN 1995-1-1 tables 3.1 and 2.3
        ("larch", None, "permanent", 0.6 * 30e6 / 1.3),
        ("larch", 1, "short", 0.9 * 30e6 / 1.3),
        ("spruce", 3, "medium", 0.65 * 24e6 / 1.3),
        ("oak", 3, "instantaneous", 0.9 * 30e6 / 1.3),
        ("plywood", 2, "long", 0.7 * 40.2e6 / 1.2),
        ("gfrp", None, "permanent", 80e6),
        ("gfrp", None, "short", 120e6),
    ],
)
def test_design_strengths_are_those_of_the_codes(
    name: str, service: int | None, duration: str, strength: float
) -> None:
    rod = rs.Rod(rs.Circle(0.01), rs.Material.preset(name))  # type: ignore[arg-type]
    assert preset_limits(rod, service).bending[duration] == pytest.approx(strength)  # type: ignore[index]


def test_given_strengths_replace_those_of_a_preset_and_last_for_shorter_loads() -> None:
    found = Limits.of(TIMBER, rs.Strength(permanent=8e6, short=12e6))
    assert found.bending == {"permanent": 8e6, "long": 8e6, "medium": 8e6, "short": 12e6, "instantaneous": 12e6}
    assert found.erection == 12e6
    assert Limits.of(TIMBER, rs.Strength(short=12e6)).bending.keys() == {"short", "instantaneous"}
    assert set(Limits.of(TUBE, rs.Strength(), given=9e6).bending.values()) == {9e6}
    assert Limits.of(TUBE, rs.Strength()).bending == {}


@pytest.mark.parametrize(
    "section", [rs.Tube(0.02, 0.003), rs.Circle(0.02), rs.Ellipse(0.02, 0.03), rs.RectangularSection(0.03, 0.05)]
)
def test_net_section_is_that_of_the_points_that_a_hole_leaves(section: object) -> None:
    """Area and second moment of points on a lattice, with and without the hole; of round bars the hole is safely
    taken as deep as they are in the middle."""
    hole, ticks = 0.004, (np.arange(1500) + 0.5) / 1500 * 0.07 - 0.035
    x, y = np.meshgrid(ticks, ticks, indexing="ij")
    if isinstance(section, rs.Tube):
        inside = (np.hypot(x, y) < 0.02) & (np.hypot(x, y) > 0.017)
    elif isinstance(section, rs.Circle):
        inside = np.hypot(x, y) < 0.02
    elif isinstance(section, rs.Ellipse):
        inside = np.hypot(x / 0.02, y / 0.03) < 1
    else:
        inside = (np.abs(x) < 0.015) & (np.abs(y) < 0.025)
    left = inside & (np.abs(y) > hole / 2)
    expected = max(inside.sum() / left.sum(), (x[inside] ** 2).sum() / (x[left] ** 2).sum())
    found = net_section(section, hole)  # type: ignore[arg-type]
    assert found == pytest.approx(expected, rel=0.01)
    assert found > expected * (1 - 2e-3)


@pytest.mark.parametrize("ends", ["pinned", "clamped"])
def test_forces_at_cuts_begin_and_end_with_those_of_the_supports(ends: str) -> None:
    """And along their edges they are the axial forces that the equilibrium has."""
    popped = shell("oval").popped[ends]  # type: ignore[index]
    mesh, found = popped.shell.mesh, popped.equilibrium
    forces = cut_forces(popped.shell, found.state)
    held = reactions(popped.shell, found).forces
    first = mesh.rod_start - np.arange(len(mesh.rod_start))
    last = mesh.rod_stop - 2 - np.arange(len(mesh.rod_start))
    scale, joints = np.linalg.norm(held, axis=1).max(), np.unique(mesh.joint_pairs)
    for cut, support, beside in (
        (forces[first], -held[::2], mesh.rod_start + 1),
        (forces[last], held[1::2], mesh.rod_stop - 2),
    ):
        far = ~np.isin(mesh.rod_nodes[beside], joints)  # a joint's moment is a pair of forces beside it
        assert far.sum() > 10
        np.testing.assert_allclose(cut[far], support[far], atol=1e-6 * scale)
    ends_of = popped.shell.stretch.blocks
    along = found.state[ends_of[:, 1]] - found.state[ends_of[:, 0]]
    along /= np.linalg.norm(along, axis=1)[:, None]
    middle = Spans.of(mesh).middle
    axial = np.einsum("ij,ij->i", forces, along)[middle]
    np.testing.assert_allclose(axial, found.forces[: len(forces)][middle], atol=1e-2 * np.abs(found.forces).max())


def test_spans_run_from_joint_to_joint() -> None:
    mesh = shell("tubes").popped["pinned"].shell.mesh
    spans = Spans.of(mesh)
    assert len(spans.lengths) == 2 * len(mesh.joint_nodes) + len(mesh.rod_start)
    assert spans.lengths.sum() == pytest.approx(mesh.edge_lengths.sum())
    jumps = spans.jumps(np.repeat(np.arange(len(spans.lengths), dtype=float), spans.last - spans.first))
    assert jumps.sum() == 2 * len(mesh.joint_nodes)
    assert not jumps[mesh.rod_start].any()
    assert np.all(
        spans.on_entries(np.arange(len(spans.lengths), dtype=float))[spans.last] >= np.arange(len(spans.last))
    )


def test_shear_forces_are_those_towards_joints_without_the_edges_next_to_them() -> None:
    """Under loads between joints they grow towards these in a straight line; the edges next to them hold moments of
    joints, as pairs of forces."""
    layout = rs.GridLayout.orthogonal(rods=(3, 3), spacing=0.6, edge=0.1, length=1.8)
    mesh = rs.mesh_grid(layout.flat_grid((3, 3), 1.8), 0.1)
    spans = Spans.of(mesh)
    values, expected = np.full(len(mesh.edges), np.nan), np.zeros(len(spans.lengths))
    edge = 0
    for s, count in enumerate((spans.last - spans.first).tolist()):
        forces = np.abs(np.arange(count) - 0.5 * (count - 1) + 0.2 * s)
        values[edge : edge + count] = forces
        expected[s] = forces.max() if count > 3 else values[spans.middle[s]]
        if count > 3:
            values[[edge, edge + count - 1]] = 1e6
        edge += count
    assert edge == len(values)
    assert (spans.last - spans.first).max() > 5
    np.testing.assert_allclose(spans.towards_joints(values), expected, atol=1e-12)


def test_stress_over_strength_is_what_is_used_and_the_erected_shell_counts_with_the_permanent_one() -> None:
    form = shell("tubes")
    bracing = rs.Cables(rod=ROPE, prestrain=1e-3)
    given = rs.Strength(permanent=40e6, short=200e6, slip=1200.0)
    found = rs.check_loads(form, one(rs.Snow(200.0), bracing=bracing, strength=given))
    loaded = found.shells["all"]["pinned"]
    assert loaded.duration == "short"
    assert loaded.stress is not None
    assert loaded.used.largest["bending"] == pytest.approx(loaded.stress.max() / 200e6)
    assert loaded.used.largest["permanent"] > loaded.used.largest["bending"]
    assert 0 < loaded.used.largest["shear"] < loaded.used.largest["bending"]
    assert loaded.utilisation == max(loaded.used.largest.values())
    drilled = one(rs.Snow(200.0), bracing=bracing, strength=replace(given, hole=0.01))
    more = rs.check_loads(form, drilled).shells["all"]["pinned"].used.largest
    assert 1 < more["bending"] / loaded.used.largest["bending"] <= net_section(TUBE.section, 0.01)


def by_clauses(kappas: np.ndarray, axial: np.ndarray) -> np.ndarray:
    """Stress over f_m,k of larch laths of 35 x 50 mm, C30, term by term [EN 1995-1-1, 3.2(3), 6.1.6, 6.2.3, 6.3.2]."""
    used = np.empty(len(axial))
    for k, ((out, within), strain) in enumerate(zip(kappas, axial, strict=True)):
        flat, edge = 12e9 * 0.0175 * abs(out) / 1.3, 12e9 * 0.025 * abs(within) / (150 / 50) ** 0.2
        along = 12e9 * strain
        pull = along / (19 / 30 * (150 / 50) ** 0.2) if along > 0 else -along / (24 / 30)
        used[k] = max(flat + 0.7 * edge, 0.7 * flat + edge) + pull
    return used / 30e6


@pytest.mark.parametrize("relaxed", [None, 0.2, 0.4])
def test_erected_laths_are_judged_term_by_term_as_their_code_asks(relaxed: float | None) -> None:
    """All of their stress for days, and what does not relax for ever; under snow nothing has relaxed yet."""
    form = rs.find_form(rs.Cap(10.0, 4.0), grid(2.0, 0.5), TIMBER, ends="pinned", joint=rs.Pin())
    asked = one(rs.Snow(10.0), strength=rs.Strength(service_class=1, relaxed=relaxed))
    popped, loaded = form.popped["pinned"], rs.check_loads(form, asked).shells["all"]["pinned"]
    assert loaded.at_factor == 1
    alone = bending_of(popped.shell, popped.state, TIMBER)
    assert alone.normal_curvature is not None
    assert alone.geodesic_curvature is not None
    erected = np.column_stack([alone.normal_curvature, alone.geodesic_curvature])
    first, permanent, short = by_clauses(erected, alone.axial_strain), 0.6 / 1.3, 0.9 / 1.3
    assert np.ptp(alone.axial_strain) > np.abs(alone.axial_strain).max()  # pulled and pressed
    stays = np.maximum(first * (1 - (relaxed or 0.0)) / permanent, first / short)
    assert loaded.used.uses["permanent"].max() == pytest.approx(stays.max(), rel=1e-4)
    results = form.archive().results
    assert results.bending is not None
    assert results.bending.pinned is not None
    assert results.bending.pinned.utilisation == pytest.approx(first.max() / permanent, rel=1e-3)  # none was given
    bare = rs.check_loads(form, replace(asked, strength=rs.Strength(service_class=1))).shells["all"]["pinned"]
    np.testing.assert_allclose(loaded.used.uses["bending"], bare.used.uses["bending"])


def test_under_permanent_loads_what_has_relaxed_of_the_erected_shell_is_missing() -> None:
    layout = rs.GridLayout.orthogonal(rods=(3, 3), spacing=0.5, edge=0.25, length=1.5)
    mesh, chance = rs.mesh_grid(layout.flat_grid((3, 3), 1.5), 0.25), np.random.default_rng(1)
    count, limits = len(mesh.rod_nodes), Limits.of(TIMBER, rs.Strength(relaxed=0.4))
    shells, kappas, strains = list[Bending](), list[np.ndarray](), list[np.ndarray]()
    for _ in range(2):
        kappas.append(chance.normal(0.0, 0.1, (count, 2)))
        edge_strains = np.full(len(mesh.edges), chance.normal(0.0, 1e-4))
        shells.append(bending(mesh, mesh.flat, TIMBER, components=kappas[-1], edge_strains=edge_strains))
        strains.append(shells[-1].axial_strain)
    before, loaded = shells
    stress = limits.compared(loaded, mesh)
    assert stress is not None
    np.testing.assert_allclose(stress / 30e6, by_clauses(kappas[1], strains[1]))
    left = by_clauses(kappas[1] - 0.4 * kappas[0], strains[1] - 0.4 * strains[0])
    expected = np.maximum(left / 0.6, by_clauses(kappas[1], strains[1]) / 0.9)
    assert (left / 0.6 < expected).any()
    assert (left / 0.6 == expected).any()
    found = limits.relaxed_stress(stress, loaded, before, mesh)
    np.testing.assert_allclose(found / 30e6 / 0.6, expected)


def test_what_relaxes_is_judged_at_first_by_the_short_strength() -> None:
    for share, strength in ((None, 0.6), (0.2, 0.6 / 0.8), (0.5, 0.9)):
        limits = Limits.of(TIMBER, rs.Strength(relaxed=share))
        assert limits.staying == pytest.approx(strength * 30e6 / 1.3)


def test_slip_is_what_a_joint_adds_to_the_force_in_a_rod_at_any_mesh() -> None:
    """By the whole forces on both sides of each joint, along the rod there; the edges next to it are bent, by as much
    as they are long, to second order."""
    apart, largest = list[float](), list[float]()
    for edge in (0.25, 0.125):
        form = rs.find_form(rs.Cap(5.0, 3.0), grid(1.0, edge), THIN, ends="pinned")
        popped = form.popped["pinned"]
        spans, forces = Spans.of(popped.shell.mesh), popped.forces[: len(popped.shell.mesh.edges)]
        (first, last), cuts = spans.edges, cut_forces(popped.shell, popped.state)
        a, b = popped.shell.stretch.blocks[: len(cuts)].T
        tangents = unit(popped.state[b] - popped.state[a])
        joined = spans.last[:-1] == spans.first[1:]
        before, after = last[:-1][joined], first[1:][joined]
        added = np.abs(dot(cuts[after] - cuts[before], unit(tangents[after] + tangents[before])))
        found = spans.jumps(forces)[spans.last[:-1][joined]]
        apart.append(float(np.abs(found - added).max()))
        largest.append(float(added.max()))
    assert apart[0] < 0.03 * largest[0]
    assert apart[1] < 0.4 * apart[0]


def test_the_unloaded_shell_is_judged_by_the_same_strength_with_loads_and_without() -> None:
    """Tubes bent too sharply to stay so, though far from what breaks them soon: snow is not needed to say so."""
    case = {
        "target": {"kind": "paraboloid", "radius": 6.0, "height": 3.0},
        "layout": {"spacing": 2.0, "edge": 1.0},
        "rod": {"section": {"kind": "tube", "radius": 0.021, "thickness": 0.0035}, "material": {"preset": "gfrp"}},
        "pop_up": {"ends": "pinned"},
        "checks": {"stages": 0},
    }
    snow = {
        "loads": [{"name": "snow", "kind": "snow", "value": 10.0}],
        "combinations": [{"name": "winter", "factors": {"snow": 1.0}}],
    }
    alone, loaded = (rs.Job.load({**case, **more}).run().archive().results for more in ({}, snow))
    assert alone.bending is not None
    assert alone.bending.pinned is not None
    assert alone.bending.pinned.max_stress is not None
    used = alone.bending.pinned.utilisation
    assert used == pytest.approx(alone.bending.pinned.max_stress / (240e6 / 3))
    assert used > 1
    shares = loaded.loads["winter"]["pinned"].utilisations
    assert shares is not None
    assert shares.permanent == pytest.approx(used, rel=1e-3)
    for found in (alone, loaded):
        assert found.verdict is not None
        assert found.verdict.level == "unbuildable"
        assert sum("permanent design strength" in reason for reason in found.verdict.reasons) == 1


def test_uniform_warmth_of_free_rods_is_no_stress() -> None:
    """Supports that move apart as the rods grow: the stress stays that of the unloaded shell."""
    form, strain = shell("tubes"), 1e-3
    points, loads = form.boundary.points, {"warm": rs.Temperature(change=100.0, expansion=1e-5)}
    for k, rod in enumerate(form.footprint.rods):
        for end in (0, 1):
            loads[f"{rod.name}.{end}"] = rs.Settlement((f"{rod.name}.{end}",), tuple(strain * points[2 * k + end]))  # type: ignore[assignment]
    given = rs.Strength(permanent=100e6)
    asked = rs.Loads(loads=loads, combinations={"all": dict.fromkeys(loads, 1.0)}, strength=given)
    used = rs.check_loads(form, asked).shells["all"]["pinned"].used.largest
    assert used["bending"] == pytest.approx(used["permanent"], rel=3e-3)


def test_the_shortest_load_decides_how_long_a_combination_acts() -> None:
    loads = rs.Loads(
        loads={"own": rs.SelfWeight(), "snow": rs.Snow(500.0), "people": rs.PointLoad((0.0, 0.0), (0.0, 0.0, -1e3))},
        combinations={"own": {"own": 1.35}, "snow": {"own": 1.35, "snow": 1.5}, "none": {"own": 1.0, "snow": 0.0}},
        durations={"snow": "medium"},
    )
    assert [loads.duration(name) for name in loads.combinations] == ["permanent", "medium", "permanent"]


def test_what_governs_is_what_is_used_most() -> None:
    used = Utilisation({"bending": np.array([0.2, 0.6]), "slip": np.array([0.9, 0.0])}, np.zeros(2))
    assert used.governs == ("slip", 0)
    assert Utilisation({}, np.zeros(2)).governs is None


def test_a_strength_of_rods_without_fibres_is_refused_in_one_sentence() -> None:
    bare = rs.Rod(rs.GivenSection(EA=1e7, EI1=2e3, EI2=2e3, GJ=1e3, mass=0.7))
    form = rs.find_form(rs.Cap(10.0, 4.0), grid(3.0, 1.5), bare, ends="pinned")
    with pytest.raises(rs.InputError, match="needs fibre_distances and fibre_modulus"):
        rs.check_loads(form, one(rs.Snow(1.0), strength=rs.Strength(permanent=1e8)))
    unknown = rs.check_loads(form, one(rs.Snow(1.0)))
    assert unknown.shells["all"]["pinned"].utilisation is None
    assert any("whether they break" in sentence for sentence in unknown.warnings)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: rs.Strength(short=-1.0), "must be"),
        (lambda: rs.Strength(service_class=4), "the service class must be a whole number, 1 to 3, not 4"),
        (lambda: Limits.of(TUBE, rs.Strength(service_class=2)), "only the strengths of timber presets depend on it"),
        (lambda: Limits.of(TUBE, rs.Strength(relaxed=0.4)), "it is for timber presets that are judged by their code"),
        (lambda: Limits.of(TIMBER, rs.Strength(relaxed=0.4, permanent=9e6)), "count it in strength.permanent"),
        (lambda: rs.Strength(relaxed=1.0), "must be below 1, not 1: some stress stays"),
        (lambda: net_section(TIMBER.section, 0.05), "leaves nothing of the rod"),
        (lambda: rs.Loads(loads={"b": rs.Snow(1.0)}, combinations={"a": {"b": 1.0}}, durations={"c": "long"}), '"c"'),
        (
            lambda: rs.Loads(loads={"b": rs.Snow(1.0)}, combinations={"a": {"b": 1.0}}, durations={"b": "ever"}),  # type: ignore[dict-item]
            "the duration of",
        ),
    ],
)
def test_a_wrong_argument_is_refused_in_one_sentence(make: object, message: str) -> None:
    with pytest.raises(rs.InputError, match=message):
        make()  # type: ignore[operator]


def test_what_does_not_suit_the_rod_is_refused_before_anything_is_formed() -> None:
    """A service class of GFRP, and a bolt as wide as the tube."""
    tube = {"section": {"kind": "tube", "radius": 0.02, "thickness": 0.003}, "material": {"preset": "gfrp"}}
    lath = {"section": {"kind": "rectangle", "width": 0.035, "height": 0.05}, "material": {"preset": "larch"}}
    case = {"target": {"kind": "cap", "radius": 10.0, "base": 4.0}}
    for strength, words in (({"service_class": 2}, "only the strengths of timber"), ({"hole": 0.04}, "leaves nothing")):
        with pytest.raises(InputError, match=words):
            rs.Job.load({**case, "rod": tube, "strength": strength}).case.build()
        rs.Job.load({**case, "rod": lath, "strength": strength}).case.build()
