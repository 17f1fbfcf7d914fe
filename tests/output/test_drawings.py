"""The drawing set: true to scale, on sheets that match, with labels that never cover each other."""

import csv
import io
import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from rodshell.errors import InputError
from rodshell.figures.form import RodJoint, RodLine
from rodshell.geometry.boxes import boxes_meet, length_beneath, lines_meet
from rodshell.output.drawing import TEXT, Drawing, Pencil
from rodshell.output.drawing import Path as Line
from rodshell.output.drawings import FINER, drawing_set, sheet_set
from rodshell.output.drawings.flat import flat_drawing, flat_plan, strips_drawing
from rodshell.output.drawings.sheets import OVERLAP, SCALES, bound, laid_out, room, tiled, title_block
from rodshell.output.drawings.shell import (
    SAME,
    bracing_drawing,
    elevations_drawing,
    erection_drawing,
    rod_curves,
    supports_drawing,
)
from rodshell.output.files import export
from rodshell.output.grid import GridRod, joint_places, rods_of
from rodshell.output.labels import spread
from rodshell.output.options import OutputOptions
from rodshell.output.settings import DrawingStyle
from rodshell.results import Archive
from rodshell.results.wording import Rounding, rounding_of
from tests.output.dxf_reader import read_dxf
from tests.output.forms import TARGETS, archive, formed, wished
from tests.output.sample_archive import sample_archive, table_archive

PAPER = (420.0, 297.0)  # A3
FORMED = [*TARGETS, "roof", "opening", "sewn"]
ARCHIVES = [*FORMED, "wished", "sample", "table", "pavilion", "families"]


def named(name: str) -> Archive:
    others = {"wished": wished, "sample": sample_archive, "table": table_archive}
    return others[name]() if name in others else formed(name)


def covered(drawing: Drawing) -> list[tuple[str, str]]:
    """Pairs of texts of a drawing that cover each other."""
    boxes = np.array([text.box() for text in drawing.texts]).reshape(-1, 4, 2)
    low, high = boxes.min(axis=1), boxes.max(axis=1)
    found = []
    for k, text in enumerate(drawing.texts):
        near = k + 1 + np.flatnonzero(np.all((low[k + 1 :] < high[k]) & (high[k + 1 :] > low[k]), axis=1))
        found += [
            (text.text, drawing.texts[j].text)
            for j in near
            if boxes_meet(0.999 * boxes[k] + 0.001 * boxes[k].mean(0), boxes[j][None])
        ]
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", ARCHIVES)
def test_labels_of_no_drawing_cover_each_other(name: str) -> None:
    for drawing in drawing_set(named(name)).values():
        assert covered(drawing) == [], drawing.name


@pytest.mark.slow
@pytest.mark.parametrize("name", ARCHIVES)
def test_labels_of_no_sheet_cover_each_other(name: str) -> None:
    sheets, paper = sheet_set(named(name))
    for sheet in sheets:
        assert covered(sheet) == [], sheet.title
        # read from below or from the right
        assert all(-89.9 < np.degrees(text.angle) <= 90.0 for text in sheet.texts), sheet.title
        low, high = sheet.box()
        assert np.all(low >= 0)
        assert np.all(high <= paper)


def test_the_check_sees_labels_that_cover_each_other() -> None:
    pencil = Pencil()
    pencil.write("U01", (0, 0), 10, "LABEL")
    pencil.write("V01", (12, 3), 10, "LABEL", angle=0.5)
    pencil.write("V02", (12, 30), 10, "LABEL")
    assert covered(pencil.done("", "", 10)) == [("U01", "V01")]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["dome", "ridge"])
def test_every_rod_and_joint_is_labelled_on_the_plan(name: str) -> None:
    plan = flat_plan(archive(name))
    texts = {text.text for text in flat_drawing(plan, plan.text).texts}
    assert {rod.id for rod in plan.rods} | {joint.id for joint in plan.joints} <= texts


def test_scale_is_the_largest_standard_one_that_fits() -> None:
    plan = flat_plan(archive("dome"))
    low, high = room(PAPER)
    layout = laid_out(lambda text: flat_drawing(plan, text), np.zeros(2), PAPER, plan.text)
    sheet = next(layout.sheets(PAPER))
    bottom, top = sheet.content.box()
    assert np.all(bottom >= low - 1e-9)
    assert np.all(top <= high + 1e-9)
    larger = SCALES[SCALES.index(sheet.scale) - 1]
    whole = np.subtract(*flat_drawing(plan, TEXT * larger).box()[::-1])
    assert np.any(whole / larger > high - low)


