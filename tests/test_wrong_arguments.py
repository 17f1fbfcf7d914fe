"""Arguments of the wrong kind are refused in one sentence each; and what was saved is read again."""

from functools import cache

import numpy as np
import pytest

import rodshell as rs
from rodshell.case.link import studio_link
from rodshell.cli import main

TARGET = rs.Hemisphere(radius=0.2)
METHODS = r"method must be rodshell.Bound\(\), rodshell.Gravity\(\) or rodshell.Fall\(\)"
LAYOUT = rs.GridLayout.orthogonal(rods=(5, 5), spacing=0.06, length=1.0)
CROSS = rs.straight_rods([[(-1.0, 0.0), (1.0, 0.0)], [(0.0, -1.0), (0.0, 1.0)]])
FOOTPRINT = rs.Footprint(rs.mesh_grid(CROSS, 0.5))
BOUNDARY = rs.Boundary(np.zeros((4, 3)), np.zeros((4, 3)))
ROD = rs.Rod(rs.Circle(radius=1e-3), rs.Material(youngs_modulus=1e6, density=1e3))


@cache
def form():
    return rs.find_form(TARGET, LAYOUT, ROD, ends="pinned")


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (
            lambda: rs.find_form(TARGET, LAYOUT, ROD, warm_start="x"),
            'warm_start must be a form that Job.run .*, not "x"',
        ),
        (
            lambda: rs.find_form(TARGET, LAYOUT, ROD, warm_start=LAYOUT),
            "warm_start must be a form .*, not a GridLayout",
        ),
        (lambda: rs.find_form(LAYOUT, TARGET, ROD), "target must be a rodshell Target, not a GridLayout"),
        (
            lambda: rs.find_form(TARGET, ROD, LAYOUT),
            "layout must be a rodshell GridLayout or Geodesic or A",
        ),
        (lambda: rs.find_form(TARGET, LAYOUT, ROD.section), "rod must be a rodshell Rod, not a Circle"),
        (
            lambda: rs.find_form("dome", LAYOUT, ROD, seams=[[(-1, 0), (1, 0)]]),
            'target must be a rodshell Target, not "dome"',
        ),
        (lambda: rs.Job(TARGET, LAYOUT), "a job needs target, layout and rod; for a case"),
        (lambda: rs.Job("hemisphere", LAYOUT, ROD), 'target must be a rodshell Target, not "hemisphere"'),
        (
            lambda: rs.drape(TARGET, LAYOUT, ROD),
            "layout must be a rodshell GridLayout or Geodesic or A",
        ),
        (lambda: rs.drape(LAYOUT, ROD, 3.0), "target must be a rodshell Target, not 3.0"),
        (lambda: rs.drape(LAYOUT, ROD, TARGET, warm_start="x"), 'warm_start must be what .* rodshell.drape .*"x"'),
        (lambda: rs.drape(LAYOUT, ROD, TARGET, anchor="0,0"), "anchor must be two finite numbers x, y in m, not '0,0'"),
        (lambda: rs.drape(LAYOUT, ROD, TARGET, anchor=(0.0, np.nan)), "anchor must be two finite numbers"),
        (lambda: rs.drape(LAYOUT, ROD, TARGET, anchor=0.1), "anchor must be two finite numbers x, y in m, not 0.1"),
        (
            lambda: rs.find_form(TARGET, LAYOUT, ROD, ends="clampd"),
            'ends must be "pinned", "clamped" or "both", not "clampd": did you mean "clamped"?',
        ),
        (
            lambda: rs.find_form(TARGET, LAYOUT, ROD, ends=("pinned", "x")),
            'ends must be "pinned", "clamped" or "both", not "x"',
        ),
        (lambda: rs.find_form(TARGET, LAYOUT, ROD, ends=1), 'one or several of "pinned", "clamped", "both", not 1'),
        (lambda: rs.find_form(TARGET, LAYOUT, ROD, method="bound"), f'{METHODS}, not "bound"'),
        (lambda: rs.drape(LAYOUT, ROD, TARGET, method="gravity"), f'{METHODS}, not "gravity"'),
        (lambda: rs.drape(LAYOUT, ROD, TARGET, method=None), f"{METHODS}, not None"),
        (lambda: rs.drape(LAYOUT, ROD, TARGET, method=rs.Fall), f"{METHODS}, not the class Fall itself"),
        (lambda: rs.Gravity(acceleration=-5.0), "acceleration of gravity must be positive, not -5.0 m/s2"),
        (lambda: rs.Fall(acceleration="9.81"), 'acceleration of gravity must be a number in m/s2, not "9.81"'),
        (lambda: rs.Fall(friction=-0.1), "the fall's friction must be 0 or more, not -0.1"),
        (lambda: rs.Fall(drag=np.nan), "the fall's drag must be 0 or more, not nan 1/s"),
        (lambda: rs.Fall(coupling="implicit"), r"coupling must be rodshell.SharedDofs\(\), .*, not \"implicit\""),
        (
            lambda: rs.Fall(coupling=rs.ImplicitPenalty),
            r"coupling must be rodshell.SharedDofs\(\), .*, not the class ImplicitPenalty itself",
        ),
        (lambda: rs.Fall(stopped="partly"), 'stopped must be "all" or "normal", not "partly"'),
        (lambda: rs.Fall(every=0), "every must be a whole number of 1 or more, not 0"),
        (lambda: rs.Fall(stream=3), "stream must be the path of a folder, not 3"),
        (lambda: rs.Fall(settle="no"), 'settle must be True or False, not "no"'),
        (
            lambda: rs.drape(LAYOUT, ROD, TARGET, joint=(rs.Pin(),)),
            "joint must be one rodshell .*, not a sequence",
        ),
        (lambda: rs.find_form(TARGET, LAYOUT, ROD, joint="pin"), r"such as rodshell.Pin\(\), not \"pin\""),
        (lambda: rs.find_form(TARGET, LAYOUT, ROD, joint=rs.Pin), "not the class Pin itself"),
        (lambda: rs.pop_up(None, None, ROD, ends="clampd"), 'ends must be "pinned" or "clamped", not "clampd"'),
        (lambda: rs.pop_up(None, None, ROD, start="drapped"), 'not "drapped": did you mean "draped"?'),
        (lambda: rs.pop_up(None, None, ROD, warm_start="flat"), "what an earlier rodshell.pop_up returned"),
        (lambda: rs.pop_up(None, ROD, None), "footprint must be a rodshell Footprint, not None"),
        (lambda: rs.pop_up(FOOTPRINT, ROD, BOUNDARY), "boundary must be a rodshell Boundary, not a Rod"),
        (lambda: rs.pop_up(BOUNDARY, FOOTPRINT, ROD), "footprint must be a rodshell Footprint, not a Boundary"),
        (lambda: rs.pop_up(FOOTPRINT, BOUNDARY, TARGET), "rod must be a rodshell Rod, not a Hemisphere"),
        (lambda: rs.OutputOptions(fabrication=3), "fabrication must be a rodshell Fabrication, not 3"),
        (lambda: rs.OutputOptions(drawings="A3"), 'drawings must be a rodshell DrawingStyle, not "A3"'),
        (lambda: rs.OutputOptions(stages="3"), 'stages must be a whole number, 0 to 1000, not "3"'),
        (lambda: rs.OutputOptions(stages=True), "stages must be a whole number, 0 to 1000, not true"),
        (lambda: rs.OutputOptions(strength="3"), 'the strength must be a number in Pa, not "3"'),
        (lambda: rs.DrawingStyle(project=3), "the project of drawings must be text, not 3"),
        (lambda: rs.DrawingStyle(date=None), "the date of drawings must be text, not None"),
        (lambda: rs.DrawingStyle(paper=["A3"]), "the paper of drawings must be text, not a list"),
        (lambda: rs.DrawingStyle(tolerance="1"), 'the tolerance of drawings must be a number in m, not "1"'),
        (lambda: rs.DrawingStyle(layers=["CUT"]), "the layers of drawings must be a mapping .*, not a list"),
        (lambda: rs.DrawingStyle(layers={"CUT": 3}), "the name of layer CUT must be text, not 3"),
        (
            lambda: rs.GridLayout.orthogonal(spacing=np.array([0.03, 0.04, 0.05])),
            "layout spacing must be two lengths in m, not array",
        ),
        (
            lambda: rs.GridLayout.orthogonal(spacing=np.array(0.03)),
            "layout spacing must be two lengths in m, not array",
        ),
        (lambda: rs.GridLayout.orthogonal(spacing="3"), 'layout spacing must be one or two lengths in m, not "3"'),
        (lambda: studio_link(rs.Job(TARGET, LAYOUT, ROD)), "case must be the case of a job: job.case, not a Job"),
        (lambda: rs.agreement(None, TARGET), "popped must be what rodshell.pop_up returned, not None"),
        (lambda: rs.agreement(form().popped["pinned"], None), "target must be a rodshell Target, not None"),
        (lambda: rs.trim(LAYOUT), "draped must be what rodshell.drape returned, not a GridLayout"),
        (
            lambda: rs.map_back(rs.drape(LAYOUT, ROD, TARGET)),
            "trimmed must be what rodshell.trim returned, not a Draped",
        ),
        (lambda: rs.read(None), "folder must be the path of a folder, not None"),
        (lambda: rs.Results.of(None), "content must be a mapping, as result.json holds one, not None"),
        (lambda: rs.Rod(ROD.material, ROD.section), "section must be a circle, .* section, not a Material"),
        (lambda: rs.Rod(ROD.section, 1e9), "material must be a rodshell Material, not 1000000000.0"),
        (lambda: rs.Hemisphere(radius="20"), 'target radius must be a number in m, not "20"'),
        (lambda: rs.Cap(radius=1.0, base="0.2"), 'target base must be a number in m, not "0.2"'),
        (
            lambda: rs.drape(LAYOUT, ROD, TARGET, anchor=(1, 1)),
            r"no point over \(1, 1\) m: choose .* \(--anchor auto\)",
        ),
    ],
)
def test_a_wrong_argument_is_refused_in_one_sentence(call, sentence):
    with pytest.raises(rs.InputError, match=sentence):
        call()


