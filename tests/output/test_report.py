"""The report: what a reader meets first, that it needs nothing else, and that it works in a browser."""

import json
import re
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pypdfium2 import PdfDocument

import rodshell as rs
from rodshell.checks.deployment import Deployment
from rodshell.figures.checks import Bending, WorstBent
from rodshell.figures.form import Layout, Material, Target
from rodshell.output.colour_scale import ABOVE
from rodshell.output.drawings import drawing_set
from rodshell.output.drawings.flat import flat_plan
from rodshell.output.files import export
from rodshell.output.grid import caption_of
from rodshell.output.report import IN_PAGE, checks_table, key_figures, size_text
from rodshell.output.viewer import Scene, scene_of
from rodshell.results import Archive, Results, wording
from rodshell.results.archive import shown_case
from rodshell.results.facts import facts
from rodshell.results.from_form import rod_type
from rodshell.results.states import shells_among
from rodshell.results.wording import Rounding
from tests.acceptance.cases import ROD
from tests.output.browser import CHROMIUM, SCALE, coloured, needs_browser, open_report, wrong_legends
from tests.output.forms import TARGETS, archive, breaking, wished
from tests.output.sample_archive import sample_archive, table_archive, with_deployment


def page_of(made: object, folder: Path) -> Path:
    export(made, folder, ["report"])  # type: ignore[arg-type]
    return folder / "report.html"


def read(scene: Scene | None) -> tuple[dict[str, Any], Callable[[dict[str, Any]], np.ndarray]]:
    """The header of a scene, read from its bytes as a page does, and what reads an array."""
    assert scene is not None
    content = scene.content()
    length = int.from_bytes(content[:4], "little")
    data = content[4 + length :]

    def array(part: dict[str, Any]) -> np.ndarray:
        return np.frombuffer(data, dtype=np.dtype(f"<{part['type']}"), count=part["count"], offset=part["at"])

    return json.loads(content[4 : 4 + length]), array


def test_the_head_has_plan_rise_mass_section_and_supports(tmp_path: Path) -> None:
    """A hemisphere of 0.2 m, of rods of 2 mm at 1000 kg/m3."""
    made = archive("dome")
    head = page_of(made, tmp_path).read_text(encoding="utf-8").partition("</header>")[0].partition("<header>")[2]
    metres = sum(rod.length or 0.0 for rod in made.results.rods)
    mass = wording.rounded(1000 * np.pi * 0.001**2 * metres)
    line = f"0.4 x 0.4 m in plan, rise 0.2 m, {mass} kg, rod 2 mm, clamped ends (directions held)"
    assert f"<p>{line}</p>" in head
    assert "not given" not in size_text(table_archive())  # without a section


REPORTS = {**{name: lambda name=name: archive(name) for name in TARGETS}, "table": table_archive, "breaking": breaking}


@pytest.mark.slow
@needs_browser
@pytest.mark.parametrize("name", REPORTS)
def test_in_a_browser_the_slider_moves_the_table_sorts_and_the_console_is_silent(name: str, tmp_path: Path) -> None:
    made = REPORTS[name]()
    found, console = open_report(page_of(made, tmp_path), tmp_path)
    assert console == []
    pictures = [picture for _, picture in found["stages"]]
    captions = [caption for caption, _ in found["stages"]]
    assert len(set(captions)) == len(captions) == {"table": 2, "breaking": 7}.get(name, 11)
    assert len(set(pictures)) == len(pictures)  # every stage looks different
    assert captions[name != "table"] == "Flat, as cut and laid out"
    assert len(found["legends"]) == 2 * len(found["kinds"]) * len(captions)
    assert wrong_legends(made, found) == []
    if name != "table":
        assert found["stress"] == pictures[-1] != found["gap"]
    assert found["turned"] != found["stress"]
    assert found["over"] == []  # at 1300 and 420 px no cell runs out of its column
    lengths = [float(value) for value in found["up"]]
    assert lengths == sorted(lengths)
    assert [float(value) for value in found["down"]] == lengths[::-1]
    assert len(set(lengths)) > 2