def test_sheets_of_the_plan_meet_at_their_match_lines() -> None:
    """Within the match lines of all sheets each rod is there once and whole; every sheet goes on beyond them."""
    plan = flat_plan(archive("dome"))
    low, high = room(PAPER)
    sheets = list(tiled(flat_drawing(plan, TEXT), PAPER))
    assert len(sheets) > 1
    drawn = {rod.id: 0.0 for rod in plan.rods}
    for sheet in sheets:
        inner = sheet.content.clipped(low + OVERLAP, high - OVERLAP)
        for path in inner.paths:
            if path.name:
                drawn[path.name] += float(np.linalg.norm(np.diff(path.points, axis=0), axis=1).sum())
        whole = sum(np.linalg.norm(np.diff(path.points, axis=0)) for path in sheet.content.paths if path.name)
        assert whole > sum(np.linalg.norm(np.diff(path.points, axis=0)) for path in inner.paths if path.name)
    for rod in plan.rods:
        assert drawn[rod.id] == pytest.approx(1e3 * rod.length, abs=1e-6)
    words = {text.text for sheet in sheets for text in sheet.content.texts if "match line" in text.text}
    assert words == {f"match line to part {row}{column}" for row in "ABCD" for column in "12"}


def test_names_of_match_lines_are_clear_of_the_drawing_where_there_is_room() -> None:
    """Lines cross the sheets' common edge, and leave room for a name only in its upper third."""
    low, high = room(PAPER)
    wide, tall = 1.5 * (high[0] - low[0]), high[1] - low[1] - 2 * OVERLAP
    lines = [Line(np.array([[0.0, y], [wide, y]]), "CUT") for y in (*np.arange(0.0, 0.6 * tall, 5.0), tall)]
    names = []
    for sheet in tiled(Drawing("", "", 1.0, tuple(lines)), PAPER):
        paths = [path.points for path in sheet.content.paths if path.layer == "CUT"]
        drawn = np.concatenate([np.stack([path[:-1], path[1:]], axis=1) for path in paths])
        names += [text for text in sheet.content.texts if not lines_meet(text.box(), drawn)]
    assert sorted(text.text for text in names) == ["match line to part A1", "match line to part A2"]


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_names_of_match_lines_that_find_no_free_place_cross_few_lines_and_lie_along_none(share: float) -> None:
    """Lines cross the sheets' common edge closer than a name is long; a rod runs next to the edge, where the name would
    be first, over the lower half of the sheet or all of it."""
    low, high = room(PAPER)
    wide, tall = 1.5 * (high[0] - low[0]), high[1] - low[1] - 2 * OVERLAP
    across = [np.array([[0.0, y], [wide, y]]) for y in (*np.arange(0.0, tall - 10.0, 30.0), tall)]
    beside = [np.array([[x, 0.0], [x, share * tall]]) for x in (0.5 * wide + 4.0,)]
    for sheet in tiled(Drawing("", "", 1.0, tuple(Line(points, "CUT") for points in (*across, *beside))), PAPER):
        drawn = np.array([path.points for path in sheet.content.paths if path.layer == "CUT"])
        (name,) = sheet.content.texts
        met = np.array([line for line in drawn if lines_meet(name.box(), line[None])])
        assert len(met) == 1
        assert np.ptp(met[0], axis=0)[1] == 0.0


def texts_about_the_edge(reach: float) -> Drawing:
    """Two sheets wide, with letters everywhere within `reach` [mm] of the sheets' common edge."""
    low, high = room(PAPER)
    wide, tall = 1.5 * (high[0] - low[0]), high[1] - low[1] - 2 * OVERLAP
    pencil = Pencil()
    pencil.line([(0.0, 0.0), (wide, 0.0), (wide, tall), (0.0, tall)], "CUT", closed=True)
    for x in np.arange(max(0.5 * wide - reach, 0.0), min(0.5 * wide + reach, wide) - 3.0, 4.0):
        for y in np.arange(2.0, tall - 5.0, 5.0):
            pencil.write("x", (x, y), TEXT, "LABEL")
    return pencil.done("", "", TEXT)


