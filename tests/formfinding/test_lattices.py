"""Shells of rods along geodesics and asymptotic lines: laid, popped up, flat or assembled in place, kept and drawn."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import ezdxf
import numpy as np
import pytest

import rodshell as rs
from rodshell.case import load_case
from rodshell.case.rod_ends import read_result
from rodshell.checks.contact import contact_of
from rodshell.errors import InputError
from rodshell.formfinding.pipeline import meshed_again
from rodshell.nets.surface_lattice import surface_net
from rodshell.output.blanks import blanks_of
from rodshell.output.drawing import FAMILIES
from rodshell.output.drawings import drawing_set
from rodshell.output.drawings.flat import flat_drawing, flat_plan
from rodshell.output.grid import family_numbers, joints_of, rods_of, shape_names
from rodshell.output.schedules import joints_table
from rodshell.output.viewer import scene_of
from rodshell.results.archive import Archive, read
from rodshell.solve.equilibrium import Status

LOW, HIGH = rs.Cap(radius=2.0, base=1.6), rs.Cap(radius=2.0, base=1.0)
GFRP = rs.Material.preset("gfrp")
GEODESIC = rs.Geodesic(spacing=0.3)


def lath(width: float) -> rs.Rod:
    return rs.Rod(rs.RectangularSection(width=0.002, height=width), GFRP)


@cache
def low() -> rs.Form:
    return rs.find_form(LOW, GEODESIC, lath(0.01), joint=rs.Pin(), ends="pinned")


@cache
def high() -> rs.Form:
    return rs.find_form(HIGH, GEODESIC, lath(0.04), joint=rs.Pin(), ends="pinned")


def kept(form: rs.Form) -> Archive:
    return form.archive()


def test_every_node_lies_on_the_target_and_every_edge_has_its_length() -> None:
    draped = high().draped
    assert np.abs(np.linalg.norm(draped.positions, axis=1) - 2.0).max() < 1e-8
    chords = np.linalg.norm(np.diff(draped.positions[draped.mesh.edges], axis=1)[:, 0], axis=1)
    arcs = 4.0 * np.arcsin(chords / 4.0)
    np.testing.assert_allclose(arcs, draped.mesh.edge_lengths, rtol=1e-6)


def test_laths_400_times_as_stiff_within_the_shell_stand_along_geodesics_and_not_along_a_net() -> None:
    form = high()
    assert form.popped["pinned"].report.stable
    assert form.agreement["pinned"].max_relative < 1.2e-3
    net = rs.find_form(HIGH, rs.GridLayout.orthogonal(spacing=0.3), lath(0.04), joint=rs.Pin(), ends="pinned")
    assert net.status != "converged"


def test_a_low_shell_lies_flat_and_a_high_one_is_assembled_in_place() -> None:
    flat, steep = low().flat_state, high().flat_state
    assert flat is not None
    assert steep is not None
    assert flat.lies_flat is True
    assert flat.in_plane_strain == pytest.approx(0.00287, rel=0.01)
    assert flat.limit == pytest.approx(120e6 / 23e9, rel=1e-6)  # design strength for erection over Young's modulus
    assert steep.lies_flat is False
    codes = {found.code: found for found in high().verdict.findings}
    assert "lies_flat" in {found.code for found in low().verdict.findings}
    assert codes["in_place"].level == "good"
    assert steep.in_plane_strain is None or steep.in_plane_strain > 10 * (steep.limit or 0.0)
    assert not {"lost", "erection_strength", "not_checked"} & codes.keys()
    assert high().checks.deployment is None
    assert low().checks.deployment is not None


def test_the_strain_of_the_flat_state_grows_with_the_breadth() -> None:
    wide = rs.find_form(LOW, GEODESIC, lath(0.02), joint=rs.Pin(), ends="pinned").flat_state
    narrow = low().flat_state
    assert wide is not None
    assert narrow is not None
    assert wide.in_plane_strain == pytest.approx(2.0 * (narrow.in_plane_strain or 0.0), rel=1e-9)


def test_rods_keep_their_lengths_and_joints_in_the_flat_state() -> None:
    mesh = low().footprint.mesh
    chords = np.linalg.norm(np.diff(mesh.flat[mesh.edges], axis=1)[:, 0], axis=1)
    np.testing.assert_allclose(chords, mesh.edge_lengths, rtol=2e-6)
    assert np.ptp(mesh.flat[:, 2]) == 0.0


def test_what_does_not_lie_flat_is_not_drawn_flat() -> None:
    flat, steep = kept(low()), kept(high())
    assert {"plan", "strips"} <= drawing_set(flat).keys()
    assert "plan" not in drawing_set(steep)
    assert "strips" in drawing_set(steep)
    assert "flat" in shape_names(flat)
    assert "flat" not in shape_names(steep)


def test_a_rod_that_bends_in_the_flat_state_is_drawn_along_its_course() -> None:
    rods = rods_of(kept(low()))
    assert max(len(rod.course) for rod in rods) > 10
    for joint in joints_of(rods):
        (a, b), (at_a, at_b) = joint.rods, joint.at
        np.testing.assert_allclose(rods[a].point(at_a), rods[b].point(at_b), atol=1e-5)


@pytest.mark.parametrize("form", [low, high])
def test_schedules_have_the_places_of_joints_and_no_flat_ones_of_a_shell_that_is_assembled_in_place(
    form: Callable[[], rs.Form],
) -> None:
    archive, mesh = kept(form()), form().footprint.mesh
    table = joints_table(archive)
    rows = {row[0]: dict(zip(table, row, strict=True)) for row in zip(*table.values(), strict=True)}
    places = form().popped["pinned"].positions[mesh.joint_nodes]
    for joint, place in zip(mesh.grid.joint_names, places, strict=True):
        row = rows[joint]
        found = [float(row[f"final_{axis}_mm"]) for axis in "xyz"]
        np.testing.assert_allclose(found, 1e3 * place, atol=0.1)  # twice the rounding
        assert bool(row["flat_x_mm"]) == bool(row["scissor_deg"]) == (form is low)
    if form is low:
        scissors = {"/".join(load.rods): load.scissor_deg for load in archive.results.joint_loads["pinned"]}
        for joint, row in rows.items():
            assert float(row["scissor_deg"]) == pytest.approx(scissors[joint], abs=0.05)


def test_families_of_a_lattice_are_named_in_the_result_and_coloured_in_drawings() -> None:
    archive = kept(low())
    families = [rod.family for rod in archive.results.rods]
    assert {*families} == {"u", "v"}
    assert [rod.id[0].lower() for rod in archive.results.rods] == families
    assert {rod.offset for rod in archive.results.rods} == {None}  # on no line of the flat plan
    crossed = {frozenset((rod.family, joint.other[0].lower())) for rod in archive.results.rods for joint in rod.joints}
    assert all(len(pair) == 2 for pair in crossed)  # rods of a family do not cross
    assert {*family_numbers(families)} == {0, 1}


def test_a_result_is_kept_and_its_case_gives_it_again(tmp_path: Path) -> None:
    form = low()
    form.save(tmp_path / "kept", kinds=["csv"])
    archive = read(tmp_path / "kept")
    assert archive.results.layout is not None
    assert archive.results.layout.kind == "geodesic"
    assert archive.results.flat_state == form.flat_state
    again = rs.Job.load(tmp_path / "kept" / "case.toml").run(until="pop-up")
    np.testing.assert_allclose(again.popped["pinned"].positions, form.popped["pinned"].positions, atol=1e-12)


def test_the_case_has_the_keys_of_its_lattice_alone() -> None:
    case = load_case("cap", {"layout.kind": "geodesic", "layout.spacing": "50 mm", "layout.families": "3"})
    assert case.layout == rs.Geodesic(spacing=0.05, families=3, edge=case.layout.edge)
    with pytest.raises(InputError, match=r'layout.families = 3: a layout of kind "chebyshev" has no families'):
        load_case("cap", {"layout.families": 3})
    with pytest.raises(InputError, match="layout families must be 2 or 3, not 4"):
        load_case("cap", {"layout.kind": "geodesic", "layout.families": 4})


def test_a_spacing_that_is_left_out_follows_from_the_target() -> None:
    form = rs.find_form(LOW, rs.Geodesic(), lath(0.01), joint=rs.Pin(), ends="pinned")
    assert form.layout.least_spacing == pytest.approx(LOW.size / 8, rel=0.2)
    with pytest.raises(InputError, match="depends on the target"):
        assert rs.Geodesic().least_spacing


def test_rods_can_be_left_out_by_name() -> None:
    names = [rod.name for rod in low().footprint.rods]
    left_out = rs.Geodesic(spacing=0.3, left_out=(names[0],))
    form = rs.find_form(LOW, left_out, lath(0.01), joint=rs.Pin(), ends="pinned")
    assert {rod.name for rod in form.footprint.rods} == set(names) - {names[0]}
    with pytest.raises(InputError, match='layout left_out has "U99", which is not the name of a rod on the target'):
        rs.find_form(LOW, rs.Geodesic(spacing=0.3, left_out=("U99",)), lath(0.01), ends="pinned")


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ({"method": rs.Gravity()}, r'a lattice "geodesic" follows curves of the target: bind it there'),
        ({"joint": rs.Pin(eccentricity=0.004)}, "need two layers of rods"),
        ({"anchor": "auto"}, "searches for anchor or heading need the lattice"),
        ({"seams": [[(0.0, -3.0), (0.0, 3.0)]]}, 'a target cut by seams needs "chebyshev"'),
    ],
)
def test_what_such_a_lattice_does_not_have_is_refused_in_one_sentence(keys: dict[str, object], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        rs.find_form(LOW, GEODESIC, lath(0.01), ends="pinned", **keys)  # type: ignore[arg-type]


def test_strips_upright_on_a_saddle_stand_and_have_no_curvature_out_of_the_surface() -> None:
    target = rs.HeightField(formula="0.8*(log(cos(y/0.8)) - log(cos(x/0.8)))", domain=rs.Disc(0.9))
    strip = rs.Rod(rs.RectangularSection(width=0.02, height=0.002), GFRP)
    form = rs.find_form(target, rs.Asymptotic(spacing=0.15), strip, joint=rs.Pin(), ends="pinned", anchor=(0.0, 0.0))
    assert form.popped["pinned"].report.stable
    assert form.agreement["pinned"].max_relative < 3e-4
    bent = form.checks.bending["pinned"]
    assert np.abs(bent.normal_curvature).max() < 0.05 * np.abs(bent.geodesic_curvature).max()


def test_three_families_lie_on_the_target_and_stand() -> None:
    form = rs.find_form(HIGH, rs.Geodesic(spacing=0.3, families=3), lath(0.02), joint=rs.Pin(), ends="pinned")
    assert {rod.name[0] for rod in form.footprint.rods} == set("UVW")
    assert form.popped["pinned"].report.stable
    assert form.checks.contact["pinned"].pairs == 0


def ring(inner: float, outer: float) -> rs.Freeform:
    """A mesh of a spherical dome with a round opening."""
    radius, angle = np.meshgrid(np.linspace(inner, outer, 40), np.linspace(0.0, 2.0 * np.pi, 160, endpoint=False))
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    rows, columns = np.meshgrid(np.arange(160), np.arange(39), indexing="ij")
    a, b = 40 * rows + columns, 40 * ((rows + 1) % 160) + columns
    faces = np.concatenate([np.stack([a, a + 1, b + 1], axis=-1), np.stack([a, b + 1, b], axis=-1)])
    return rs.Freeform.of(
        np.column_stack([each.ravel() for each in (x, y, np.sqrt(36.0 - x * x - y * y))]), faces.reshape(-1, 3)
    )


def test_curves_pass_over_an_opening_and_rods_end_at_it() -> None:
    target = ring(0.8, 3.0)
    form = rs.find_form(target, rs.Geodesic(spacing=0.4), lath(0.02), joint=rs.Pin(), ends="pinned", anchor=(1.5, 0.0))
    rods = form.footprint.rods
    assert {rod.name[:3] for rod in rods if rod.name.endswith("a")} == {
        rod.name[:3] for rod in rods if rod.name.endswith("b")
    }
    ends = form.boundary.points
    assert np.abs(target.margin(ends)).max() < 1e-5 * target.size
    radius = np.hypot(ends[:, 0], ends[:, 1])
    assert np.minimum(np.abs(radius - 0.8), np.abs(radius - 3.0)).max() < 2e-3
    assert np.count_nonzero(radius < 1.0) >= 8
    inside = form.popped["pinned"].positions[:, :2]
    assert np.linalg.norm(inside, axis=1).min() > 0.75


DRAWN = [[(x, -1.3), (x + 0.05, 0.0), (x, 1.3)] for x in (-0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75)]
DRAWN += [[point[::-1] for point in line] for line in DRAWN]


def test_rods_along_given_lines_stand_and_keep_their_names_and_lengths() -> None:
    names = [f"{letter}{k}" for letter in "AB" for k in range(1, 8)]
    form = rs.find_form(LOW, rs.Curves(lines=DRAWN, names=names), lath(0.01), joint=rs.Pin(), ends="pinned")
    assert form.status == "converged"
    assert form.popped["pinned"].report.stable
    assert form.agreement["pinned"].max_relative < 5e-3
    assert [rod.name for rod in form.footprint.rods] == names
    middle = form.footprint.rods[
        names.index("A4")
    ]  # through (0, -1.3), (0.05, 0), (0, 1.3), over the cap's base circle
    y = np.linspace(-1.2, 1.2, 20001)
    x = 0.05 * (1 - (y / 1.3) ** 2)
    within = x**2 + y**2 < 4.0 - 1.6**2
    arc = np.column_stack([x, y, np.sqrt(4.0 - x**2 - y**2)])[within]
    assert middle.length == pytest.approx(np.linalg.norm(np.diff(arc, axis=0), axis=1).sum(), abs=3e-4)  # a step of y


@pytest.mark.parametrize("kind", ["csv", "obj", "dxf"])
def test_lines_are_read_from_files_and_stay_in_the_case(kind: str, tmp_path: Path) -> None:
    path = tmp_path / f"rods.{kind}"
    if kind == "csv":
        rows = [f"S{k};{x};{y}".replace(".", ",") for k, line in enumerate(DRAWN) for x, y in 1e3 * np.array(line)]
        path.write_text("\n".join(["rod;x;y", *rows]))
    elif kind == "obj":
        t = np.linspace(-1.0, 1.0, 9)
        fine = [np.column_stack([x + 0.05 * (1 - t**2), 1.3 * t]) for (x, _), _, _ in DRAWN[:7]]  # the parabolas
        fine += [line[:, ::-1] for line in fine]
        points = [(x, y, np.sqrt(4.0 - x**2 - y**2)) for line in fine for x, y in line]
        lines = [f"v {1e3 * x} {1e3 * y} {1e3 * z}" for x, y, z in points]
        of = [" ".join(str(9 * k + j) for j in range(1, 10)) for k in range(len(DRAWN))]
        path.write_text("\n".join([*lines, *(f"l {indices}" for indices in of)]))
    else:
        drawing = ezdxf.new()
        for line in DRAWN:
            drawing.modelspace().add_spline([(1e3 * x, 1e3 * y) for x, y in line])
        drawing.saveas(path)
    drawn = {"layout.kind": "curves", "layout.file": str(path), "layout.unit": "mm"}
    case = load_case("cap", {**drawn, "target.radius": 2.0, "target.base": 1.6})
    assert case.layout.kind == "curves"
    assert len(case.layout.lines) == len(DRAWN)
    assert case.layout.names[0] == ("S0" if kind == "csv" else "R01")
    path.unlink()
    again = load_case(case.to_toml())
    assert again.layout == case.layout
    crossings = surface_net(LOW, case.layout.build(LOW)).crossings
    exact = surface_net(LOW, rs.Curves(lines=DRAWN).build(LOW)).crossings
    np.testing.assert_array_equal(crossings.rods, exact.rods)
    if kind == "csv":
        np.testing.assert_allclose(crossings.at, exact.at, atol=1e-9)


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ("rod,x\nA,1", "needs the columns rod, x, y"),
        ("rod,x,y\nA,1,2", "rod 'A' has 1 point"),
        ("rod,x,y\nA,1,two\nA,2,3", "line 2, y"),
        ("rod,x,y\nA,1\nA,2,3", "line 2 has 2 cells, the header 3"),
    ],
)
def test_a_damaged_table_of_lines_is_named(table: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "rods.csv").write_text(table)
    with pytest.raises(InputError, match=says):
        load_case("cap", {"layout.kind": "curves", "layout.file": str(tmp_path / "rods.csv")})


def test_given_lines_have_no_anchor_and_must_cross() -> None:
    with pytest.raises(InputError, match="an anchor is a point from which rods are set out"):
        rs.find_form(LOW, rs.Curves(lines=DRAWN), lath(0.01), anchor=(0.1, 0.0))
    with pytest.raises(InputError, match="no two rods cross on the target, on which 2 lie"):
        rs.find_form(LOW, rs.Curves(lines=[DRAWN[0], DRAWN[3]], spacing=0.3), lath(0.01))


def test_broad_laths_buckle_along_given_lines_unless_they_are_curved_at_rest() -> None:
    lines = [[(x, -3.0), (x, 3.0)] for x in np.arange(-1.0, 1.01, 0.25)]
    lines += [[point[::-1] for point in line] for line in lines]
    straight, curved = (
        rs.find_form(LOW, rs.Curves(lines=lines, rest=rest), lath(0.04), joint=rs.Pin(), ends="pinned")
        for rest in ("straight", "curved")
    )
    assert straight.status != "converged"
    assert curved.popped["pinned"].report.stable
    assert curved.agreement["pinned"].max_relative < 3e-3


def test_on_a_plane_a_curved_lattice_is_free_of_stress() -> None:
    """Blanks cut along the lines of a flat target."""
    flat = rs.HeightField(function=lambda x, y: 1e-3 + 0 * x, domain=rs.Rectangle((2.0, 2.0)))
    lines = [[(x + 0.2 * (1 - y**2), y) for y in np.linspace(-1.2, 1.2, 9)] for x in (-0.6, -0.2, 0.2, 0.6)]
    lines += [[point[::-1] for point in line] for line in lines]
    strains = []
    for edge in (0.06, 0.03):
        layout = rs.Curves(lines=lines, rest="curved", edge=edge)
        found = rs.drape(layout, lath(0.04), flat, joint=rs.Pin()).flat_state
        assert found is not None
        assert found.strain is not None
        strains.append(found.strain)
    bent = 0.02 * 0.4  # half the breadth times the lines' curvature: what straight rods would have
    assert strains[0] < 2e-3 * bent
    assert strains[1] < 0.3 * strains[0]


def test_a_rod_that_swings_on_one_joint_does_not_keep_the_others_from_lying_flat() -> None:
    """Nothing resists it in the plane; it is left out when the shell is trimmed."""
    target = rs.HeightField(formula="4*(log(cos(y/4)) - log(cos(x/4)))", domain=rs.Disc(4.5))
    job = rs.Job(target, rs.Geodesic(spacing=0.8), lath(0.024), joint=rs.Pin(), anchor=(0.0, 0.0))
    form = job.run(until="drape")
    assert form.draped.mesh.grid.joint_counts().min() == 1
    assert form.flat_state is not None
    assert form.flat_state.negative_modes == 0


def test_laths_that_would_cross_just_past_their_ends_do_not_touch() -> None:
    """As at a crossing next to an end: on one support they lie one over the other."""
    target = rs.HeightField(formula="(x^3 - 3*x*y^2)/90", domain=rs.Disc(5.0))
    rod = rs.Rod(rs.RectangularSection(width=0.006, height=0.060), GFRP)
    form = rs.find_form(target, rs.Geodesic(spacing=0.8), rod, joint=rs.Pin(), ends="pinned")
    first, last = form.footprint.mesh.grid.ends[form.footprint.mesh.grid.meetings(0.1).rods].transpose(2, 0, 1)
    at = form.footprint.mesh.grid.meetings(0.1).at
    assert ((at < first) | (last < at)).any()
    popped = form.popped["pinned"]
    assert contact_of(popped.shell, popped.state, rod).pairs == 0


@cache
def curved() -> rs.Form:
    lines = [[(x + 0.1 * np.cos(y), y) for y in np.linspace(-1.6, 1.6, 9)] for x in (-0.6, -0.2, 0.2, 0.6)]
    lines += [[point[::-1] for point in line] for line in lines]
    return rs.find_form(LOW, rs.Curves(lines=lines, rest="curved"), lath(0.04), joint=rs.Pin(), ends="pinned")


def test_a_result_keeps_how_its_rods_are_curved_at_rest(tmp_path: Path) -> None:
    """As the mesh has it, over each rod from its start; kept, read, written again and run again it is the same."""
    form = curved()
    archive, mesh = kept(form), form.footprint.mesh
    for k, rod in enumerate(archive.results.rods):
        known = rod.rest_curvature
        assert known is not None
        assert (known.at[0], known.at[-1]) == pytest.approx((0.0, rod.length))
        here = mesh.rod_slice(k)
        found = np.interp(mesh.stations[here] - rod.start, known.at, known.curvatures)
        np.testing.assert_allclose(found, mesh.rest_curvatures[here], atol=1e-6)
    folder = form.save(tmp_path / "kept", kinds=[])
    again = read(folder)
    assert [rod.rest_curvature for rod in again.results.rods] == [rod.rest_curvature for rod in archive.results.rods]
    assert rs.Job.load(folder / "case.toml").run(until="drape").draped.rods == form.draped.rods
    with pytest.raises(InputError, match=r"do not lie straight in the plane \(the first: R0\d\).*run its case again"):
        read_result(folder)


@pytest.mark.slow
def test_a_refinement_of_curved_laths_keeps_their_curves_and_the_blank_follows_the_breadth() -> None:
    refined = rs.refine(curved(), ["taper"])
    assert refined.refined is not None
    assert refined.refined.changed
    found, before = kept(refined), kept(curved())
    rods = [archive.results.rods[0] for archive in (found, before)]
    assert rods[0].rest_curvature == rods[1].rest_curvature
    along = rods[0].stiffness
    assert along is not None
    assert along.varies == "size"
    right, left = blanks_of(found)[rods[0].id].across(along.at[1])
    assert np.hypot(*(left - right)) == pytest.approx(0.04 * along.factors[1] ** 0.25, rel=1e-3)


def test_meshed_again_rods_lie_in_the_plane_as_before() -> None:
    """Angles at rest of rigid joints are those of the flat state."""
    old, again = low().footprint.mesh, meshed_again(low().stages, "pinned").footprint.mesh
    np.testing.assert_allclose(again.flat[again.joint_nodes], old.flat[old.joint_nodes], atol=1e-9)


def test_lengths_cannot_be_refined_along_curves() -> None:
    with pytest.raises(InputError, match="tails and holes cannot vary where rods follow curves of the target"):
        rs.refine(low(), ["tails", "holes"])


def test_a_straight_rod_has_no_curvature_at_rest() -> None:
    assert all(rod.rest_curvature is None for rod in kept(low()).results.rods)


def test_each_family_has_its_name_and_its_colour() -> None:
    """First, second and third; lines that are given are of none, and of one colour."""
    three = rs.find_form(LOW, rs.Geodesic(spacing=0.4, families=3), lath(0.01), joint=rs.Pin(), ends="pinned")
    rods = rods_of(kept(three))
    assert {rod.id[0]: rod.family for rod in rods} == {"U": "u", "V": "v", "W": "w"}
    scene = scene_of(kept(three))
    assert scene is not None
    assert {rod["id"][0]: rod["ink"] for rod in scene.header["rods"]} == dict(zip("UVW", FAMILIES, strict=True))
    assert scene.header["families"] == list(zip("uvw", FAMILIES, strict=True))  # of the viewer's legend
    assert {rod.family for rod in rods_of(kept(curved()))} == {"free"}
    plan = flat_drawing(flat_plan(kept(low())), 20.0)
    pens = {path.name[0]: path.pen.colour for path in plan.paths if path.name and path.pen}
    assert pens == {"U": FAMILIES[0], "V": FAMILIES[1]}


def test_strips_of_a_saddle_cross_by_slots_unless_they_are_pinned() -> None:
    """On Scherk's surface asymptotic lines cross at right angles; in the plane they are more acute."""
    target = rs.HeightField(formula="0.8*(log(cos(y/0.8)) - log(cos(x/0.8)))", domain=rs.Disc(0.9))
    strip = rs.Rod(rs.RectangularSection(width=0.020, height=0.002), GFRP)
    layout, slots = rs.Asymptotic(spacing=0.3), rs.Spring(out_of_plane=np.inf, twist=np.inf)
    forms = [
        rs.find_form(target, layout, strip, joint=joint, ends="pinned", anchor=(0.0, 0.0))
        for joint in (slots, rs.Pin())
    ]
    slotted, pinned = map(kept, forms)
    assert not any(joint.slot for rod in pinned.results.rods for joint in rod.joints)
    assert pinned.results.fabrication is not None
    assert pinned.results.fabrication.slot_depth is None
    assert slotted.results.fabrication is not None
    assert slotted.results.fabrication.slot_depth == pytest.approx(0.010)
    said = [{finding.code for finding in kept.verdict.findings} for kept in (slotted, pinned)]
    assert ["slots_weaken" in codes for codes in said] == [True, False]
    assert slotted.verdict.level != "good"
    assert slotted.results.flat_state is not None
    assert slotted.results.flat_state.lies_flat
    table, widths = joints_table(slotted), dict[str, float]()
    np.testing.assert_allclose(np.array(table["final_deg"], dtype=float), 90.0, atol=1.5)  # by polylines
    for k, name in enumerate(table["id"]):
        flat = np.radians(float(table["flat_deg"][k]))
        widths[name] = 2e-3 / np.tan(0.5 * min(flat, np.pi - flat))
        assert float(table["slot_mm"][k]) == pytest.approx(1e3 * widths[name], abs=0.06)  # rounding, polylines
        assert table["over"][k].startswith("V")
    for rod in slotted.results.rods:
        for joint in rod.joints:
            both = f"{rod.id}/{joint.other}" if rod.family == "u" else f"{joint.other}/{rod.id}"
            assert joint.slot == pytest.approx(widths[both], rel=1e-2)