SNOW = {"snow": rs.Snow(500.0)}
WINTER = {"winter": {"snow": 1.5}}
LINE = rs.ElasticRod.of([(0, 0, 0), (0.1, 0, 0), (0.2, 0, 0)], ROD, clamped=("start",))


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (
            lambda: rs.Settlement(supports="U03.1", move=(0, 0, 0.1)),
            r'the supports of a settlement must be a list of rod ends such as \["U03.1"\], not "U03.1"',
        ),
        (lambda: rs.Settlement(supports=[3], move=(0, 0, 0.1)), "each of the supports of a settlement must be text"),
        (lambda: rs.LineLoad(line=None, force=(0, 0, -1)), "the line of a load must be points x, y in m, not None"),
        (lambda: rs.Fabrication(kerf="3"), 'the kerf must be a number in m, not "3"'),
        (lambda: rs.Fabrication(end_allowance=-0.1), "the end allowance must be 0 or more, not -0.1 m"),
        (lambda: rs.Fabrication(stock_length=np.nan), "the stock length must be positive, not nan m"),
        (lambda: rs.trim(form().draped, fewest="3"), 'fewest must be a whole number of 0 or more, not "3"'),
        (lambda: rs.trim(form().draped, fewest=-1), "fewest must be a whole number of 0 or more, not -1"),
        (lambda: rs.fabricate(None, ROD, rs.Fabrication()), "mesh must be a rodshell GridMesh, not None"),
        (lambda: rs.fabricate(FOOTPRINT.mesh, ROD, None), "options must be a rodshell Fabrication, not None"),
        (
            lambda: rs.fabricate(FOOTPRINT.mesh, TARGET, rs.Fabrication()),
            "rod must be a rodshell Rod, not a Hemisphere",
        ),
        (lambda: rs.fabricate(FOOTPRINT.mesh, ROD, rs.Fabrication(), final="x"), "final must be numbers of the shape"),
        (lambda: rs.fabricate(FOOTPRINT.mesh, ROD, rs.Fabrication(), curvature=[1.0]), "curvature must have the shape"),
        (
            lambda: rs.fabricate(FOOTPRINT.mesh, ROD, rs.Fabrication(), to_supports="no"),
            "to_supports must be True or False",
        ),
        (lambda: rs.Cables(rod=ROD, pattern=None), "the pattern of diagonals must be text .*, not None"),
        (lambda: rs.Damping(rate="1"), 'the damping rate must be a number in 1/s, not "1"'),
        (lambda: rs.Damping(coefficients="1 2"), "the damping coefficients must be"),
        (lambda: rs.Damping(coefficients=[[1.0], [1.0, 2.0]]), "the damping coefficients must be"),
        (lambda: rs.FlatGrid.of(None), "rods must be a list of rodshell.FlatRod, not None"),
        (lambda: rs.FlatGrid.of([ROD]), "each of the rods must be a rodshell FlatRod, not a Rod"),
        (lambda: rs.FlatGrid.of(CROSS.rods, margin="1"), 'margin must be a number in m, not "1"'),
        (lambda: CROSS.with_profiles(3), "each of the profiles must be a rodshell Profile, not 3"),
        (lambda: rs.GridLayout.orthogonal(spacing=0.1, left_out=None), "layout left_out must be names of rods, not"),
        (lambda: rs.GridLayout.orthogonal(spacing=0.1, left_out="U03"), 'must be names of rods, not "U03"'),
        (lambda: rs.Job(TARGET, LAYOUT, ROD, rotate="45"), 'rotate must be a number in rad, not "45"'),
        (lambda: rs.Job(TARGET, LAYOUT, ROD, rotate=np.nan), "rotate must be finite, not nan rad"),
        (lambda: rs.Job(TARGET, LAYOUT, ROD, seams=3), "seams must be a list of lines, .*, not 3"),
        (lambda: rs.Job(TARGET, LAYOUT, ROD, patches=[3]), "patches must be settings by the names .*, not a list"),
        (lambda: rs.Job(TARGET, LAYOUT, ROD, patches={3: rs.PatchLayout()}), "name of each patch must be text, not 3"),
        (lambda: rs.PatchLayout(spacing="3"), "a patch's spacing must be two lengths in m, not '3'"),
        (lambda: rs.PatchLayout(anchor=0.0), "a patch's anchor must be two finite numbers x, y in m, not 0.0"),
        (lambda: rs.Loads(loads=None, combinations=WINTER), "loads must be loads by their names, .*, not None"),
        (lambda: rs.Loads(loads=SNOW, combinations=[1]), "combinations must be factors by the names .*, not a list"),
        (
            lambda: rs.Loads(loads=SNOW, combinations={"winter": 1.5}),
            'the combination "winter" must be factors by the names of loads, .*, not 1.5',
        ),
        (lambda: rs.Loads(loads=SNOW, combinations=WINTER, stability=3), "stability must be a rodshell Stability, not"),
        (lambda: rs.Loads(loads=SNOW, combinations=WINTER, durations="x"), 'durations must be durations .*, not "x"'),
        (lambda: rs.Profile((0.0, None), (1.0, 1.0)), "each of the stations of a profile must be a number, not None"),
        (lambda: rs.Profile.symmetric(None), "the factors of a profile must be a sequence of numbers, not None"),
        (lambda: rs.Profile.double("0.5"), 'length that is double must be a number, not "0.5"'),
        (lambda: rs.chebyshev_net(LAYOUT, TARGET), "target must be a rodshell Target, not a GridLayout"),
        (lambda: rs.chebyshev_net(TARGET, None), "layout must be a rodshell GridLayout, not None"),
        (lambda: rs.chebyshev_net(TARGET, LAYOUT, warm_start="x"), 'warm_start must be a net .*, not "x"'),
        (
            lambda: rs.check(form().popped["pinned"], ROD),
            'popped must be shells by their ends, such as {"pinned": .*, not a PopUp',
        ),
        (lambda: rs.check({"pinned": None}, ROD), "the shell with pinned ends must be what .*, not None"),
        (
            lambda: rs.check({"x": form().popped["pinned"]}, ROD),
            'the ends of popped must be "pinned" or "clamped", not "x"',
        ),
        (
            lambda: rs.check({"pinned": form().popped["pinned"]}, ROD, stages=-1),
            "stages must be a whole number, 0 to 1000, not -1",
        ),
        (
            lambda: rs.check({"pinned": form().popped["pinned"]}, ROD, shear_weight=np.nan),
            "shear_weight must be positive, not nan",
        ),
        (lambda: rs.OutputOptions(stages=1001), "stages must be a whole number, 0 to 1000, not 1001"),
        (lambda: rs.OutputOptions(rod_chosen="section"), 'rod_chosen must be parts of a rod .*, not "section"'),
        (lambda: rs.dynamic_pop_up(None, BOUNDARY, ROD), "footprint must be a rodshell Footprint, not None"),
        (lambda: rs.dynamic_pop_up(FOOTPRINT, None, ROD), "boundary must be a rodshell Boundary, not None"),
        (lambda: rs.dynamic_pop_up(FOOTPRINT, BOUNDARY, ROD, joint="pin"), 'joint must be a .*, not "pin"'),
        (lambda: rs.dynamic_pop_up(FOOTPRINT, BOUNDARY, ROD, joint=(rs.Pin(),)), "joint must be one rodshell joint"),
        (lambda: rs.dynamic_pop_up(FOOTPRINT, BOUNDARY, ROD, settings=3), "settings must be a rodshell Dynamic.*, not"),
        (lambda: rs.pop_up(FOOTPRINT, BOUNDARY, ROD, most_factorizations="9"), "most_factorizations must be a whole"),
        (lambda: rs.Boundary("x", np.zeros((4, 3))), "the boundary's points must be numbers of the shape"),
        (lambda: rs.Boundary(np.zeros((4, 3)), np.zeros((2, 3))), "the boundary's tangents must have the shape"),
        (lambda: rs.Boundary(None, np.zeros((4, 3))), "the boundary's points must be numbers of the shape"),
        (lambda: rs.Footprint(CROSS), "mesh must be a rodshell GridMesh, not a FlatGrid"),
        (lambda: rs.mesh_grid(None, 0.1), "grid must be a rodshell FlatGrid, not None"),
        (lambda: rs.mesh_grid(CROSS, "0.1"), 'edge must be a number in m, not "0.1"'),
        (lambda: rs.mesh_grid(CROSS, -0.1), "edge must be positive, not -0.1 m"),
        (lambda: rs.mesh_grid(CROSS, 0.0), "edge must be positive, not 0.0 m"),
        (lambda: rs.mesh_grid(CROSS, 0.1, marks=[[0.5]]), "2 rods need as many lists of marks, not 1"),
        (lambda: rs.mesh_grid(CROSS, 0.1, marks=[["x"], []]), "marks must be numbers"),
        (lambda: rs.mesh_grid(CROSS, 0.1, marks=[0.5, 0.5]), "marks must be a list for each rod, not 0.5"),
        (lambda: rs.mesh_grid(CROSS, 0.1, marks=[[float("nan")], []]), "marks must be finite"),
        (lambda: rs.straight_rods(np.zeros((1, 2, 2)), names="R"), 'names must be a list of different names, not "R"'),
        (lambda: rs.pop_up_table(CROSS, "x", ROD), "finals must be numbers of the shape"),
        (lambda: rs.pop_up_table(CROSS, np.zeros((2, 2, 3)), ROD, edge="1"), 'edge must be a number in m, not "1"'),
        (lambda: rs.pop_up_table(CROSS, np.zeros((2, 2, 3)), ROD, edge=np.nan), "edge must be positive, not nan m"),
        (lambda: rs.Fabrication(stock_length=np.inf), "the stock length must be positive, not inf m"),
        (lambda: rs.find_form(TARGET, LAYOUT, ROD, time_limit="60"), 'time_limit must be a number in s, not "60"'),
        (lambda: rs.save(form().unchecked(), "x", [], more="x"), 'more must be texts by the names .*, not "x"'),
        (lambda: rs.save(form().unchecked(), "x", [], force="no"), 'force must be True or False, not "no"'),
        (lambda: rs.surface_from("x.obj", unit=1.0, progress=3), "progress must be a function of stage, .*, not 3"),
        (lambda: rs.heights_from("x.csv", size=(1, 1), progress="x"), 'progress must be a function .*, not "x"'),
        (lambda: rs.search(LAYOUT, TARGET, ROD), "target must be a rodshell Target, not a GridLayout"),
        (lambda: rs.search(TARGET, LAYOUT, "rod"), 'rod must be a rodshell Rod, not "rod"'),
        (lambda: rs.search(TARGET, LAYOUT, ROD, anchors=(0.0, 0.0)), "each of the anchors must be two finite numbers"),
        (lambda: rs.search(TARGET, LAYOUT, ROD, anchors=[]), "anchors must be points .*, not an empty list"),
        (lambda: rs.search(TARGET, LAYOUT, ROD, headings=0.3), "headings must be angles in rad, .*, not 0.3"),
        (lambda: rs.Job.load("hemisphere", "layout"), 'overrides must be values by key, .*, not "layout"'),
        (lambda: rs.solve_rod(form()), "rod must be a rodshell ElasticRod, not a Form"),
        (lambda: rs.solve_rod(LINE, rs.RodLoads()), "supports must be a rodshell RodSupports, not a RodLoads"),
        (lambda: rs.solve_rod(LINE, steps="3"), 'steps must be a whole number of 1 or more, not "3"'),
        (lambda: rs.solve_rod(LINE, stable="yes"), 'stable must be True or False, not "yes"'),
        (lambda: rs.GridLayout.orthogonal(spacing=0.1, left_out={"U03": 1}), "must be names of rods, not a dict"),
        (lambda: rs.GridLayout.orthogonal(spacing=0.1, left_out=np.array("U03")), "must be names of rods, not an? nd"),
        (lambda: rs.Job(TARGET, LAYOUT, ROD, rotate=np.array([0.1])), "rotate must be a number in rad, not a"),
        (lambda: rs.find_form(TARGET, LAYOUT, ROD, time_limit=np.True_), "time_limit must be a number in s, not"),
        (lambda: rs.solve_rod(LINE, start="x"), "start must be numbers of the shape"),
        (lambda: rs.RodSupports(positions=[0]), "positions must be a mapping from nodes, .*, not a list"),
        (lambda: rs.RodSupports(spinning="start"), 'spinning must be a list of ends .*, not "start"'),
        (lambda: rs.RodLoads(moments=3.0), "moments must be a mapping from edges or ends .*, not 3.0"),
        (lambda: rs.GravityForce("all"), "the nodes that gravity acts on must be integers"),
        (lambda: rs.PointLoads([0], [1.0, 2.0]), "the forces of point loads must be numbers of the shape"),
        (lambda: rs.ExplicitForce(3), "the force must be a function of time, state and velocity, not 3"),
        (lambda: rs.Archive(None, {}), "results must be a rodshell Results, not None"),
    ],
)
def test_a_value_of_another_kind_is_named_with_what_would_do(call, sentence):
    with pytest.raises(rs.InputError, match=sentence) as caught:
        call()
    assert "\n" not in str(caught.value)


