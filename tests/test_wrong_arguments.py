"""Arguments of the wrong kind are refused in one sentence each; and what was saved is read again."""

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
        (lambda: rs.find_form(TARGET, ROD, LAYOUT), "layout must be a rodshell GridLayout, not a Rod"),
        (lambda: rs.find_form(TARGET, LAYOUT, ROD.section), "rod must be a rodshell Rod, not a Circle"),
        (
            lambda: rs.find_form("dome", LAYOUT, ROD, seams=[[(-1, 0), (1, 0)]]),
            'target must be a rodshell Target, not "dome"',
        ),
        (lambda: rs.Job(TARGET, LAYOUT), "a job needs target, layout and rod; for a case"),
        (lambda: rs.Job("hemisphere", LAYOUT, ROD), 'target must be a rodshell Target, not "hemisphere"'),
        (lambda: rs.drape(TARGET, LAYOUT, ROD), "layout must be a rodshell GridLayout, not a Hemisphere"),
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
        (lambda: rs.find_form(TARGET, LAYOUT, ROD, method="bound"), f"{METHODS}, not 'bound'"),
        (lambda: rs.drape(LAYOUT, ROD, TARGET, method="gravity"), f"{METHODS}, not 'gravity'"),
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
        (lambda: rs.Fall(every=0), "every must be a number of steps, 1 or more, not 0"),
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


@pytest.mark.parametrize("table", ["rod.section", "joint", "rod", "drape"])
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
