"""Targets too flat for their rods: nothing pops up of them, and that is what is said."""

import numpy as np
import pytest

import rodshell as rs
from rodshell.cli import main
from rodshell.formfinding.finite_sections import is_flat, least_rise, rise
from tests.acceptance.targets_broken import as_obj
from tests.targets.meshes import sheet

ROD = rs.Rod(rs.Circle(0.002), rs.Material(25e9, 1900.0, 0.3))
GRID = rs.GridLayout.orthogonal(spacing=0.06, edge=0.015)


def dome(height: float) -> rs.Target:
    return rs.HeightField(formula=f"{height}*(1 - (x^2 + y^2)/0.04)", domain=rs.Disc(0.2))


def test_the_rise_of_a_cap_is_its_sagitta_wherever_it_stands() -> None:
    polar, angle = np.meshgrid(np.linspace(0, 0.3, 20), np.linspace(0, 2 * np.pi, 41)[:-1])
    cap = np.stack([np.sin(polar) * np.cos(angle), np.sin(polar) * np.sin(angle), np.cos(polar)], axis=-1)
    points = cap.reshape(-1, 3)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    for x in (points, points @ turn.T + [5.0, -3.0, 100.0]):
        assert rise(x) == pytest.approx(1 - np.cos(0.3), rel=1e-9)
    assert rise(np.column_stack([points[:, :2], points[:, :2] @ [0.3, -2.0]]) @ turn.T) < 1e-12


@pytest.mark.parametrize(
    ("rod", "least"),
    [(ROD, 0.002), (rs.Rod(rs.RectangularSection(0.012, 0.05), rs.Material(11e9, 470.0, 0.3)), 0.012 / 3**0.5),
     (rs.Rod(rs.GivenSection(4e6, 9.0, 16.0, 5.0)), 0.003)],
)  # fmt: skip
def test_rods_begin_to_bend_at_twice_their_radius_of_gyration(rod: rs.Rod, least: float) -> None:
    assert least_rise(rod) == pytest.approx(least, rel=1e-9)


@pytest.mark.parametrize(("radii", "flat"), [(1.0, True), (1.8, True), (3.0, False), (4.0, False)])
def test_a_dome_pops_up_where_it_rises_by_more_than_that_and_else_stays_down(radii: float, flat: bool) -> None:
    """Rises in radii of gyration; the pinned shell is found by the pop-up itself."""
    height = radii * 0.001
    form = rs.find_form(dome(height), GRID, ROD, ends=("pinned",))
    popped = float(np.ptp(form.popped["pinned"].positions[:, 2]))
    assert is_flat(form.trimmed.positions, ROD) == flat
    assert (popped < 0.01 * height) if flat else (popped > 0.5 * height)
    assert any(words.startswith("the target is flat, nothing pops up: it rises by") for words in form.warnings) == flat


PLANES = {
    "level": rs.HeightField(formula="0", domain=rs.Disc(0.2)),
    "sloping": rs.HeightField(formula="0.3*x + 0.1*y", domain=rs.Disc(0.2)),
    "a mesh": rs.Freeform.of(*sheet(lambda x, y: 0.2 * x, 0.2, 20)),
    "a mesh in single precision": rs.Freeform.of(*(
        part.astype(np.float32 if part.dtype.kind == "f" else np.intp)
        for part in sheet(lambda x, y: 0.2 * x - 0.123 * y, 0.2, 20)
    )),
}  # fmt: skip


@pytest.mark.parametrize("name", PLANES)
def test_a_plane_is_called_one(name: str) -> None:
    form = rs.find_form(PLANES[name], GRID, ROD, ends=("pinned",))
    assert form.warnings[0] == (
        "the target is flat, nothing pops up: it is a plane, and up to a rise of 2 mm, twice their radius of gyration, "
        "the rods are pressed together and do not bend"
    )


def test_a_flat_target_in_patches_is_flat_too() -> None:
    sewn = rs.find_form(dome(0.001), GRID, ROD, seams=[[(-1.0, 0.0), (1.0, 0.0)]])
    result = sewn.archive().results.plain()
    assert result["target"]["flat"] is True
    assert sewn.warnings[0].startswith("the target is flat, nothing pops up: it rises by 1 mm only")
    assert sum("flat" in words for words in sewn.warnings) == 1


@pytest.mark.slow
def test_the_command_line_ends_with_4_on_a_flat_mesh(tmp_path, capsys) -> None:
    (tmp_path / "floor.obj").write_bytes(as_obj(*sheet(lambda x, y: 0.3 * x, 2.0, 12)))
    out = tmp_path / "out"
    assert main(["form", str(tmp_path / "floor.obj"), "--unit", "m", "--spacing", "500mm", "--out", str(out)]) == 4
    printed = capsys.readouterr()
    assert "floor.obj: Not buildable: the target is flat, nothing pops up" in printed.out
    archive = rs.read(out)
    assert archive.results.plain()["target"]["flat"] is True
    assert archive.verdict.level == "unbuildable"
    assert "the target is flat, nothing pops up" in (out / "report.html").read_text()
    assert "flat" not in rs.find_form(dome(0.1), GRID, ROD).archive().results.plain()["target"]