def test_lists_and_arrays_do_in_place_of_tuples():
    assert rs.GridLayout.orthogonal(spacing=0.1, left_out=["U03"]).left_out == ("U03",)
    assert rs.Profile([0.0, 1.0], np.array([1.0, 2.0])) == rs.Profile((0.0, 1.0), (1.0, 2.0))
    assert rs.OutputOptions(rod_chosen=["section"]) == rs.OutputOptions(rod_chosen=("section",))
    line = np.array([[(-1.0, 0.3), (1.0, 0.3)]])
    assert rs.Job(TARGET, rs.GridLayout.orthogonal(spacing=0.06), ROD, seams=line).case.seams.lines
    assert len(rs.trim(form().draped, fewest=np.int64(3)).mesh.grid.rods) == len(form().footprint.rods)
    loads = rs.PointLoads([1], [[0.0, 0.0, 2.0]])
    np.testing.assert_array_equal(loads.held(0.0, None, None, np.ones((2, 3))), [[0, 0, 0], [0, 0, 2]])
    assert not rs.PointLoads([], np.zeros((0, 3))).held(0.0, None, None, np.ones((2, 3))).any()
    weight = rs.GravityForce(np.array([True, False]), (0.0, 0.0, -1.0)).held(0.0, None, None, np.ones((2, 3)))
    np.testing.assert_array_equal(weight, [[0, 0, -1], [0, 0, 0]])


