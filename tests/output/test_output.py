"""What is written: every file tells the same lengths, is well formed, and replaces nothing but a result."""

import base64
import csv
import io
import json
import re
import xml.etree.ElementTree as ET
import zlib
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import ezdxf
import numpy as np
import pytest

from rodshell.errors import OutputError
from rodshell.geometry.boxes import boxes_meet, lines_meet
from rodshell.output.drawings.flat import flat_plan
from rodshell.output.files import export, save
from rodshell.output.labels import place
from rodshell.output.pictures import picture_svg
from rodshell.results import Archive, Results, read
from rodshell.results.wording import shown_length
from tests.output.sample_archive import sample_archive, table_archive

TOLERANCE = 0.01  # mm: a tenth of what a saw or a laser holds
SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def archive() -> Archive:
    return sample_archive()


@pytest.fixture(scope="module")
def out(archive: Archive, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return save(archive, tmp_path_factory.mktemp("results") / "dome", "all")


@pytest.fixture(scope="module")
def table_out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return save(table_archive(), tmp_path_factory.mktemp("results") / "table", "all")


def rows(out: Path, name: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO((out / "schedule" / name).read_text())))


def layer(out: Path, kind: str, name: str) -> list:
    return list(ezdxf.readfile(out / "drawings/plan.dxf").modelspace().query(f'{kind}[layer=="{name}"]'))


def svg_rods(out: Path) -> dict[str, np.ndarray]:
    """Ends (2, 2) of each rod in the SVG [mm], y up again."""
    root = ET.parse(out / "drawings/plan.svg").getroot()
    ends = {}
    for line in root.iter(f"{SVG}line"):
        if "data-rod" in line.attrib:
            points = [[float(line.attrib[f"{axis}{k}"]) for axis in "xy"] for k in "12"]
            ends[line.attrib["data-rod"]] = np.array(points) * (1, -1)
    return ends