def test_a_clearance_of_slots_needs_slots() -> None:
    with pytest.raises(InputError, match=r"fabrication.slot_clearance = 0.001: only strips of an asymptotic lattice"):
        load_case("cap", {"fabrication.slot_clearance": "1 mm"}).build()
    saddle = {"target.kind": "heightfield", "target.formula": "x*y", "target.domain": "disc", "target.radius": 1.0}
    strips = {"layout.kind": "asymptotic", "rod.section": {"kind": "rectangle", "width": 0.02, "height": 0.002}}
    case = load_case({**saddle, **strips, "rod.material": {"preset": "gfrp"}, "fabrication.slot_clearance": "1 mm"})
    assert case.build().layout.upright


@pytest.mark.parametrize(
    ("layout", "closer", "elsewhere"),
    [
        (rs.Geodesic(), "a smaller spacing", "another anchor or layout.rotate"),
        (rs.Asymptotic(), "a smaller spacing", "another anchor or layout.rotate"),
        (rs.Curves(), "lines that lie closer", "other lines"),
        (rs.GridLayout.orthogonal(spacing=0.1), "a smaller spacing", "another offset, anchor or heading"),
    ],
)
def test_advice_fits_the_lattice(layout: rs.GridLayout | rs.Curves, closer: str, elsewhere: str) -> None:
    diverged, buckled = Status.DIVERGED.sentence_on(layout), Status.BUCKLED.sentence_on(layout)
    assert diverged == f"the iteration diverged; choose {closer}, or {elsewhere}"
    assert f"{closer}, a flatter target" in buckled