def test_sets_and_generators_do_in_place_of_lists():
    assert rs.FlatGrid.of(rod for rod in CROSS.rods).rods == CROSS.rods
    assert rs.GridLayout.orthogonal(spacing=0.1, left_out={"U03"}).left_out == ("U03",)
    assert rs.Profile.symmetric(factor for factor in (1.0, 2.0)) == rs.Profile.symmetric((1.0, 2.0))
    assert rs.RodSupports(spinning={"start"}).spinning == ("start",)
    assert rs.Settlement((name for name in ["U03.1"]), (0.0, 0.0, -0.1)).supports == ("U03.1",)
    assert rs.LineLoad(iter([(0.0, 0.0), (1.0, 0.0)]), (0.0, 0.0, -1.0)).line == ((0.0, 0.0), (1.0, 0.0))
    marked = rs.mesh_grid(CROSS, 0.5, marks=((mark for mark in [0.3]) for _ in CROSS.rods))
    assert marked.node_count == rs.mesh_grid(CROSS, 0.5, marks=[[0.3], [0.3]]).node_count


def test_points_and_angles_may_be_arrays():
    tried = rs.search(TARGET, LAYOUT, ROD, anchors=np.array([[0.0, 0.01]]), headings=np.array([0.0, 0.5]))
    assert tried == rs.search(TARGET, LAYOUT, ROD, anchors=[(0.0, 0.01)], headings=[0.0, 0.5])
    given = rs.Job(TARGET, LAYOUT, ROD, anchor=np.array([0.0, 0.01]), rotate=np.array(0.1))
    assert given == rs.Job(TARGET, LAYOUT, ROD, anchor=(0.0, 0.01), rotate=0.1)