def names_in(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


@pytest.mark.slow
def test_the_folder_holds_what_the_design_lists(out: Path, table_out: Path) -> None:
    """An archive of the first version, without checks and fabrication: what can be made of it is made."""
    drawings = {f"drawings/{name}.{e}" for name in ("plan", "strips", "supports", "elevations") for e in ("dxf", "svg")}
    always = {"result.json", "states.npz", "report.html", "drawings/drawings.pdf", *drawings} | {
        f"schedule/{name}.csv" for name in ("rods", "joints", "supports")
    }
    states = ("draped", "popped_pinned", "popped_clamped")
    models = {f"model/{state}.{e}" for state in states for e in ("obj", "vtp")}
    swept = {f"model/popped_clamped.{e}" for e in ("glb", "json")}
    pictures = {f"pictures/{state}.png" for state in ("flat", "popped_clamped")}
    always.add("manifest.json")
    assert names_in(out) == always | models | swept | pictures | {"case.toml"}
    pinned = {f"model/popped_pinned.{e}" for e in ("obj", "vtp", "glb", "json")}
    assert names_in(table_out) == always | pinned | {"pictures/flat.png", "pictures/popped_pinned.png"}


@pytest.mark.parametrize("which", ["out", "table_out"])
def test_cut_lengths_agree_in_every_file(which: str, request: pytest.FixtureRequest) -> None:
    out = request.getfixturevalue(which)
    result = {rod["id"]: 1e3 * rod["length"] for rod in json.loads((out / "result.json").read_text())["rods"]}
    schedule = {row["id"]: float(row["length_mm"]) for row in rows(out, "rods.csv")}
    svg = {name: float(np.linalg.norm(ends[1] - ends[0])) for name, ends in svg_rods(out).items()}
    dxf = [line.dxf.start.distance(line.dxf.end) for line in layer(out, "LINE", "CUT")]
    assert schedule.keys() == svg.keys() == result.keys()
    assert len(dxf) == len(result)
    for (name, length), drawn in zip(result.items(), dxf, strict=True):
        assert schedule[name] == pytest.approx(length, abs=TOLERANCE)
        assert svg[name] == pytest.approx(length, abs=TOLERANCE)
        assert drawn == pytest.approx(length, abs=TOLERANCE)
    assert len({round(length, 1) for length in result.values()}) > 2  # rods that differ, or swaps would not show


def test_lines_lie_where_the_flat_state_has_its_ends(out: Path, archive: Archive) -> None:
    nodes = np.split(archive.states["rod_nodes"], archive.states["rod_start"][1:])
    svg, dxf = svg_rods(out), layer(out, "LINE", "CUT")
    for rod, own, line, row in zip(archive.results.plain()["rods"], nodes, dxf, rows(out, "rods.csv"), strict=True):
        ends = 1e3 * archive.states["flat"][own[[0, -1]], :2]
        np.testing.assert_allclose(svg[rod["id"]], ends, atol=TOLERANCE)
        np.testing.assert_allclose([line.dxf.start.vec2, line.dxf.end.vec2], ends, atol=TOLERANCE)
        flat = [float(row[f"flat_{axis}{k}_mm"]) for k in "01" for axis in "xy"]
        np.testing.assert_allclose(flat, ends.ravel(), atol=TOLERANCE)
        final = [float(row[f"final_{axis}{k}_mm"]) for k in "01" for axis in "xyz"]
        np.testing.assert_allclose(final, 1e3 * archive.states["popped_clamped"][own[[0, -1]]].ravel(), atol=TOLERANCE)
        assert row["final_state"] == "popped_clamped"


@pytest.mark.parametrize("which", ["out", "table_out"])
def test_joint_marks_of_both_rods_coincide(which: str, request: pytest.FixtureRequest) -> None:
    out = request.getfixturevalue(which)
    lines = svg_rods(out)
    circles = np.array([mark.dxf.center.vec2 for mark in layer(out, "CIRCLE", "MARK")])
    names = {text.dxf.text for text in layer(out, "TEXT", "LABEL") if "/" in text.dxf.text}
    joints = rows(out, "joints.csv")
    assert len(joints) == len(circles) == len(names) > 3
    for row, circle in zip(joints, circles, strict=True):
        for side in "ab":
            start, end = lines[row[f"rod_{side}"]]
            mark = start + float(row[f"at_{side}_from_cut_end_mm"]) * (end - start) / np.linalg.norm(end - start)
            np.testing.assert_allclose(mark, circle, atol=TOLERANCE)
        assert row["id"] in names
    listed = {
        row["id"]: dict(re.findall(r"([^;]+) (\S+?)(?:; |$)", row["joints_from_cut_end_mm"]))
        for row in rows(out, "rods.csv")
    }
    assert all(listed[row["rod_b"]][row["rod_a"]] == row["at_b_from_cut_end_mm"] for row in joints)
    assert sum(map(len, listed.values())) == 2 * len(joints)


def test_joints_in_space_lie_on_the_final_state(out: Path, archive: Archive) -> None:
    rod_nodes = np.split(archive.states["rod_nodes"], archive.states["rod_start"][1:])
    nodes = {rod["id"]: own for rod, own in zip(archive.results.plain()["rods"], rod_nodes, strict=True)}
    for row in rows(out, "joints.csv"):
        (shared,) = np.intersect1d(nodes[row["rod_a"]], nodes[row["rod_b"]])
        final = [float(row[f"final_{axis}_mm"]) for axis in "xyz"]
        np.testing.assert_allclose(final, 1e3 * archive.states["popped_clamped"][shared], atol=TOLERANCE)
        assert float(row["flat_deg"]) == pytest.approx(90.0)


def test_opening_angle_matches_the_map_of_the_dome(out: Path) -> None:
    """The sample's meridians keep their length and its circles shrink by sin(a)/a: the angle is known."""
    row = next(row for row in rows(out, "joints.csv") if row["id"] == "U07/V07")
    x, y = float(row["flat_x_mm"]), float(row["flat_y_mm"])
    angle = np.hypot(x, y) / 200
    meridian, circle = (
        np.array([x, y]) / np.hypot(x, y),
        np.array([-y, x]) / np.hypot(x, y) * np.sin(angle) / angle,
    )
    u, v = (np.array([meridian[k], circle[k]]) for k in (0, 1))
    expected = np.degrees(np.arccos(u @ v / np.linalg.norm(u) / np.linalg.norm(v)))
    assert expected < 85  # so that neither 90 degrees nor the supplement would pass
    assert float(row["final_deg"]) == pytest.approx(expected, abs=0.5)  # chords of 12 mm; the shell is off by 0.1 %


def test_opening_angle_of_skew_rods_is_that_of_their_directions(table_out: Path) -> None:
    lines = svg_rods(table_out)
    for row in rows(table_out, "joints.csv"):
        a, b = (np.diff(lines[row[f"rod_{side}"]], axis=0)[0] for side in "ab")
        expected = np.degrees(np.arccos(a @ b / np.linalg.norm(a) / np.linalg.norm(b)))
        assert float(row["flat_deg"]) == pytest.approx(expected, abs=6e-3)  # shown to 0.01 degrees
        assert row["final_state"] == "popped_pinned"


@pytest.mark.parametrize("which", ["out", "table_out"])
def test_dxf_passes_its_audit(which: str, request: pytest.FixtureRequest) -> None:
    drawing = ezdxf.readfile(request.getfixturevalue(which) / "drawings/plan.dxf")
    audit = drawing.audit()
    assert audit.errors == []
    assert audit.fixes == []
    assert drawing.header["$INSUNITS"] == 4  # mm
    assert {entity.dxf.layer for entity in drawing.modelspace()} <= {each.dxf.name for each in drawing.layers}


def test_dxf_has_both_boundaries(out: Path, archive: Archive) -> None:
    (flat,) = layer(out, "LWPOLYLINE", "BOUNDARY-FLAT")
    (final,) = layer(out, "POLYLINE", "BOUNDARY-FINAL")
    assert flat.closed
    assert final.is_closed
    assert final.is_3d_polyline
    footprint = np.array([point[:2] for point in flat.get_points()])
    turns = np.unwrap(np.arctan2(footprint[:, 1], footprint[:, 0]))
    assert np.all(np.diff(turns) > 0)
    assert turns[-1] - turns[0] < 2 * np.pi  # once around
    boundary = {tuple(np.round(vertex.dxf.location, 3)) for vertex in final.vertices}
    assert boundary == {tuple(np.round(1e3 * np.array(point), 3)) for point in archive.results.plain()["boundary"]}


def test_svg_is_at_true_scale(out: Path) -> None:
    root = ET.parse(out / "drawings/plan.svg").getroot()
    box = [float(value) for value in root.attrib["viewBox"].split()]
    assert root.attrib["width"] == f"{box[2]:.3f}".rstrip("0").rstrip(".") + "mm"
    assert root.attrib["height"] == f"{box[3]:g}mm"
    assert {text.text for text in root.iter(f"{SVG}text")} >= {"U01", "V09", "sample dome: flat plan, 1:1"}


@pytest.mark.parametrize("count", [9, 21, 40])
def test_rods_are_labelled_at_nearly_all_ends(count: int) -> None:
    plan = flat_plan(sample_archive(count, 1))
    labels = place([rod.id for rod in plan.rods], plan.cuts, plan.text)
    assert {label.text for label in labels} == {rod.id for rod in plan.rods}
    assert len(labels) > 3.6 * count


def test_boxes_meet_by_the_axes_of_both() -> None:
    level = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]])
    diamond = np.array([[0.0, -0.5], [0.5, 0.0], [0.0, 0.5], [-0.5, 0.0]])  # its tips reach over a corner's sides
    apart, meeting = diamond + (2.3, 1.3), diamond + (2.2, 1.2)
    for one, other in ((level, apart), (apart, level)):
        assert not boxes_meet(one, other[None])
    for one, other in ((level, meeting), (meeting, level)):
        assert boxes_meet(one, other[None])
    assert boxes_meet(level, np.array([apart, meeting]))
    assert not boxes_meet(level, np.array([level + (2, 0), level + (0, 1)]))  # they touch


