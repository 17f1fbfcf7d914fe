"""What is shown while a form is being found is what is shown of it afterwards."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rodshell as rs
from rodshell.output.grid import rods_of
from rodshell.output.viewer import scene_of
from rodshell.studio.preview import Preview, checked
from tests.acceptance.targets_broken import as_obj, dome

DOME: dict[str, Any] = {
    "target": {"kind": "hemisphere"},
    "layout": {"spacing": "50 mm", "edge": "25 mm"},
    "rod": {"section": {"radius": "1 mm"}, "material": {"youngs_modulus": "1 MPa"}},
    "checks": {"stages": 0},
}
LATHS = {
    **DOME,
    "rod": {
        "section": {"kind": "rectangle", "width": "4 mm", "height": "2 mm"},
        "material": {"youngs_modulus": "1 MPa"},
    },
    "joint": {"kind": "pin", "eccentricity": "2 mm"},
    "fabrication": {"end_allowance": "20 mm"},
}
PATCHES = {**DOME, "seams": {"lines": [[[-1, 0.02], [1, 0.02]]]}}
TYPES = {"u1": np.uint8, "i1": np.int8, "u2": np.uint16, "u4": np.uint32}


def read(content: bytes) -> tuple[dict[str, Any], Any]:
    """The header of a scene, and what gives its arrays."""
    length = int.from_bytes(content[:4], "little")

    def array(of: dict[str, Any]) -> np.ndarray:
        return np.frombuffer(content, TYPES[of["type"]], of["count"], 4 + length + of["at"])

    return json.loads(content[4 : 4 + length]), array


@pytest.mark.slow
@pytest.mark.parametrize("case", [DOME, LATHS, PATCHES], ids=["dome", "laths", "patches"])
@pytest.mark.parametrize("until", ["drape", "pop-up"])
def test_a_preview_shows_what_the_archive_shows(case: dict[str, Any], until: Any) -> None:
    form = rs.Job.load(case).run(until=until)
    _, content = Preview().of(form)
    kept = scene_of(form.unchecked())
    assert kept is not None
    (ours, our_array), (theirs, their_array) = read(content), read(kept.content())
    for name in ("name", "rods", "families", "kinds", "palettes", "outline", "size", "low", "box"):
        assert ours[name] == theirs[name]
    assert [stage["name"] for stage in ours["stages"]] == [stage["name"] for stage in theirs["stages"]]
    for one, other in zip(ours["stages"], theirs["stages"], strict=True):
        np.testing.assert_array_equal(our_array(one["points"]), their_array(other["points"]))
        assert one["colours"].keys() == other["colours"].keys()
        for kind, colour in one["colours"].items():
            for part in ("caption", "ticks", "worst"):
                assert colour[part] == other["colours"][kind][part]
            np.testing.assert_array_equal(our_array(colour["bins"]), their_array(other["colours"][kind]["bins"]))
    for name in ("points", "faces"):
        np.testing.assert_array_equal(our_array(ours["target"][name]), their_array(theirs["target"][name]))
    met, known = (
        dict(zip(scene["joints"]["ids"], array(scene["joints"]["entries"]).reshape(-1, 2).tolist(), strict=True))
        for scene, array in ((ours, our_array), (theirs, their_array))
    )
    assert met == known
    assert len(met) > 10


@pytest.mark.slow
def test_a_target_far_from_the_origin_is_shown_as_large_as_one_at_it(tmp_path: Path) -> None:
    (tmp_path / "roof.obj").write_bytes(as_obj(*dome()))
    target = {"kind": "mesh", "file": str(tmp_path / "roof.obj"), "unit": "m"}
    sizes = []
    for move in ([0.0, 0.0, 0.0], [50.0, 20.0, 3.0]):
        form = rs.Job.load({"target": {**target, "move": move}, "layout": {"spacing": 2.0}}).run(until="drape")
        kept = scene_of(form.unchecked())
        assert kept is not None
        for content in (Preview().of(form)[1], kept.content()):
            header, array = read(content)
            sizes.append(header["size"])
            (flat,) = (stage for stage in header["stages"] if stage["name"] == "flat")
            lying = array(flat["points"]).reshape(-1, 3) / 65535 * header["size"] + header["low"]
            np.testing.assert_allclose(lying[:, :2].mean(axis=0), move[:2], atol=0.1)  # as even as the grid is
    assert sizes == pytest.approx([sizes[0]] * 4, rel=1e-3)  # the smooth function of a mesh depends on where it lies


@pytest.mark.slow
def test_the_plan_has_the_cut_lengths_that_the_schedule_has() -> None:
    job = rs.Job.load(LATHS)
    form = job.run()
    before, (after, _) = Preview().of(job.run(until="drape"))[0], checked(form, job)
    lengths = {rod.id: rod.cut_length for rod in rods_of(form.archive())}
    for facts in (before, after):
        assert {rod["id"]: rod["length"] for rod in facts["plan"]} == pytest.approx(lengths, rel=1e-12)
    assert dict(before["figures"]).items() <= dict(after["figures"]).items()


def test_figures_name_section_and_material_as_the_trade_does_and_all_lengths_in_mm() -> None:
    rod = {"section": "tube 3x0.5", "material": {"preset": "gfrp"}}
    job = rs.Job.load({**DOME, "rod": rod, "pop_up": {"ends": "clamped"}})
    form = job.run()
    live, (facts, _) = dict(Preview().of(form)[0]["figures"]), checked(form, job)
    figures, lengths = dict(facts["figures"]), [rod["length"] for rod in facts["plan"]]
    assert (live["section"], live["material"]) == ("tube 3 x 0.5 mm", "gfrp")
    assert live.items() <= figures.items()
    for name, metres in (("all rods together", sum(lengths)), ("longest rod", max(lengths))):
        number, unit = figures[name].split()
        assert unit == "mm"
        assert float(number) == pytest.approx(1e3 * metres, rel=1e-3)
    mass, unit = figures["mass"].split()
    assert unit == "kg"
    assert float(mass) == pytest.approx(np.pi * 2.5e-3 * 0.5e-3 * 1850.0 * sum(lengths), rel=5e-3)  # three digits


@pytest.mark.slow
def test_the_whole_target_is_shown_whatever_the_shell_covers() -> None:
    show = Preview()

    def cross(turned: str, radius: float = 0.6) -> dict[str, Any]:
        layout = {"rods": [5, 5], "spacing": "40 mm", "edge": "20 mm", "rotate": turned}
        return {**DOME, "target": {"kind": "hemisphere", "radius": radius}, "layout": layout}

    def width(form: rs.Form) -> tuple[float, float]:
        """Of the target as it is shown, and of the shell."""
        header, array = read(show.of(form)[1])
        points = array(header["target"]["points"]).reshape(-1, 3) / 65535 * header["size"]
        return float(np.ptp(points[:, 0])), float(np.ptp(form.trimmed.positions[:, 0]))

    narrow = rs.Job.load(cross("45 deg")).run(until="drape")
    wide = rs.Job.load(cross("0 deg")).run(until="drape", warm_start=narrow)
    other = rs.Job.load(cross("0 deg", 0.5)).run(until="drape")
    assert wide.target is narrow.target
    for form, radius in ((narrow, 0.6), (wide, 0.6), (narrow, 0.6), (other, 0.5)):
        shown, shell = width(form)
        assert shell < shown == pytest.approx(2 * radius, rel=1e-3)