@pytest.mark.slow
@needs_browser
def test_printed_each_shape_and_each_drawing_has_a_page_with_its_name(tmp_path: Path) -> None:
    made = wished()
    out = tmp_path / "report.pdf"
    flags = ["--headless", "--no-sandbox", "--disable-gpu", "--no-pdf-header-footer", "--virtual-time-budget=3000"]
    page = page_of(made, tmp_path)
    subprocess.run([str(CHROMIUM), *flags, f"--print-to-pdf={out}", page.as_uri()], check=True, capture_output=True)
    pages = [" ".join(sheet.get_textpage().get_text_range().split()) for sheet in PdfDocument(out)]
    names = [caption_of(made, state) for state in ("flat", *shells_among(made.states))]
    names += [drawing_set(made)[name].title for name in IN_PAGE]
    heads = [page.removeprefix("The shell ").removeprefix("Other drawings ") for page in pages]
    shown = [[name for name in names if head.startswith(name)] for head in heads]
    assert sorted(name for some in shown for name in some) == sorted(names)
    assert max(map(len, shown)) == 1


def test_solver_s_figures_stand_in_an_appendix_at_the_end(tmp_path: Path) -> None:
    before, _, appendix = page_of(wished(), tmp_path).read_text(encoding="utf-8").rpartition("<h2>Appendix")
    assert appendix.count("<h2>") == 0
    for word in ("Iterations", "Factorisations", "Force residual", "Degrees of freedom", "Levels of the drape"):
        assert f">{word}<" in appendix
        assert word.lower() not in re.sub("<style>.*?</style>|<script.*?</script>", "", before, flags=re.DOTALL).lower()


BROKEN = """() => [...document.querySelectorAll("th, td, h1, h2, h3, strong")].flatMap(cell => {
  const walker = document.createTreeWalker(cell, NodeFilter.SHOW_TEXT), broken = [], range = document.createRange();
  let node;
  while ((node = walker.nextNode())) for (const word of node.data.matchAll(/[\\w.%/]+/g)) {
    range.setStart(node, word.index);
    range.setEnd(node, word.index + word[0].length);
    if (new Set([...range.getClientRects()].map(({ top }) => top)).size > 1) broken.push(word[0]);
  }
  return broken;
})"""
"""Words of headings and tables that stand on two lines."""
UNIT_ALONE = """() => [...document.querySelectorAll("td")].filter(cell => {
  const range = document.createRange();
  range.selectNodeContents(cell);
  const lines = new Set([...range.getClientRects()].map(({ top }) => top)).size;
  return lines > 1 && /^[\\d.e\u2212+-]+ \\S{1,4}$/.test(cell.innerText.trim());
}).map(cell => cell.innerText)"""
"""Figures whose unit stands on the next line."""


@pytest.mark.slow
@needs_browser
def test_on_a_phone_words_are_whole_units_are_beside_their_numbers_and_loads_need_no_scrolling(tmp_path: Path) -> None:
    from tests.acceptance.studio_browser import browser_page, errors
    from tests.output.test_loads_page import archive as loaded

    said: list[str] = []
    made = {"dome": archive("dome"), "breaking": breaking(), "loaded": loaded()}
    with browser_page(said, SCALE) as page:
        for name, found in made.items():
            address = page_of(found, tmp_path / name).as_uri()
            for width in (360, 420, 1300):
                page.set_viewport_size({"width": width, "height": 800})
                page.goto(address)
                assert page.evaluate(BROKEN) == []
                assert page.evaluate(UNIT_ALONE) == []
                assert page.evaluate("document.documentElement.scrollWidth") <= width
                tables = page.locator(".loads .wide")
                assert tables.count() == (5 if name == "loaded" else 0)
                for table in tables.all():
                    assert table.evaluate("part => part.scrollWidth - part.clientWidth") <= 0
    assert errors(said) == []