def test_lines_meet_a_box_only_inside_it() -> None:
    box = np.array([[1.0, 1.0], [3.0, 1.0], [3.0, 2.0], [1.0, 2.0]])
    through = np.array([[[0, 1.5], [4, 1.5]], [[2, 0], [2, 3]], [[0, 0], [4, 3]], [[1.5, 1.5], [2, 1.6]]], dtype=float)
    past = np.array([[[0, 0.5], [4, 0.5]], [[3.5, 0], [3.5, 3]], [[0, 1.5], [0.9, 1.5]], [[0, 1.2], [1.2, 3]]])
    assert all(lines_meet(box, line[None]) for line in through)
    assert not lines_meet(box, past)


def test_labels_keep_clear_of_skew_neighbours() -> None:
    fan = np.array([[[0.0, 0.0], [np.cos(a), np.sin(a)]] for a in np.radians([10, 25, 40, 55, 205])])
    labels = place([f"R{k}" for k in range(5)], fan, 0.08)
    assert {label.text for label in labels} == {"R0", "R1", "R2", "R3", "R4"}
    for k, one in enumerate(labels):
        for other in labels[k + 1 :]:  # no sample point of one text lies in the other
            corners, box = one.box(0.08), other.box(0.08)
            weights = np.stack(np.meshgrid(*[np.linspace(0, 1, 30)] * 2), axis=-1).reshape(-1, 2)
            points = corners[0] + weights @ (corners[[1, 3]] - corners[0])
            inside = np.linalg.solve((box[[1, 3]] - box[0]).T, (points - box[0]).T)
            assert not np.any(np.all((inside > 0.001) & (inside < 0.999), axis=0))