def test_an_infinite_time_limit_is_none():
    job = rs.Job(TARGET, LAYOUT, ROD)
    assert job.run(time_limit=np.inf, until="drape").status == job.run(until="drape").status == "converged"


def test_numpy_s_truths_are_truths(tmp_path):
    rs.save(form().unchecked(), tmp_path, [], force=np.True_)
    assert rs.solve_rod(LINE, stable=np.bool_(True)).report.converged
    assert rs.fabricate(FOOTPRINT.mesh, ROD, rs.Fabrication(), to_supports=np.False_).cut_length.all()


def test_numpy_s_numbers_are_numbers():
    options = rs.OutputOptions(
        strength=np.float32(1e6), stages=np.int64(4), drawings=rs.DrawingStyle(tolerance=np.float32(1))
    )
    assert options == rs.OutputOptions(strength=1e6, stages=4, drawings=rs.DrawingStyle(tolerance=1.0))
    assert rs.Job(TARGET, LAYOUT, ROD, options=options).case.checks.stages == 4
    changes = {"layout.rods": tuple(np.array([5, 7])), "checks.stages": np.int64(4)}
    assert rs.Job.load("hemisphere", changes) == rs.Job.load("hemisphere", {"layout.rods": (5, 7), "checks.stages": 4})
    given = {"spacing": np.array([0.03, 0.04]), "rods": np.array([5, 7]), "offset": np.array([0.0, 0.01])}
    same = rs.GridLayout.orthogonal(spacing=(0.03, 0.04), rods=(5, 7), offset=(0.0, 0.01))
    assert rs.GridLayout.orthogonal(**given) == same
    assert hash(rs.GridLayout.orthogonal(**given)) == hash(same)