def test_a_name_of_a_match_line_without_a_free_place_is_led_aside() -> None:
    """Letters stand within 10 mm of the edge, where the name would be; farther off there is room."""
    low, high = room(PAPER)
    for sheet in tiled(texts_about_the_edge(OVERLAP), PAPER):
        (name,) = (text for text in sheet.content.texts if text.text.startswith("match line"))
        others = [text.box() for text in sheet.content.texts if text is not name]
        assert not boxes_meet(name.box(), others)
        assert np.all((name.box() >= low) & (name.box() <= high))
        *_, match, leader = [path.points for path in sheet.content.paths if path.layer == "TITLE"]
        start, end = leader
        assert abs(np.linalg.det(np.array([match[1] - match[0], start - match[0]]))) < 1e-6  # it begins on the line
        assert np.abs(name.box() - end).min() < 0.2 * TEXT  # and ends next to the name
        assert sheet.content.left_out == ()


def test_a_name_of_a_match_line_without_any_place_is_counted() -> None:
    for sheet in tiled(texts_about_the_edge(1e3), PAPER):
        assert not any(text.text.startswith("match line") for text in sheet.content.texts)
        assert sheet.content.left_out == ("1 of 1 names of match lines",)
        (bound_sheet,) = bound([sheet], title_block(sample_archive(3, 2), ""), PAPER)
        assert "Left out for lack of room: 1 of 1 names of match lines." in [text.text for text in bound_sheet.texts]


def test_length_beneath_is_that_within_the_box() -> None:
    """Across, along, oblique through a corner's sides, and past it; all of a turned box and its lines is the same."""
    box = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 2.0], [0.0, 2.0]])
    lines = np.array([[[5, -3], [5, 9]], [[-4, 1], [7, 1]], [[1, -1], [-1, 1]], [[8, 1], [12, 4]], [[-1, 5], [11, 5]]])
    turn = np.array([[np.cos(0.7), np.sin(0.7)], [-np.sin(0.7), np.cos(0.7)]])
    expected = 2.0 + 7.0 + 0.0 + 5.0 / 3.0
    shifts = np.array([[0.0, 0.0], [0.0, 20.0]])
    for axes in (np.eye(2), turn):
        found = length_beneath(box @ axes, shifts @ axes, lines @ axes)
        assert found == pytest.approx([expected, 0.0], abs=1e-9)


def test_parts_are_named_as_they_lie_and_point_to_their_neighbours() -> None:
    """Row A is the top one; the line to the next row is at the bottom, that to the next column on the right."""
    plan = flat_plan(archive("dome"))
    sheets = {sheet.title.split(" part ")[1][:2]: sheet for sheet in tiled(flat_drawing(plan, TEXT), PAPER)}
    assert list(sheets) == [row + column for row in "ABCD" for column in "12"]
    rods = {part: {path.name for path in sheet.content.paths if path.name} for part, sheet in sheets.items()}
    top = max(plan.rods, key=lambda rod: rod.record.offset or 0.0 if rod.family == "u" else -1.0).id
    right = max(plan.rods, key=lambda rod: rod.record.offset or 0.0 if rod.family == "v" else -1.0).id
    assert {part for part, drawn in rods.items() if top in drawn} == {"A1", "A2"}
    assert {part[1] for part, drawn in rods.items() if right in drawn} == {"2"}
    middle = 0.5 * np.sum(room(PAPER), axis=0)
    lines = {text.text: text.at for text in sheets["B1"].content.texts if "match line" in text.text}
    assert lines["match line to part A1"][1] > middle[1] > lines["match line to part C1"][1]
    assert lines["match line to part B2"][0] > middle[0]


@settings(max_examples=100, deadline=None)
@given(arrays(float, (5, 2), elements=st.floats(-3, 3).map(lambda value: round(value, 3))))
def test_clipping_keeps_what_is_inside(points: np.ndarray) -> None:
    """Against many points along the polyline: inside the square they are on a piece that is kept, and no other is."""
    drawing = Drawing("", "", 1.0, (Line(points, "CUT"),)).clipped(np.array([-1.0, -1.0]), np.array([1.0, 1.0]))
    kept = sum(np.linalg.norm(np.diff(path.points, axis=0), axis=1).sum() for path in drawing.paths)
    share = np.linspace(0, 1, 2001)[:, None]
    inside = 0.0
    for a, b in pairwise(points):
        within = np.all(np.abs((1 - share) * a + share * b) <= 1, axis=1)
        inside += np.linalg.norm(b - a) * within.mean()
    assert kept == pytest.approx(inside, abs=0.02)
    assert all(np.all(np.abs(path.points) <= 1 + 1e-9) for path in drawing.paths)