def vtk_arrays(path: Path) -> dict[str, np.ndarray]:
    """The arrays of a VTK file with packed binary data, by their names."""
    arrays = {}
    for array in ET.parse(path).getroot().iter("DataArray"):
        text = array.text or ""
        blocks, _, _, packed = np.frombuffer(base64.b64decode(text[:24])[:16], dtype="<u4")
        assert blocks == 1
        data = base64.b64decode(text[24:])
        assert len(data) == packed
        kind = {"Float64": "<f8", "Int64": "<i8"}[array.attrib["type"]]
        arrays[array.attrib["Name"]] = np.frombuffer(zlib.decompress(data), dtype=kind)
    return arrays


def test_vtp_holds_lines_points_and_gaps(out: Path, archive: Archive) -> None:
    piece = ET.parse(out / "model/popped_pinned.vtp").getroot().find("PolyData/Piece")
    assert piece is not None
    data = vtk_arrays(out / "model/popped_pinned.vtp")
    nodes, m = archive.states["rod_nodes"], len(archive.results.plain()["rods"])
    assert (piece.attrib["NumberOfPoints"], piece.attrib["NumberOfLines"]) == (str(len(nodes)), str(m))
    np.testing.assert_array_equal(data["Points"].reshape(-1, 3), archive.states["popped_pinned"][nodes])
    np.testing.assert_array_equal(data["gap"], archive.states["gap_pinned"][nodes])
    np.testing.assert_array_equal(data["connectivity"], np.arange(len(nodes)))
    np.testing.assert_array_equal(data["offsets"], [*archive.states["rod_start"][1:], len(nodes)])
    np.testing.assert_array_equal(data["rod"], np.arange(m))


def test_obj_polylines_are_the_states(out: Path, archive: Archive) -> None:
    words = [line.split() for line in (out / "model/popped_clamped.obj").read_text().splitlines()]
    points = np.array([word[1:] for word in words if word[0] == "v"], dtype=float)
    lines = [np.array(word[1:], dtype=int) - 1 for word in words if word[0] == "l"]
    nodes = np.split(archive.states["rod_nodes"], archive.states["rod_start"][1:])
    assert [word[1] for word in words if word[0] == "o"] == [rod["id"] for rod in archive.results.plain()["rods"]]
    for line, own in zip(lines, nodes, strict=True):
        np.testing.assert_allclose(points[line], archive.states["popped_clamped"][own], atol=1e-8)