def test_one_end_condition_needs_no_tuple():
    assert list(rs.find_form(TARGET, LAYOUT, ROD, ends="clamped").popped) == ["clamped"]
    assert list(rs.find_form(TARGET, LAYOUT, ROD, ends=("pinned", "pinned")).popped) == ["pinned"]


def test_an_edge_left_out_is_a_sixth_of_the_smaller_spacing():
    assert rs.GridLayout.orthogonal(spacing=(0.06, 0.03)).edge == pytest.approx(0.005, rel=1e-15)
    assert rs.GridLayout.orthogonal(spacing=0.06, edge="auto") == rs.GridLayout.orthogonal(spacing=0.06)


@pytest.mark.slow
def test_a_saved_form_is_read_again(tmp_path):
    form = rs.find_form(TARGET, LAYOUT, ROD, ends=("clamped",))
    saved = rs.read(form.save(tmp_path / "dome"))
    assert isinstance(saved, rs.Archive)
    assert saved.results.plain()["agreement"]["clamped"]["rms"] == form.agreement["clamped"].rms
    np.testing.assert_array_equal(saved.states["popped_clamped"], form.popped["clamped"].positions)
    assert 'kind = "hemisphere"' in saved.case_toml
    with pytest.raises(rs.OutputError):
        rs.read(tmp_path)