@given(st.lists(st.floats(0, 100), max_size=12), st.floats(0.1, 20))
def test_spread_keeps_the_order_and_the_gap_and_moves_least(places: list[float], gap: float) -> None:
    """The least squares' own condition: no group of neighbours gains by moving as a whole."""
    found = spread(places, gap)
    order = np.argsort(places, kind="stable")
    asked, put = np.array(places)[order], found[order]
    assert np.all(np.diff(put) >= gap - 1e-9)
    groups = np.split(np.arange(len(put)), np.flatnonzero(np.diff(put) > gap + 1e-9) + 1)
    for group in groups:
        moved = put[group] - asked[group]
        assert abs(moved.sum()) < 1e-6
        assert np.all(np.cumsum(moved) <= 1e-6)  # the left part of a group is pushed left, never right


def test_diagonals_are_those_of_the_largest_rectangle() -> None:
    plan = flat_plan(archive("dome"))
    (a, b), (c, d) = plan.diagonals
    assert np.linalg.norm(b - a) == pytest.approx(np.linalg.norm(d - c))
    marks = {tuple(np.round(mark, 6)) for mark in plan.marks}
    assert {tuple(np.round(point, 6)) for point in (a, b, c, d)} <= marks
    area = abs((b - a)[0] * (b - a)[1])
    x, y = (np.unique(np.round(plan.marks[:, k], 6)) for k in (0, 1))
    best = max(
        (x1 - x0) * (y1 - y0)
        for x0 in x for x1 in x for y0 in y for y1 in y
        if x1 > x0 and y1 > y0 and {(x0, y0), (x1, y0), (x0, y1), (x1, y1)} <= marks
    )  # fmt: skip
    assert area == pytest.approx(best)


@pytest.mark.slow
@pytest.mark.parametrize("name", FORMED)
def test_each_grid_is_set_out_by_two_diagonals_with_their_lengths(name: str) -> None:
    """Each patch of a sewn shell has its own; along them every cell is there, so that none runs over an opening."""
    plan = flat_plan(formed(name))
    found = plan.diagonals
    assert len(found) == (4 if name == "sewn" else 2)
    for a, b in found:
        for point in a + np.linspace(0.01, 0.99, 99)[:, None] * (b - a):
            near = np.abs(plan.marks - point).max(axis=1) < 1.001 * plan.spacing
            sides = np.sign(np.round(plan.marks[near] - point, 6))
            assert {(1, 1), (1, -1), (-1, 1), (-1, -1)} <= {
                (i or j, k or m) for i, k in sides for j in (1, -1) for m in (1, -1)
            }  # a joint in each quarter around it
    written = [text.text for text in flat_drawing(plan, plan.text).texts]
    for a, b in found:
        words, *others = (plan.rounding.mm(1e-3 * np.linalg.norm(d - c)) for c, d in [(a, b), *found])
        assert written.count(words) == others.count(words)


def apart(point: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """Distances (n,) from a point to lines (n, 2, 2)."""
    start, along = lines[:, 0], lines[:, 1] - lines[:, 0]
    share = np.clip(np.sum((point - start) * along, axis=1) / np.sum(along**2, axis=1), 0, 1)
    return np.linalg.norm(start + share[:, None] * along - point, axis=1)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "share"), [("dome", 0.7), ("roof", 1.0), ("opening", 1.0), ("sewn", 0.45)])
def test_numbers_of_braces_lie_on_no_rod_and_no_brace(name: str, share: float) -> None:
    """Nearly all of them find room, where cells are not too thin; between joints, rods are taken to be straight."""
    made = formed(name)
    drawing = bracing_drawing(made, FINER["bracing"] * flat_plan(made).text)
    braces = np.array([path.points for path in drawing.paths if "to" in path.note])
    numbers = [text for text in drawing.texts if text.layer == "LABEL"]
    assert len(numbers) >= share * len(braces)
    joints = joint_places(made, made.states[made.final or ""])
    rods = []
    for rod in rods_of(made):
        met = sorted(rod.joints, key=lambda joint: joint[1])
        places = [joints.get(f"{rod.id}/{other}", joints.get(f"{other}/{rod.id}")) for other, _ in met]
        rods += [(a[:2], b[:2]) for a, b in pairwise(places)]
    lines = np.concatenate([1e3 * np.array(rods), braces])
    assert [text.text for text in numbers if lines_meet(text.box(), lines)] == []
    lengths = [rounding_of(made.results).mm(one["final"]) for one in made.results.plain()["fabrication"]["bracing"]]
    for number in numbers:  # of the brace that it lies along: nearest to both ends of its text
        ends = 0.5 * (number.box()[[0, 1]] + number.box()[[3, 2]])
        off = np.max([apart(end, braces) for end in ends], axis=0)
        assert lengths[int(np.argmin(off))] == number.text