class References(HTMLParser):
    """Everything in a page that a browser would fetch, and the tags left open."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found += [
            f"{tag} {key}={value}" for key, value in attrs if key in ("src", "href", "xlink:href", "data", "action")
        ]
        if tag not in ("meta", "link", "br", "img", "input"):
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.mark.parametrize("which", ["out", "table_out"])
def test_report_needs_nothing_else(which: str, request: pytest.FixtureRequest) -> None:
    page = (request.getfixturevalue(which) / "report.html").read_text()
    parser = References()
    parser.feed(page)
    assert parser.found == []
    assert parser.open == []
    names = "http://www.w3.org/1999/xhtml"  # the name of a namespace, which nothing is loaded from
    assert not re.search(r"https?://|@import|url\(", page.replace(names, ""))


def test_report_gives_the_verdict_first(out: Path) -> None:
    page = (out / "report.html").read_text()
    assert page.index('aria-label="Verdict"') < page.index("<strong>Check, unloaded: ") < page.index("<h2>")
    assert "Supports that hold the rods&#39; directions (clamped) leave" in page
    assert "Design aid, not code compliance" in page
    assert page.count("<figure>") == 8
    assert "kind = &#34;hemisphere&#34;" in page


def test_report_puts_failure_and_then_warnings_once_before_all_else(archive: Archive, tmp_path: Path) -> None:
    shells = {
        "pinned": {"status": "stalled", "stable": False},
        "clamped": {"status": "converged", "stable": False, "negative_modes": 1},
    }
    words = {"warnings": ["<script>alert(1)</script>"], "dropped": [{"id": "U99", "reason": "no two ends"}]}
    result = {**archive.results.plain(), "status": "stalled", "pop_up": shells, **words}
    export(replace(archive, results=Results.of(result)), tmp_path, ["report"])
    page = (tmp_path / "report.html").read_text()
    first = "Not known: the computation did not converge, which says nothing about the shell itself: stalled"
    assert page.index(first) < page.index("&lt;script&gt;alert(1)") < page.index("<h2>")
    assert "<script>alert" not in page
    assert "with clamped ends the shell is unstable (1 buckling mode) and would snap to another shape" in page
    assert "the pop-up with pinned ends did not converge: stalled" in page
    assert "With pinned ends the largest gap" not in page  # a shell that did not converge has no gap
    assert "U99: no two ends" in page


def test_no_name_breaks_a_page_or_a_drawing(tmp_path: Path) -> None:
    plain = table_archive()
    name = '"><script>x</script> & \N{GREEK SMALL LETTER ALPHA}\x07'
    archive = Archive(Results.of({**plain.results.plain(), "name": name}), plain.states, "# </pre><script>x</script>")
    out = save(archive, tmp_path / "named", "all")
    assert "<script>x" not in (out / "report.html").read_text()
    root = ET.parse(out / "drawings/plan.svg").getroot()
    texts = {text.text or "" for text in root.iter(f"{SVG}text")}
    assert f"{name[:-1]} : flat plan, 1:1" in texts
    for state in ("flat", "popped_pinned"):
        ET.fromstring(picture_svg(archive, state))
    assert not ezdxf.readfile(out / "drawings/plan.dxf").audit().errors


def test_least_result_is_written(tmp_path: Path) -> None:
    """A result with nothing but rods (a run stopped early) still gives its files."""
    full = sample_archive()
    result = {key: full.results.plain()[key] for key in ("format", "version", "units", "rods")}
    least = Archive(Results.of({**result, "status": "diverged"}), {"flat": full.states["flat"]}, "")
    out = save(least, tmp_path / "least", "all")
    assert (
        "Not known: the computation did not converge, which says nothing about the shell itself: diverged"
        in (out / "report.html").read_text()
    )
    assert len(rows(out, "rods.csv")) == 18
    assert rows(out, "joints.csv")[0]["final_deg"] == ""


def test_pictures_share_the_view_and_the_scale(archive: Archive) -> None:
    """Ticks up to the next round number over the largest gap of all, of 0, 1.2 and 0.12 mm; each says its own."""
    pictures = {state: picture_svg(archive, state) for state in ("draped", "popped_pinned", "popped_clamped")}
    boxes = {re.search(r'viewBox="[^"]+"', svg)[0] for svg in pictures.values()}
    assert len(boxes) == 1
    for state in pictures:
        texts = [text.text for text in ET.fromstring(pictures[state]).iter(f"{SVG}text")]
        assert "gap to target in mm, + outside" in texts
        assert {"\N{MINUS SIGN}1", "0", "1"} <= set(texts[-6:])
        assert ("\N{MINUS SIGN}1.20 mm" in texts) == (state == "popped_pinned")
    with pytest.raises(OutputError, match="popped_clamped"):
        picture_svg(archive, "popped")


def test_the_ring_is_where_the_agreement_found_the_largest_gap(archive: Archive) -> None:
    """Between two nodes it may be larger than at either: picture and table give one number."""
    between = {"pinned": {"max": 0.00135, "where": [0.0, 0.0, 0.2]}}
    result = {**archive.results.plain(), "agreement": between}
    root = ET.fromstring(picture_svg(replace(archive, results=Results.of(result)), "popped_pinned"))
    texts = [text.text for text in root.iter(f"{SVG}text")]
    assert "\N{MINUS SIGN}1.35 mm" in texts


def test_the_label_of_the_largest_gap_is_no_finer_than_the_report(archive: Archive) -> None:
    """With a tolerance of 2 mm both say how small it is, and no more."""
    style = {"tolerance": 2e-3}
    coarse = replace(archive, results=Results.of({**archive.results.plain(), "drawings": style}))
    shown = shown_length(coarse.results)(coarse.results.agreement["clamped"].max)
    texts = [text.text for text in ET.fromstring(picture_svg(coarse, "popped_clamped")).iter(f"{SVG}text")]
    assert shown == "under 1 mm"
    assert shown in texts
    assert not any("0.12" in (text or "") for text in texts)


@pytest.mark.slow
def test_fine_meshes_do_not_swell_a_picture() -> None:
    coarse, fine = (len(picture_svg(sample_archive(30, edges), "popped_pinned")) for edges in (8, 80))
    assert fine < 1.3 * coarse


@pytest.mark.parametrize("larger", [1.0, 100.0])
def test_table_is_coloured_by_height_in_the_unit_of_the_axes(larger: float) -> None:
    made = table_archive()
    high = {**made.states, "popped_pinned": larger * made.states["popped_pinned"]}
    assert np.ptp(high["popped_pinned"][:, 2]) > 1.0 or larger == 1.0
    assert "height in mm" in picture_svg(replace(made, states=high), "popped_pinned")


@pytest.mark.slow
def test_report_of_60_by_60_rods_stays_below_6_megabytes(tmp_path: Path) -> None:
    export(sample_archive(60, 6), tmp_path, ["report"])
    assert (tmp_path / "report.html").stat().st_size < 6e6  # 0.65 of them are the viewer's script


def test_read_gives_back_what_was_written(out: Path, archive: Archive) -> None:
    again = read(out)
    assert again.results.plain() == archive.results.plain()
    assert again.case_toml == archive.case_toml
    assert again.states.keys() == archive.states.keys()
    for name, values in archive.states.items():
        np.testing.assert_array_equal(again.states[name], values)
        assert again.states[name].dtype == values.dtype


@pytest.mark.slow
def test_json_holds_no_nan(archive: Archive, tmp_path: Path) -> None:
    result = {**archive.results.plain(), "net": {"error_estimate": np.nan, "min_angle_deg": np.float64("inf"),
              "min_angle_at": np.array([np.nan, 0.0, 1.0])}, "count": np.int64(3)}  # fmt: skip

    def refuse(word: str) -> None:
        raise AssertionError(word)

    text = (save(replace(archive, results=Results.of(result)), tmp_path / "nan") / "result.json").read_text()
    stored = json.loads(text, parse_constant=refuse)
    assert stored["net"] == {"error_estimate": None, "min_angle_deg": None, "min_angle_at": [None, 0.0, 1.0]}
    assert stored["count"] == 3


@pytest.mark.slow
def test_the_same_archive_gives_the_same_bytes(archive: Archive, out: Path, tmp_path: Path) -> None:
    again = save(archive, tmp_path / "again", "all")
    for path in out.rglob("*"):
        if path.is_file():
            assert path.read_bytes() == (again / path.relative_to(out)).read_bytes(), path.name


def test_reading_what_is_no_result_says_so(out: Path, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="holds no rodshell result"):
        read(tmp_path)
    (tmp_path / "result.json").write_text('{"format": "rodshell-result", "version": 99}')
    with pytest.raises(OutputError, match="version 99"):
        read(tmp_path)
    (tmp_path / "result.json").write_bytes((out / "result.json").read_bytes())
    damaged = r"states.npz cannot be read: it is damaged or not written by rodshell; run case.toml again$"
    for content in (b"PK broken", b"", b"no archive", (out / "states.npz").read_bytes()[:1000]):
        (tmp_path / "states.npz").write_bytes(content)
        with pytest.raises(OutputError, match=damaged):
            read(tmp_path)
    np.savez(tmp_path / "states.npz", flat=np.array([{}], dtype=object))
    with pytest.raises(OutputError, match=damaged):
        read(tmp_path)
    (tmp_path / "states.npz").unlink()
    with pytest.raises(OutputError, match=r"states.npz is missing: run case.toml again$"):
        read(tmp_path)
    with pytest.raises(OutputError, match=r"result.json is a file: give the folder of a rodshell result$"):
        read(tmp_path / "result.json")