# The same mistake in Python, in a case file and as an option


def job(**options):
    return rs.Job(TARGET, LAYOUT, ROD, **options)


MISUSES = {
    "ends": (lambda: job(ends="clampd"), "pop_up.ends", "clampd",
             'must be "pinned", "clamped" or "both", not "clampd": did you mean "clamped"?'),
    "ends of nothing like": (lambda: job(ends="x"), "pop_up.ends", "x",
                             'must be "pinned", "clamped" or "both", not "x"'),
    "objective": (lambda: job(anchor="auto", objective="sheer"), "drape.objective", "sheer",
                  'must be "shear", "curvature" or "gap", not "sheer": did you mean "shear"?'),
    "objective of a search": (lambda: rs.search(TARGET, LAYOUT, ROD, objective="gaps"), "drape.objective", "gaps",
                              'must be "shear", "curvature" or "gap", not "gaps": did you mean "gap"?'),
}  # fmt: skip
"""Python, key, value, and the sentence after the name."""


@pytest.mark.parametrize("name", MISUSES)
def test_a_wrong_choice_is_the_same_sentence_in_python_in_a_file_and_as_an_option(name, tmp_path, capsys):
    call, key, value, words = MISUSES[name]
    with pytest.raises(rs.InputError) as caught:
        call()
    assert str(caught.value) == f"{key.rpartition('.')[2]} {words}"
    said = f"{key} {words}"
    (tmp_path / "case.toml").write_text(f'{key} = "{value}"\n')
    with pytest.raises(rs.InputError) as caught:
        rs.Job.load(tmp_path / "case.toml")
    assert str(caught.value) == said
    for arguments in ([str(tmp_path / "case.toml")], ["hemisphere", f"--{key}", value]):
        assert main(["form", *arguments, "--out", str(tmp_path / "out")]) == 2
        assert capsys.readouterr().err == f"rodshell: error: {said}\n"