@pytest.mark.slow
@pytest.mark.parametrize(("name", "spans"), [("roof", ("12000", "8000")), ("dome", ("400.00", "400.00"))])
def test_elevations_give_dimensions_as_they_are_known(name: str, spans: tuple[str, str]) -> None:
    """Rod ends are some hundredths of a millimetre off the edge: to a ten-thousandth a roof of 12 by 8 m is that."""
    made = formed(name)
    plan = flat_plan(made)
    texts = [text.text for text in elevations_drawing(made, plan.text).texts]
    assert texts[0] == spans[0]
    assert texts[3] == spans[1]
    longer = {**made.states, made.final: made.states[made.final or ""] * 1.0002}
    assert elevations_drawing(replace(made, states=longer), plan.text).texts[0].text != spans[0]


def at_joint(drawing: Drawing, place: np.ndarray) -> str:
    """The level that stands to the upper right of a place, or ""."""
    corners = [(text.text, text.box()[0] - place) for text in drawing.texts if text.text[0] in "+-"]
    return next((text for text, off in corners if np.all((off >= 0) & (off < 0.5 * drawing.text))), "")


@pytest.mark.slow
@pytest.mark.parametrize(("name", "share"), [("pavilion", 0.9), ("roof", 0.8)])
def test_joints_and_rod_ends_have_their_levels_above_the_lowest_rod_end(name: str, share: float) -> None:
    made = named(name)
    shape, rounding = made.states[made.final or ""], rounding_of(made.results)
    drawing = supports_drawing(made, flat_plan(made).text)
    ends = shape[np.array([rod.nodes[[0, -1]] for rod in rods_of(made)]).ravel(), 2]
    places = joint_places(made, shape)
    levels = {joint: at_joint(drawing, 1e3 * place[:2]) for joint, place in places.items()}
    for joint, level in levels.items():
        if level:
            assert float(level) == pytest.approx(1e3 * (places[joint][2] - ends.min()), abs=0.501 * rounding.step)
    assert np.mean([bool(level) for level in levels.values()]) > share
    raised = [text.text for text in elevations_drawing(made, 10.0).texts if text.text[0] in "+\N{PLUS-MINUS SIGN}"]
    tops = {*(round(1e3 * (z - ends.min())) for z in (ends.min(), ends.max(), shape[:, 2].max()))}
    assert sorted({round(float(level.strip("\N{PLUS-MINUS SIGN}"))) for level in raised}) == sorted(tops)
    assert len(raised) == 2 * len(tops)


@pytest.mark.slow
def test_rod_ends_of_each_stage_are_joined_and_each_path_leads_through_its_stages() -> None:
    given, text = archive("dome"), 10.0
    drawing, history = erection_drawing(given, text), given.states["history"]
    ends = np.array([rod.nodes[[0, -1]] for rod in rods_of(given)]).ravel()
    places = 1e3 * history[:, ends, :2]
    joined = [line.points for line in drawing.paths if line.layer == "DIM" and line.closed]
    assert len(joined) == len(history) - 1
    for line, stage in zip(joined, places, strict=False):
        np.testing.assert_array_equal(np.unique(line, axis=0), np.unique(stage, axis=0))
        ways = np.linalg.norm(np.diff(line, axis=0, append=line[:1]), axis=1)
        assert ways.max() < 0.25 * np.ptp(stage)  # from end to end around the dome, not across it
    paths = [line.points for line in drawing.paths if line.layer == "DIM" and not line.closed]
    np.testing.assert_array_equal(paths, places.transpose(1, 0, 2))
    np.testing.assert_array_equal([mark.at for mark in drawing.marks], places[-1])


