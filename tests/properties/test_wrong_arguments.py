"""Arguments of the wrong kind are refused in one sentence each; and what was saved is read again."""

import numpy as np
import pytest

import gridshell as gs

TARGET = gs.Hemisphere(radius=0.2)
LAYOUT = gs.GridLayout.orthogonal(rods=(5, 5), spacing=0.06, length=1.0)
ROD = gs.Rod(gs.Circle(radius=1e-3), gs.Material(youngs_modulus=1e6, density=1e3))


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: gs.find_form(TARGET, LAYOUT, ROD, start="x"), 'start must be a form that an earlier .*, not "x"'),
        (lambda: gs.find_form(TARGET, LAYOUT, ROD, start=LAYOUT), "start must be a form .*, not a GridLayout"),
        (lambda: gs.find_form(LAYOUT, TARGET, ROD), "target must be a gridshell Target, not a GridLayout"),
        (lambda: gs.find_form(TARGET, ROD, LAYOUT), "layout must be a gridshell GridLayout, not a Rod"),
        (lambda: gs.find_form(TARGET, LAYOUT, ROD.section), "rod must be a gridshell Rod, not a Circle"),
        (lambda: gs.sew("dome", [[(-1, 0), (1, 0)]], LAYOUT, ROD), 'target must be a gridshell Target, not "dome"'),
        (lambda: gs.drape(TARGET, LAYOUT, ROD), "layout must be a gridshell GridLayout, not a Hemisphere"),
        (lambda: gs.drape(LAYOUT, ROD, 3.0), "target must be a gridshell Target, not 3.0"),
        (lambda: gs.drape(LAYOUT, ROD, TARGET, start="x"), 'start must be what an earlier gridshell.drape .*, not "x"'),
        (lambda: gs.drape(LAYOUT, ROD, TARGET, anchor="0,0"), "anchor must be two finite numbers x, y in m, not '0,0'"),
        (lambda: gs.drape(LAYOUT, ROD, TARGET, anchor=(0.0, np.nan)), "anchor must be two finite numbers"),
        (lambda: gs.drape(LAYOUT, ROD, TARGET, anchor=0.1), "anchor must be two finite numbers x, y in m, not 0.1"),
        (
            lambda: gs.drape(LAYOUT, ROD, TARGET, anchor=(1, 1)),
            r"no point over \(1, 1\) m: choose .* \(--anchor auto\)",
        ),
    ],
)
def test_a_wrong_argument_is_refused_in_one_sentence(call, sentence):
    with pytest.raises(gs.InputError, match=sentence):
        call()


def test_an_edge_left_out_is_a_sixth_of_the_smaller_spacing():
    assert gs.GridLayout.orthogonal(spacing=(0.06, 0.03)).edge == pytest.approx(0.005, rel=1e-15)
    assert gs.GridLayout.orthogonal(spacing=0.06, edge="auto") == gs.GridLayout.orthogonal(spacing=0.06)


def test_a_saved_form_is_read_again(tmp_path):
    form = gs.find_form(TARGET, LAYOUT, ROD, ends=("clamped",))
    saved = gs.read(form.save(tmp_path / "dome"))
    assert isinstance(saved, gs.Archive)
    assert saved.result["agreement"]["clamped"]["rms"] == form.agreement["clamped"].rms
    np.testing.assert_array_equal(saved.states["popped_clamped"], form.popped["clamped"].positions)
    assert 'kind = "hemisphere"' in saved.case_toml
    with pytest.raises(gs.OutputError):
        gs.read(tmp_path)