ELSEWHERE = {
    "a method": ("drape.method", "bond", lambda: job(method="bond"), METHODS,
                 'must be "bound", "gravity" or "paper", not "bond": did you mean "bound"?'),
    "gravity that points up": ("drape.gravity", "-5", lambda: rs.Gravity(acceleration=-5), "must be positive, not -5",
                               'drape.gravity = "-5": must be larger than zero'),
    "gravity of a method without": ("drape.gravity", "5", lambda: job(method=rs.Bound), "not the class Bound itself",
                                    'method "bound" has no gravity: leave it out, or set drape.method to'),
    "a radius in words": ("target.radius", "two", lambda: rs.Hemisphere(radius="two"), 'in m, not "two"',
                          'target.radius = "two": '),
    "a joint's kind": ("joint.kind", "pinn", lambda: job(joint="pinn"), r'such as rodshell.Pin\(\), not "pinn"',
                       '"pin", "spring", "linker" or "rigid", not "pinn": did you mean "pin"?'),
    "an anchor of one number": ("drape.anchor", "0.1", lambda: job(anchor=0.1), "must be two finite numbers",
                                'drape.anchor = "0.1": needs two values'),
    "a material for a section": ("rod.section.kind", "gfrp", lambda: rs.Rod(ROD.material, ROD.section),
                                 "section must be a circle, .*, not a Material", 'rod.section.kind must be "auto"'),
}  # fmt: skip
"""Key, value, Python, the sentence there, and that of a file and an option."""


@pytest.mark.parametrize("name", ELSEWHERE)
def test_a_wrong_value_is_refused_in_one_sentence_everywhere(name, tmp_path, capsys):
    key, value, call, python, words = ELSEWHERE[name]
    with pytest.raises(rs.InputError, match=python):
        call()
    (tmp_path / "case.toml").write_text(f'{key} = "{value}"\n')
    for arguments in ([str(tmp_path / "case.toml")], ["hemisphere", f"--{key}", value]):
        assert main(["form", *arguments, "--out", str(tmp_path / "out")]) == 2
        said = capsys.readouterr().err
        assert words in said
        assert said.count("\n") == 1


@pytest.mark.parametrize("table", ["joint", "drape"])
def test_a_word_in_place_of_a_table_is_refused(table, tmp_path):
    with pytest.raises(rs.InputError, match=rf'{table} = "pin": must be a table; \[{table}\] has '):
        rs.Job.load(f'{table} = "pin"')


def test_an_option_that_this_case_does_not_have_is_not_proposed(tmp_path, capsys):
    def said(*arguments):
        assert main(["form", *arguments, "--out", str(tmp_path / "out")]) == 2
        return capsys.readouterr().err

    assert "did you mean --target.height?" not in said("hemisphere", "--target.heigth", "1 m")
    assert "unknown option --target.heigth: did you mean --target.height?" in said("paraboloid", "--target.heigth", "1")
    kinds = ("--joint.kind", "pin")
    assert "did you mean --joint.eccentricity?" in said("hemisphere", *kinds, "--joint.eccentricty", "1 mm")
    assert "did you mean --joint.eccentricity?" not in said("hemisphere", "--joint.eccentricty", "1 mm")
