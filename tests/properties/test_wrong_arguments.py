"""Arguments of the wrong kind are refused in one sentence each; and what was saved is read again."""

import numpy as np
import pytest

import rodshell as rs

TARGET = rs.Hemisphere(radius=0.2)
METHODS = r"method must be rodshell.Bound\(\), rodshell.Gravity\(\) or rodshell.Fall\(\)"
LAYOUT = rs.GridLayout.orthogonal(rods=(5, 5), spacing=0.06, length=1.0)
ROD = rs.Rod(rs.Circle(radius=1e-3), rs.Material(youngs_modulus=1e6, density=1e3))


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: rs.find_form(TARGET, LAYOUT, ROD, start="x"), 'start must be a form that an earlier .*, not "x"'),
        (lambda: rs.find_form(TARGET, LAYOUT, ROD, start=LAYOUT), "start must be a form .*, not a GridLayout"),
        (lambda: rs.find_form(LAYOUT, TARGET, ROD), "target must be a rodshell Target, not a GridLayout"),
        (lambda: rs.find_form(TARGET, ROD, LAYOUT), "layout must be a rodshell GridLayout, not a Rod"),
        (lambda: rs.find_form(TARGET, LAYOUT, ROD.section), "rod must be a rodshell Rod, not a Circle"),
        (lambda: rs.sew("dome", [[(-1, 0), (1, 0)]], LAYOUT, ROD), 'target must be a rodshell Target, not "dome"'),
        (lambda: rs.drape(TARGET, LAYOUT, ROD), "layout must be a rodshell GridLayout, not a Hemisphere"),
        (lambda: rs.drape(LAYOUT, ROD, 3.0), "target must be a rodshell Target, not 3.0"),
        (lambda: rs.drape(LAYOUT, ROD, TARGET, warm_start="x"), 'warm_start must be what .* rodshell.drape .*"x"'),
        (lambda: rs.drape(LAYOUT, ROD, TARGET, anchor="0,0"), "anchor must be two finite numbers x, y in m, not '0,0'"),
        (lambda: rs.drape(LAYOUT, ROD, TARGET, anchor=(0.0, np.nan)), "anchor must be two finite numbers"),
        (lambda: rs.drape(LAYOUT, ROD, TARGET, anchor=0.1), "anchor must be two finite numbers x, y in m, not 0.1"),
        (
            lambda: rs.find_form(TARGET, LAYOUT, ROD, ends="clampd"),
            'ends must be "pinned" or "clamped", not "clampd": did you mean "clamped"?',
        ),
        (
            lambda: rs.find_form(TARGET, LAYOUT, ROD, ends=("pinned", "x")),
            'ends must be "pinned" or "clamped", not "x"',
        ),
        (lambda: rs.find_form(TARGET, LAYOUT, ROD, ends=1), 'one or several of "pinned", "clamped", not 1'),
        (lambda: rs.find_form(TARGET, LAYOUT, ROD, method="bound"), f"{METHODS}, not 'bound'"),
        (lambda: rs.drape(LAYOUT, ROD, TARGET, method="gravity"), f"{METHODS}, not 'gravity'"),
        (lambda: rs.drape(LAYOUT, ROD, TARGET, method=None), f"{METHODS}, not None"),
        (lambda: rs.drape(LAYOUT, ROD, TARGET, method=rs.Fall), f"{METHODS}, not the class Fall itself"),
        (lambda: rs.Gravity(acceleration=-5.0), "acceleration of gravity must be positive, not -5.0 m/s2"),
        (lambda: rs.Fall(acceleration="9.81"), 'acceleration of gravity must be a number in m/s2, not "9.81"'),
        (lambda: rs.Fall(friction=-0.1), r"the fall's friction must not be negative, not -0.1 \[-\]"),
        (lambda: rs.Fall(drag=np.nan), "the fall's drag must be finite, not nan 1/s"),
        (lambda: rs.Fall(coupling="implicit"), r"coupling must be rodshell.SharedDofs\(\), .*, not \"implicit\""),
        (lambda: rs.Fall(coupling=rs.ImplicitPenalty), r"coupling must be rodshell.SharedDofs\(\), .*, not a type"),
        (lambda: rs.Fall(stopped="partly"), 'stopped must be "wholly" or "along the normal", not "partly"'),
        (lambda: rs.Fall(every=0), "every must be a number of steps, 1 or more, not 0"),
        (lambda: rs.Fall(stream=3), "stream must be the path of a folder, not 3"),
        (lambda: rs.Fall(settle="no"), 'settle must be True or False, not "no"'),
        (
            lambda: rs.drape(LAYOUT, ROD, TARGET, joint=(rs.Pin(),)),
            "joint must be one rodshell .*, not a sequence",
        ),
        (lambda: rs.find_form(TARGET, LAYOUT, ROD, joint="pin"), r"such as rodshell.Pin\(\), not 'pin'"),
        (lambda: rs.find_form(TARGET, LAYOUT, ROD, joint=rs.Pin), "not the class Pin itself"),
        (lambda: rs.pop_up(None, None, ROD, ends="clampd"), 'ends must be "pinned" or "clamped", not "clampd"'),
        (lambda: rs.pop_up(None, None, ROD, start="drapped"), 'not "drapped": did you mean "draped"?'),
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


def test_one_end_condition_needs_no_tuple():
    assert list(rs.find_form(TARGET, LAYOUT, ROD, ends="clamped").popped) == ["clamped"]
    assert list(rs.find_form(TARGET, LAYOUT, ROD, ends=("pinned", "pinned")).popped) == ["pinned"]


def test_an_edge_left_out_is_a_sixth_of_the_smaller_spacing():
    assert rs.GridLayout.orthogonal(spacing=(0.06, 0.03)).edge == pytest.approx(0.005, rel=1e-15)
    assert rs.GridLayout.orthogonal(spacing=0.06, edge="auto") == rs.GridLayout.orthogonal(spacing=0.06)


def test_a_saved_form_is_read_again(tmp_path):
    form = rs.find_form(TARGET, LAYOUT, ROD, ends=("clamped",))
    saved = rs.read(form.save(tmp_path / "dome"))
    assert isinstance(saved, rs.Archive)
    assert saved.results.plain()["agreement"]["clamped"]["rms"] == form.agreement["clamped"].rms
    np.testing.assert_array_equal(saved.states["popped_clamped"], form.popped["clamped"].positions)
    assert 'kind = "hemisphere"' in saved.case_toml
    with pytest.raises(rs.OutputError):
        rs.read(tmp_path)