def test_rods_that_cover_each_other_in_an_elevation_are_drawn_once() -> None:
    given = archive("dome")
    drawn = [line.points for line in elevations_drawing(given, 10.0).paths if line.layer == "CUT"]
    assert len(drawn) < 2 * len(rods_of(given))
    ends = np.array([line[[0, -1]].ravel() for line in drawn])
    apart = np.abs(ends[:, None] - ends).max(axis=2)
    assert apart[~np.eye(len(ends), dtype=bool)].min() > SAME
    for curve in rod_curves(given, given.states[given.final]):  # the front elevation stands at the bottom
        seen = np.append(*(curve[[0, -1]][:, [0, 2]] - (0.0, given.states[given.final][:, 2].min() * 1e3)))
        assert np.abs(ends - seen).max(axis=1).min() < SAME


def test_strips_tell_each_distance_with_the_rod_that_is_met_there() -> None:
    plan = flat_plan(wished())
    texts = [text.text for text in strips_drawing(plan, plan.text).texts]
    told = [f"{plan.rounding.mm(at + 0.012)}  {other}" for rod in plan.rods for other, at in rod.joints]
    assert sorted(text for text in texts if text[-3:-2] in "UV") == sorted(told)


def test_equal_rods_are_one_strip_on_sheets_and_each_has_its_own_in_the_file_for_the_saw() -> None:
    """A dome and its grid have four mirror images: of each rod there are those of both families, at both sides."""
    made = archive("dome")
    plan = flat_plan(made)
    strips = [text.text for sheet in sheet_set(made)[0] if sheet.title.startswith("Rod strips") for text in sheet.texts]
    heads = [text.partition("   ")[0] for text in strips if "   cut " in text]
    groups = [re.findall("[UV][0-9]+", head) for head in heads]
    assert sorted(rod for ids in groups for rod in ids) == sorted(rod.id for rod in plan.rods)
    middle = (len(plan.rods) // 2 + 1) // 2
    sides = [[f"{family}{k:02d}" for family in "UV" for k in sorted({n, 2 * middle - n})] for n in range(1, middle + 1)]
    assert groups == sides
    times = "\N{MULTIPLICATION SIGN}"
    assert all(head.startswith(f"{len(ids)} {times} {ids[0]}") for head, ids in zip(heads, groups, strict=True))
    assert all("(layer 1), V" in head and head.endswith("(layer 2)") for head in heads)
    rods = {rod.id: rod for rod in plan.rods}
    for first, *others in groups:
        for other in others:
            assert rods[other].cut_length == pytest.approx(rods[first].cut_length, abs=1e-4)
            at = [[place for _, place in rods[name].joints] for name in (first, other)]
            assert at[0] == pytest.approx(at[1], abs=1e-4)
    alone = [text.text for text in strips_drawing(plan, plan.text).texts if "   cut " in text.text]
    assert [text.partition(" (")[0] for text in alone] == [rod.id for rod in plan.rods]


def test_a_rod_that_equals_another_when_turned_is_said_to_be_turned() -> None:
    """Holes at 1, 3 and 4 of 6 m, and from the other end; a third rod is off by 0.2 mm, a fourth has no such end."""
    holes = {"U01": (1.0, 3.0, 4.0), "U02": (2.0, 3.0, 5.0), "U03": (1.0, 3.0, 4.0002), "U04": (1.0, 3.00005, 4.0)}
    lines = [RodLine(id=name, family="u", offset=float(k), start=0.0, end=6.0, length=6.0,
                     joints=tuple(RodJoint(**{"with": f"V{n}", "at": at}) for n, at in enumerate(places)))
             for k, (name, places) in enumerate(holes.items())]  # fmt: skip
    rods = [GridRod(line, np.array([[0.0, 0.0], [6.0, 0.0]]), np.empty(0, dtype=np.intp)) for line in lines]
    plan = replace(flat_plan(archive("dome")), rods=rods, blanks={}, rounding=Rounding(1.0))
    assert plan.equal == {"U01": ["U01", "U02*", "U04"], "U03": ["U03"]}


def test_all_that_the_workshop_reads_measures_from_the_cut_end(tmp_path: Path) -> None:
    """Strips, both schedules, the PDF's tables and the pieces of stock: 12 mm of allowance before the rod's start."""
    made = wished()
    half = 0.501 * rounding_of(made.results).step
    export(made, tmp_path, ["dxf", "csv"])
    rods, joints, stock = (rows_of(tmp_path / f"schedule/{name}.csv") for name in ("rods", "joints", "stock"))
    pieces = {mark: length for row in stock for bar in row["marks"].split("; ")
              for mark, length in zip(bar.split(" + "), row["pieces_mm"].split("; "), strict=True)}  # fmt: skip
    tables = [one for one in sheet_set(made)[0] if re.match("(Rods|Joints)(,|$)", one.title)]
    printed = {word for sheet in tables for text in sheet.texts for word in text.text.split("; ")}
    entities = read_dxf(tmp_path / "drawings/strips.dxf")
    lines = sorted((one.points for one in entities if one.layer == "LASER"), key=lambda points: -points[0, 1])
    holes, saws = (
        np.array([one.points.mean(axis=0) for one in entities if one.layer == "MARK" and one.kind == kind])
        for kind in ("CIRCLE", "LINE")
    )
    for rod, row, line in zip(made.results.plain()["rods"], rods, lines, strict=True):
        assert line[1, 0] - line[0, 0] == pytest.approx(float(row["cut_length_mm"]), abs=half)
        met = {joint["with"]: 1e3 * joint["at"] + 12.0 for joint in rod["joints"]}
        cuts = 1e3 * np.array(rod["splices"]) + 12.0
        for marks, wanted in ((holes, sorted(met.values())), (saws, cuts)):
            np.testing.assert_allclose(np.sort(marks[np.abs(marks[:, 1] - line[0, 1]) < 1e-6, 0]), wanted, atol=half)
        listed = dict(word.split() for word in row["joints_from_cut_end_mm"].split("; "))
        assert {name: float(at) for name, at in listed.items()} == pytest.approx(met, abs=half)
        shown = [word for word in row["splices_from_cut_end_mm"].split("; ") if word]
        np.testing.assert_allclose([float(word) for word in shown], cuts, atol=half)
        lengths = [float(pieces[f"{rod['id']}.{k + 1}"]) for k in range(len(cuts) + 1)]
        np.testing.assert_allclose(np.cumsum(lengths)[:-1], cuts, atol=len(lengths) * half)
        ends = [(joint[f"rod_{b}"], joint[f"at_{a}_from_cut_end_mm"])
                for joint in joints for a, b in ("ab", "ba") if joint[f"rod_{a}"] == rod["id"]]  # fmt: skip
        assert {name: float(at) for name, at in ends} == pytest.approx(met, abs=half)
        assert {*shown, *(at for _, at in ends)} <= printed
    assert any(rod["splices"] for rod in made.results.plain()["rods"])


def rows_of(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(path.read_text(encoding="utf-8"))))