def test_colours_of_the_view_mean_what_stands_at_their_own_bar() -> None:
    made = breaking()
    header, array = read(scene_of(made))
    units = {"stress": made.results.plain()["bending"]["strength"] / 100, "gap": 1e-3, "curvature": 1.0}
    for kind, factor in units.items():
        for stage, shown in zip(header["stages"], coloured(made)[kind], strict=True):
            assert (kind in stage["colours"]) == (shown is not None)
            if shown is None:
                continue
            colours = stage["colours"][kind]
            assert colours["worst"]["text"].split()[-1] == {"stress": "%", "gap": "mm", "curvature": "1/m"}[kind]
            (share, least), *_, (stop, most) = [(at, float(text)) for at, text in colours["ticks"]]
            last = len(header["palettes"][kind]) - 1
            above = array(colours["bins"]) == last if header["palettes"][kind][-1] == ABOVE else np.False_
            step = (
                (most - least) / (stop - share) / (last - (kind == "stress"))
            )  # whose last colour is that above 100 %
            values = least - share * (most - least) / (stop - share) + step * array(colours["bins"])
            within = np.broadcast_to(~above, values.shape)
            np.testing.assert_allclose(values[within], shown[within] / factor, atol=0.51 * step)
            assert np.all(shown[~within] > 100 * factor)


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page of 60 by 60 rods with a way up."""
    return page_of(with_deployment(sample_archive(60, 6)), tmp_path_factory.mktemp("large"))


@pytest.mark.slow
@needs_browser
def test_a_60_by_60_grid_is_usable_in_a_browser(large: Path, tmp_path: Path) -> None:
    found, console = open_report(large, tmp_path, legends=False)
    assert console == []
    assert len({picture for _, picture in found["stages"]}) == 11


def test_stages_of_the_view_are_the_archive_s_shapes() -> None:
    """Decoded again: every stage is a shape of the archive to 16 bits, and there are no others."""
    made = archive("dome")
    header, array = read(scene_of(made))
    nodes, states = made.states["rod_nodes"], made.states
    shapes = [states["draped"], *states["history"][:-1], states["popped_pinned"], states["popped_clamped"]]
    cloud = np.concatenate([*(shape[nodes] for shape in shapes), states["target_points"]])
    low, size = cloud.min(axis=0), np.ptp(cloud, axis=0).max()
    assert sum(rod["count"] for rod in header["rods"]) == len(nodes)
    assert len(header["stages"]) == len(shapes)
    for stage, shape in zip(header["stages"], shapes, strict=True):
        points = array(stage["points"]).reshape(-1, 3)
        np.testing.assert_allclose(low + points / 65535 * size, shape[nodes], atol=size / 65535)
        assert ("gap" in stage["colours"]) == (stage["name"].startswith("popped") or stage["name"] == "draped")
        assert ("stress" in stage["colours"]) == (stage["name"] not in ("flat", "draped"))
    points = array(header["target"]["points"]).reshape(-1, 3)
    gaps = rs.Hemisphere(0.2).gap(low + points / 65535 * size).distance
    assert np.abs(gaps).max() < 1e-4


def test_joints_and_supports_of_the_view_lie_where_the_schedules_say() -> None:
    made = archive("dome")
    header, array = read(scene_of(made))
    last = header["stages"][-1]
    points = array(last["points"]).reshape(-1, 3) / 65535
    pairs = array(header["joints"]["entries"]).reshape(-1, 2)
    np.testing.assert_allclose(points[pairs[:, 0]], points[pairs[:, 1]], atol=2 / 65535)
    assert header["joints"]["ids"] == list(header["rows"]["joint"]["rows"])
    assert [rod["id"] for rod in header["rods"]] == list(header["rows"]["rod"]["rows"])
    ends = array(header["supports"]["entries"])
    boundary = np.array(made.results.plain()["boundary"]) / header["size"]
    offset = points[ends] - boundary
    np.testing.assert_allclose(offset, np.tile(offset[0], (len(ends), 1)), atol=2 / 65535)
    forces = array(header["supports"]["reactions"]["popped_pinned"]["forces"]).reshape(-1, 3)
    assert np.linalg.norm(forces, axis=1).max() == pytest.approx(1, rel=1e-6)
    np.testing.assert_allclose(forces.sum(axis=0), 0, atol=1e-4)


def test_a_stage_of_eight_thousand_segments_is_small() -> None:
    made = with_deployment(sample_archive(60, 6))
    header, _ = read(scene_of(made))
    entries = sum(rod["count"] for rod in header["rods"])
    for stage in header["stages"]:
        arrays = [stage["points"], *([stage["normals"]] if "normals" in stage else [])]
        arrays += [colours["bins"] for colours in stage["colours"].values()]
        size = sum(part["count"] * int(part["type"][1:]) for part in arrays)
        assert size * 8000 / entries < 200e3


def test_without_a_deployment_the_view_says_that_nothing_is_known_between(tmp_path: Path) -> None:
    made = sample_archive()
    page = page_of(made, tmp_path).read_text()
    assert "The deployment from flat was not followed: the shapes in between are not known." in page
    names = [stage["name"] for stage in read(scene_of(made))[0]["stages"]]
    assert names == ["draped", "flat", "popped_pinned", "popped_clamped"]  # and nothing made up


def test_names_in_the_view_cannot_end_its_script(tmp_path: Path) -> None:
    made = table_archive()
    rods = tuple(rod.changed(id="</script>") for rod in made.results.rods)
    page = page_of(replace(made, results=made.results.changed(rods=rods)), tmp_path).read_text()
    assert page.count("</script>") == page.count("<script")


@pytest.mark.slow
@pytest.mark.parametrize("level", ["good", "check", "unbuildable", "unknown"])
def test_the_verdict_comes_first_with_its_colour_and_all_reasons(level: str, tmp_path: Path) -> None:
    made = archive("dome")
    reasons = ["the <first> reason", "the second"]
    result = {**made.results.plain(), "verdict": {"level": level, "reasons": reasons}}
    page = page_of(replace(made, results=Results.of(result)), tmp_path).read_text()
    words = {"good": "Good", "check": "Check", "unbuildable": "Not buildable", "unknown": "Not known"}
    notice = f'<section class="notice {level}" aria-label="Verdict">'
    places = [page.index(text) for text in (notice, f"{words[level]}: the &lt;first&gt; reason", "the second", "<h2>")]
    assert places == sorted(places)
    assert f".{level} {{ --tone: var(--{level}); }}" in page
    text = replace(made, results=Results.of(result)).summary(verbose=True)
    assert text.startswith(f"{made.name}: {words[level]}: the <first> reason\n")


def test_warnings_are_reasons_and_stand_once(tmp_path: Path) -> None:
    made = archive("dome")
    flat = {"share": np.zeros(1), "positions": np.zeros((1, 1, 3))}
    way = Deployment(**flat, snaps=((0.14, 0.15),), snapped_by=(0.03,), reached_from_flat=True)
    (words,) = way.warnings
    result = {key: value for key, value in made.results.plain().items() if key != "verdict"} | {"warnings": [words]}
    page = page_of(replace(made, results=Results.of(result)), tmp_path).read_text()
    assert page.count(words) == 1
    assert page.index(words) < page.index("<h2>")


def test_checks_are_in_words_and_numbers(tmp_path: Path) -> None:
    made = wished()
    page = page_of(made, tmp_path).read_text()
    share = made.results.plain()["bending"]["pinned"]["utilisation"]
    assert 0.1 < share < 1
    assert f"{100 * share:.2g} %" in page
    assert "Sum of all forces over the largest" in page
    assert read(scene_of(made))[0]["kinds"]["stress"] == "utilisation"
    assert re.search(r"<h2>Cutting list</h2>", page)
    assert "cut = &#34;LASER&#34;" in page


@pytest.mark.slow
def test_report_of_60_by_60_rods_with_its_way_up_stays_below_15_megabytes(large: Path, tmp_path: Path) -> None:
    assert large.stat().st_size < 15e6
    assert page_of(archive("dome"), tmp_path).stat().st_size < 5e6


def with_stages(strength_used: float | None, lost: float | None, snaps: list[list[float]]) -> Archive:
    """The dome with a deployment whose stages below `lost` are missing."""
    made = archive("dome")
    bent = {key: dict(entry) for key, entry in made.results.plain()["bending"].items() if isinstance(entry, dict)}
    for entry in bent.values():
        entry["utilisation"] = strength_used
    whole = made.results.plain()["deployment"]
    kept = [k for k, stage in enumerate(whole["stages"]) if stage["share"] == 0 or stage["share"] >= (lost or 0.0)]
    way = {**whole, "stages": [whole["stages"][k] for k in kept], "lost_at": lost, "snaps": snaps}
    states = {name: rows[kept] if name.startswith("history") else rows for name, rows in made.states.items()}
    return replace(
        made, results=Results.of({**made.results.plain(), "bending": bent, "deployment": way}), states=states
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lost", "snaps", "words", "note", "head"),
    [(None, [], "deployment included.", "Every stage of the deployment is an equilibrium", "deployment"),
     (None, [[0.14, 0.25]], "the stress during a snap is not known.", "Every stage", "deployment"),
     (0.5625, [], "above 56 % of the deployment; below that share the stress is not known.", "Below 56 %",
      "deployment above 56 %"),
     (1.0, [], "for the deployment, which could not be followed, the stress is not known.",
      "The deployment from flat was not followed", None)],
)  # fmt: skip
def test_no_more_is_said_of_the_deployment_than_was_followed(
    lost: float | None, snaps: list[list[float]], words: str, note: str, head: str | None, tmp_path: Path
) -> None:
    made = with_stages(0.32, lost, snaps)
    (said,) = [sentence for sentence in facts(made.results) if "of their strength" in sentence]
    assert said.startswith("Unloaded, the rods use 32 % of their strength at most, ")
    assert said.endswith(words)
    assert ("deployment included" in said) == (lost is None and not snaps)
    page = page_of(made, tmp_path).read_text()
    assert f"<figcaption>{note}" in page
    assert re.findall(r">(deployment[^<]*)</th>", page) == ([head] if head else [])
    lines = [line for line in made.summary(verbose=True).splitlines() if line.startswith("  bending   stages")]
    assert len(lines) == (head is not None)
    (used,) = [line for line in made.summary().splitlines() if line.startswith("  stress  ")]
    assert ("unknown below 56 %" in used) == (lost == 0.5625)  # as the warning has it


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lost", "snaps", "guided", "note"),
    [(None, [], None, "Every stage of the deployment is an equilibrium of the elastic grid with pinned ends."),
     (None, [[0.14, 0.15], [0.33, 0.34]], None,
      "Every stage of the deployment is an equilibrium of the elastic grid with pinned ends; at 14 % and 33 % of the "
      "deployment the shell "
      "snaps forward."),
     (None, [], [0.25, 0.5625],
      "Every stage of the deployment is an equilibrium of the elastic grid with pinned ends; between 25 % and "
      "56 % of the deployment it "
      "has to be guided, and its shape is not known."),
     (0.5625, [], None,
      "Below 56 % of the deployment no stage could be found, and the shape is not known. Above it, every stage is an "
      "equilibrium of the elastic grid with pinned ends.")],
)  # fmt: skip
def test_under_the_view_stands_where_the_stages_do_not_follow_each_other_smoothly(
    lost: float | None, snaps: list[list[float]], guided: list[float] | None, note: str, tmp_path: Path
) -> None:
    made = with_stages(None, lost, snaps)
    result = {**made.results.plain(), "deployment": {**made.results.plain()["deployment"], "guided": guided}}
    page = page_of(replace(made, results=Results.of(result)), tmp_path).read_text()
    assert f"<figcaption>{note}</figcaption>" in page


def test_a_deployment_that_was_not_followed_is_not_included() -> None:
    made = with_stages(0.32, None, [])
    result = {key: value for key, value in made.results.plain().items() if key != "deployment"}
    for stages in ("pop_up", "deployment"):
        del result["bending"][stages]
    assert facts(Results.of(result))[-1].endswith("in the final shape; the deployment from flat was not followed.")
    assert "bending   stages" not in replace(made, results=Results.of(result)).summary(verbose=True)


@pytest.mark.parametrize(
    ("value", "shown"),
    [(8260.4, "8260"), (1_234_567.0, "1230000"), (999.6, "1000"), (12.345, "12.3"),
     (-1420.0, "-1420"), (0.00126, "0.00126")],
)  # fmt: skip
def test_numbers_are_plain(value: float, shown: str) -> None:
    assert wording.rounded(value) == shown
    assert wording.newtons(value) == f"{shown} N"


def test_every_number_of_a_material_has_its_unit() -> None:
    timber = rs.Material(youngs_modulus=11e9, density=470.0, shear=0.69e9).parameters()
    rows = dict(wording.case_rows(Material.model_validate(timber)))
    assert rows == {
        "Young's modulus": "11 GPa",
        "density": "470 kg/m\N{SUPERSCRIPT THREE}",
        "shear modulus": "0.69 GPa",
    }


def test_a_page_for_others_names_files_and_no_folders() -> None:
    target = {"kind": "mesh", "file": "/home/ann/roof.obj", "boundary": "C:\\ann\\rim.dxf", "unit": 0.001}
    assert wording.case_rows(Target.model_validate(target)) == [
        ("kind", "mesh"),
        ("file", "roof.obj"),
        ("boundary", "rim.dxf"),
    ]
    case = '[target]\nfile = "/home/ann/roof.obj"\nboundary = "/home/ann/rim.dxf"\n'
    assert (
        shown_case(case, {"/home/ann/roof.obj": b"v"}) == '[target]\nfile = "inputs/roof.obj"\nboundary = "rim.dxf"\n'
    )


def test_no_drawing_of_the_page_claims_to_be_at_true_scale(tmp_path: Path) -> None:
    page = page_of(wished(), tmp_path).read_text(encoding="utf-8")
    page = re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)
    assert ": flat plan</text>" in page
    assert "1:1" not in page


def test_lengths_of_the_case_follow_the_rounding() -> None:
    layout = Layout(spacing=(0.5, 0.5), edge=0.5 / 6, offset=(0.0, -0.0125))
    assert [value for _, value in wording.case_rows(layout, Rounding(0.1))] == [
        "500 mm \N{MULTIPLICATION SIGN} 500 mm", "83.3 mm", "0 mm, \N{MINUS SIGN}12.5 mm",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("rod", "line"),
    [(ROD, "rod 2 mm; E = 1 MPa, 1000 kg/m3 (the paper's rubber; for another: rod.material)"),
     (rs.Rod(rs.Tube(0.02, 0.003), rs.Material(25e9, 1900.0)),
      "tube 40 x 3 mm; E = 25 GPa, 1900 kg/m3 (Poisson's ratio is the paper's rubber's; "),
     (rs.Rod(rs.Circle(0.02), rs.Material(11e9, 1000.0)),
      "rod 40 mm; E = 11 GPa, 1000 kg/m3 (density and Poisson's ratio are the paper's rubber's; for"),
     (rs.Rod(rs.Circle(0.02), rs.Material(25e9, 1900.0, 0.3)), "rod 40 mm; E = 25 GPa, 1900 kg/m3"),
     (rs.Rod(rs.RectangularSection(0.012, 0.05), rs.Material(11e9, 470.0, shear=0.69e9)),
      "lath 12 x 50 mm; E = 11 GPa, 470 kg/m3"),
     (rs.Rod(rs.Circle(0.02), rs.Material.preset("larch", poisson_ratio=0.3, density=650.0)),
      "rod 40 mm; larch, E = 12 GPa, 650 kg/m3 (density and Poisson's ratio not larch's)"),
     (rs.Rod(rs.GivenSection(1e6, 20.0, 30.0, 5.0)), "given, EA 1000000 N, EI1 20 N m\N{SUPERSCRIPT TWO}")],
)  # fmt: skip
def test_the_summary_names_the_rod(rod: rs.Rod, line: str) -> None:
    made = archive("dome")
    text = replace(made, results=Results.of({**made.results.plain(), "rod": rod_type(rod)})).summary(verbose=True)
    (said,) = [one for one in text.splitlines() if one.startswith("  rod ")]
    assert said.startswith(f"  rod       {line}")
    assert said.endswith("rubber's; for another: rod.material)") == ("rubber's;" in line)
    assert said.endswith("rod.material)") == ("rubber" in line)


def test_strengths_of_a_preset_are_shown_with_what_they_mean_and_their_source() -> None:
    made = archive("dome")
    rod = rod_type(rs.Rod(rs.Circle(0.02), rs.Material.preset("larch")))
    bending = Bending(strength_of="larch", clamped=WorstBent(utilisation=0.4))
    results = made.results.changed(rod=rod, bending=bending)
    rows = dict(dict(key_figures(results, flat_plan(made)))["Rod"])
    assert rows["preset"] == "larch"
    assert rows["bending strength"] == "30 MPa"
    assert rows["these strengths are"] == "characteristic, short-term"
    assert rows["source"].startswith("EN 338")
    table = checks_table(results)
    assert table is not None
    assert ("Utilisation of larch's strength", ["40 %"]) in table["rows"]


def test_lengths_with_allowances_are_told_from_those_without() -> None:
    for made, added in ((archive("dome"), 0.0), (wished(), 0.024)):
        plan = flat_plan(made)
        cut = dict(dict(key_figures(made.results, plan))["Cut list"])
        (bare,) = (float(text.split()[0]) for name, text in cut.items() if name.startswith("longest rod"))
        assert ("longest rod, without allowances" in cut) == plan.summary.endswith(", with allowances") == (added > 0)
        assert f"longest {bare + 1e3 * added:.{plan.rounding.digits}f} mm" in plan.summary


def test_the_page_says_that_the_fewest_bars_are_a_bound(tmp_path: Path) -> None:
    stock = wished().results.plain()["fabrication"]["stock"]
    page = " ".join(page_of(wished(), tmp_path).read_text().split())
    assert f"{len(stock['bars'])} bars, " in page
    assert f"however these pieces are cut, they take {stock['fewest']} bars at least" in page


def test_a_grid_that_rests_on_its_target_tells_depth_and_not_gap() -> None:
    made = archive("dome")
    assert "factorisations, gap 0 mm, " in made.summary(verbose=True)
    assert ("largest gap", "0.00 mm") not in _drape_rows(made, "gravity")
    for method, word in (("bound", "largest gap"), ("gravity", "deepest inside the target")):
        assert word in [title for title, _ in _drape_rows(made, method)]
    assert made.results.drape is not None
    drape = made.results.drape.changed(method="gravity", max_gap=5.54e-5)
    text = replace(made, results=made.results.changed(drape=drape)).summary(verbose=True)
    assert "deepest node inside by 0.06 mm" in text


def _drape_rows(made: Archive, method: str) -> list[tuple[str, str]]:
    assert made.results.drape is not None
    drape = made.results.drape.changed(method=method, max_gap=5.54e-5)
    return dict(key_figures(made.results.changed(drape=drape), flat_plan(made)))["Drape"]