def test_rods_along_lines_that_run_far_past_their_last_joint_are_told_of_other_lines() -> None:
    lines = [[(x, -1.5), (x, 1.5)] for x in (-0.2, 0.0, 0.2)] + [[(-1.5, y), (1.5, y)] for y in (-0.2, 0.0, 0.2)]
    form = rs.Job(LOW, rs.Curves(lines=lines, spacing=0.2), lath(0.01), joint=rs.Pin()).run(until="drape")
    (said,) = [word for word in form.warnings if "past its last joint" in word]
    assert said.endswith("; other lines may help, or leave such rods out (layout.left_out)")


def test_curved_rods_are_laid_flat_at_the_angle_that_they_have_on_the_target() -> None:
    """To scissor them hardly bends them: without their middle joint held they would end as a narrow bundle."""
    lines = [[(x + 0.2 * (1 - y**2), y) for y in np.linspace(-1.3, 1.3, 9)] for x in np.arange(-0.9, 0.91, 0.3)]
    lines += [[point[::-1] for point in line] for line in lines]
    draped = rs.drape(rs.Curves(lines=lines, rest="curved"), lath(0.06), LOW, joint=rs.Pin())
    found = draped.flat_state
    assert found is not None
    assert found.report.stable
    grown = np.ptp(found.positions, axis=0) / np.ptp(draped.positions[:, :2], axis=0)
    np.testing.assert_allclose(grown, np.sqrt(grown.prod()), rtol=0.02)  # both ways alike
    assert 1.0 < grown.prod() < 1.2


def test_joints_that_are_nearer_than_a_lath_is_broad_are_said() -> None:
    (said,) = rs.drape(rs.Geodesic(spacing=0.3, families=3), lath(0.04), HIGH, joint=rs.Pin()).warnings
    assert "pairs of neighbouring joints on a rod are nearer than its breadth of 40 mm" in said
    assert not rs.drape(rs.Geodesic(spacing=0.3), lath(0.04), HIGH, joint=rs.Pin()).warnings