@pytest.mark.slow
def test_allowances_lengthen_the_cut_and_not_the_footprint(tmp_path: Path) -> None:
    export(wished(), tmp_path, ["dxf"])
    entities = read_dxf(tmp_path / "drawings/plan.dxf")
    cuts = [one.points for one in entities if one.layer == "LASER"]
    rods = wished().results.plain()["rods"]
    for cut, rod in zip(cuts, rods, strict=True):
        assert np.linalg.norm(cut[1] - cut[0]) == pytest.approx(1e3 * rod["length"] + 24.0, abs=1e-6)
    (footprint,) = (one.points for one in entities if one.layer == "BOUNDARY-FLAT")
    expected = {tuple(np.round(1e3 * np.array(point), 6)) for point in wished().results.plain()["footprint"]}
    assert {tuple(np.round(point, 6)) for point in footprint} == expected


@pytest.mark.parametrize(
    ("style", "reason"),
    [({"paper": "A5"}, "use A4, A3"), ({"layers": {"CUTS": "x"}}, "there are CUT, MARK"),
     ({"layers": {"CUT": "a*b"}}, "cannot be called"), ({"layers": {"CUT": " "}}, "cannot be called"),
     ({"layers": {"CUT": "mark"}}, 'two layers would be called "MARK"')],
)  # fmt: skip
def test_styles_that_no_file_can_hold_are_refused(style: dict, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        DrawingStyle(**style)


def test_options_that_make_no_sense_are_refused() -> None:
    with pytest.raises(InputError, match="strength must be positive"):
        OutputOptions(strength=0.0)
    with pytest.raises(InputError, match="stages must be a whole number, 0 to 1000, not -1"):
        OutputOptions(stages=-1)
