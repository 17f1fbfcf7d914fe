"""Blanks of curved laths and of strips with slots, against arcs, a clothoid and areas."""

from io import StringIO
from math import asin, cos, pi, sin
from typing import Any

import ezdxf
import numpy as np
import pytest
from scipy.special import fresnel

from rodshell.errors import OutputError
from rodshell.output.blanks import Blank, blanks_of, boards_of
from rodshell.output.drawing import Drawing
from rodshell.output.drawings.flat import flat_plan, sheets_of_strips, strips_drawing
from rodshell.output.dxf import drawing_dxf
from rodshell.output.grid import rods_of
from rodshell.output.schedules import joints_table, rods_table
from rodshell.results import Archive, Results
from tests.output.sample_archive import sample_archive

RADIUS, LENGTH, BREADTH, MORE = 1.5, 2.0, 0.06, 0.1
LATH = {"section": {"kind": "rectangle", "width": 0.002, "height": BREADTH}}
JOINTS = [{"with": "B", "at": 0.4}, {"with": "C", "at": 1.3}]


def archive(**rod: Any) -> Archive:
    """A rod "A" of 2 m with allowances of 0.1 m, which meets two others of the upper layer."""
    line = {"family": "free", "start": 0.0, "layer": 1}
    rods = [{**line, "id": "A", "end": LENGTH, "cut_length": LENGTH + 2 * MORE, "joints": JOINTS, **rod}]
    rods += [
        {**line, "id": name, "end": 1.0, "layer": 2, "joints": [{"with": "A", "at": 0.5}]} for name in "BC"
    ]  # fmt: skip
    return Archive(Results.of({"rod": LATH, "rods": rods}), {}, "")


def curved(at: Any, curvatures: Any, **rod: Any) -> Archive:
    return archive(rest_curvature={"at": list(at), "curvatures": list(curvatures)}, **rod)


def arc(sign: float = 1.0, **rod: Any) -> Archive:
    return curved([0.0, 0.7, LENGTH], [sign / RADIUS] * 3, **rod)


def area(outline: np.ndarray) -> float:
    (x, y), (x1, y1) = outline.T, np.roll(outline, -1, axis=0).T
    return float(0.5 * np.sum(x * y1 - x1 * y))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_blank_of_a_constant_curvature_is_a_sector_of_a_ring(sign: float) -> None:
    """Laid on its chord: both edges are arcs about one point, and the board is that of the sector."""
    blank = blanks_of(arc(sign))["A"]
    half = 0.5 * (LENGTH + 2 * MORE) / RADIUS
    inner, outer = RADIUS - 0.5 * BREADTH, RADIUS + 0.5 * BREADTH
    length, width = 2 * outer * sin(half), outer - inner * cos(half)
    assert blank.board == pytest.approx((length, width), abs=1e-5)  # chords between its points
    middle = (0.5 * length, outer if sign > 0 else width - outer)  # turning to the left it sags
    for edge, radius in zip(blank.edges, (outer, inner) if sign > 0 else (inner, outer), strict=True):
        np.testing.assert_allclose(np.hypot(*(edge - middle).T), radius, atol=1e-5)
    assert area(blank.outline) == pytest.approx(BREADTH * (LENGTH + 2 * MORE), rel=1e-5)  # of a ring
    assert blank.edges[:, 0, 0].max() < blank.edges[:, -1, 0].min()


def test_the_centre_line_of_a_clothoid_is_that_of_fresnel() -> None:
    """As far as its ends, beyond which the allowances go on as arcs."""
    blank = blanks_of(curved([0.0, LENGTH], [0.0, pi * LENGTH]))["A"]
    s = np.linspace(0.0, LENGTH, 41)
    exact, found = np.column_stack(fresnel(s)[::-1]), np.array([blank.at(at) for at in s])
    turn = np.linalg.lstsq(exact - exact.mean(axis=0), found - found.mean(axis=0), rcond=None)[0]
    np.testing.assert_allclose(turn @ turn.T, np.eye(2), atol=1e-4)  # a rotation
    assert np.linalg.det(turn) > 0
    np.testing.assert_allclose(found - found.mean(axis=0), (exact - exact.mean(axis=0)) @ turn, atol=2e-5)
    before = np.array([blank.at(LENGTH + at) for at in (0.0, 0.5 * MORE, MORE)])
    sides = np.linalg.norm(np.diff(before[[0, 1, 2, 0]], axis=0), axis=1)
    triangle = abs(area(before))
    assert 4 * triangle / sides.prod() == pytest.approx(pi * LENGTH, rel=1e-3)  # curvature of the circle through them


def test_a_board_is_as_narrow_as_can_be() -> None:
    """Of a lath whose ends hook to one side, whose chord is no side of its narrowest board."""
    blank = blanks_of(curved([0.0, 1.5, 1.6, LENGTH], [0.0, 0.0, 3.0, 3.0]))["A"]
    angles = np.linspace(0.0, pi, 2001)
    widths = np.ptp(blank.outline @ [-np.sin(angles), np.cos(angles)], axis=0)
    assert blank.board[1] == pytest.approx(widths.min(), abs=1e-4)
    np.testing.assert_allclose(blank.outline.min(axis=0), 0.0, atol=1e-12)


def drawn(found: Archive) -> Drawing:
    plan = flat_plan(found)
    return strips_drawing(plan, 8.0, plan.rods[:1])


def test_holes_splices_and_texts_are_at_their_stations_along_the_blank() -> None:
    """On an arc, where a distance along the centre line is an angle."""
    drawing = drawn(arc(splices=[0.9]))
    outline = next(path for path in drawing.paths if path.name == "A")
    assert outline.closed
    points = outline.points - outline.points.min(axis=0)
    half, outer = 0.5 * (LENGTH + 2 * MORE) / RADIUS, RADIUS + 0.5 * BREADTH
    middle = 1e3 * np.array([outer * sin(half), outer])
    low = outline.points.min(axis=0)

    def station(point: np.ndarray) -> float:
        x, y = point - low - middle
        return 1e3 * RADIUS * (half + asin(x / np.hypot(x, y)))

    holes = [mark.at for mark in drawing.marks]
    np.testing.assert_allclose([station(at) for at in holes], [500.0, 1400.0], atol=0.05)
    np.testing.assert_allclose([np.hypot(*(at - low - middle)) for at in holes], 1e3 * RADIUS, atol=0.02)
    splice = next(path.points for path in drawing.paths if path.layer == "MARK" and len(path.points) == 2)
    np.testing.assert_allclose([station(at) for at in splice], 1000.0, atol=0.05)
    assert np.linalg.norm(splice[1] - splice[0]) == pytest.approx(1e3 * BREADTH, abs=0.01)
    words = {text.text for text in drawing.texts}
    assert {"500.000  B", "1400.000  C", "1000.000  S", "100.000", "2200.000"} <= words
    assert any("board" in text for text in words)
    assert points[:, 1].max() < min(text.at[1] for text in drawing.texts if text.angle) - low[1]


def test_strips_of_a_dxf_are_cut_along_the_outline() -> None:
    found = arc()
    read = ezdxf.read(StringIO(drawing_dxf(drawn(found))))
    (cut,) = read.modelspace().query('LWPOLYLINE[layer=="CUT"]')
    assert cut.closed
    points = np.array([point[:2] for point in cut.get_points()])
    assert area(points) == pytest.approx(1e6 * BREADTH * (LENGTH + 2 * MORE), rel=1e-5)


def test_the_schedule_has_the_board_of_each_piece() -> None:
    """From cut end to splice and on: sectors of a ring; of a straight rod there is none."""
    found = arc(splices=[0.9])
    rods = rods_of(found)
    boards = list(boards_of(found, rods[0]))
    for board, piece in zip(boards, (1.0, 1.2), strict=True):
        half = 0.5 * piece / RADIUS
        inner, outer = RADIUS - 0.5 * BREADTH, RADIUS + 0.5 * BREADTH
        assert board == pytest.approx((2 * outer * sin(half), outer - inner * cos(half)), abs=1e-5)
    cells = rods_table(found)["boards_mm"]
    assert cells[0].count(" x ") == 2
    assert cells[1:] == ["", ""]
    assert "boards_mm" not in rods_table(sample_archive())
    assert not blanks_of(sample_archive())


def test_a_lath_that_is_broader_where_it_is_stiffer_has_a_blank_of_that_breadth() -> None:
    along = {"at": [0.0, LENGTH], "factors": [1.0, 3.0], "varies": "height", "sizes": [BREADTH, 3 * BREADTH]}
    blank = blanks_of(arc(stiffness=along))["A"]
    for at, breadth in ((0.0, BREADTH), (1.0, 2 * BREADTH), (LENGTH, 3 * BREADTH)):
        right, left = blank.across(at)
        assert np.hypot(*(left - right)) == pytest.approx(breadth, rel=2e-3)  # linear between points at a kink


def slotted() -> Archive:
    joints = [{"with": "B", "at": 0.4, "slot": 0.004}, {"with": "C", "at": 1.3, "slot": 0.007}]
    found = archive(joints=joints).results.plain()
    found["rod"] = {"section": {"kind": "rectangle", "width": 0.05, "height": 0.002}}
    found["rods"][1]["joints"][0]["slot"] = 0.004
    found["fabrication"] = {"slot_depth": 0.026}
    return Archive(Results.of(found), {}, "")


def test_the_lower_strip_is_slotted_from_above_and_the_upper_from_below() -> None:
    blanks: dict[str, Blank] = blanks_of(slotted())
    strip = blanks["A"].outline
    assert area(strip) == pytest.approx((LENGTH + 2 * MORE) * 0.05 - 0.026 * (0.004 + 0.007), abs=1e-12)
    inside = strip[(strip[:, 1] > 0) & (strip[:, 1] < 0.05)]
    np.testing.assert_allclose(inside[:, 1], 0.05 - 0.026)
    np.testing.assert_allclose(np.sort(inside[:, 0]), [0.498, 0.502, 1.3965, 1.4035])
    other = blanks["B"].outline
    np.testing.assert_allclose(other[(other[:, 1] > 0) & (other[:, 1] < 0.05), 1], 0.026)
    assert "C" not in blanks
    found = drawn(slotted())
    assert {"500.000  B  slot 4.000", "1400.000  C  slot 7.000"} <= {text.text for text in found.texts}
    assert not found.marks
    assert joints_table(slotted())["slot_mm"] == ["4.000", "7.000"]
    assert "slot_mm" not in joints_table(sample_archive())


def test_sheets_have_room_for_each_strip_and_straight_ones_are_as_many_as_before() -> None:
    plan, text = flat_plan(sample_archive()), 3.5
    for height in (100.0, 200.0, 57.0):
        count = max(int((height / text - 3) // 15.0), 1)
        assert [len(group) for group in sheets_of_strips(plan, height, text)][:-1] == [count] * (
            (len(plan.equal) - 1) // count
        )
    tall = 1e3 * blanks_of(arc())["A"].board[1]
    groups = sheets_of_strips(flat_plan(arc()), tall + 25 * text, text)
    assert [[rod.id for rod in group] for group in groups] == [["A"], ["B"]]


@pytest.mark.parametrize(
    ("at", "curvatures", "says"),
    [
        ([0.0, 1.0], [0.1], "2 stations and 1 curvatures"),
        ([0.0], [0.1], "two or more"),
        ([0.0, 0.0, 1.0], [0.1, 0.1, 0.1], "the stations must ascend"),
    ],
)
def test_a_curvature_that_is_no_curve_is_refused(at: Any, curvatures: Any, says: str) -> None:
    with pytest.raises(OutputError, match=rf"rods\[0\].rest_curvature.*{says}"):
        curved(at, curvatures)


def test_lengths_of_slots_and_sections_that_no_drawing_can_show_are_refused() -> None:
    for table, key, value in ((("fabrication",), "slot_depth", -1.0), (("rod", "section"), "height", 1e20)):
        found = slotted().results.plain()
        inner = found
        for name in table:
            inner = inner[name]
        inner[key] = value
        with pytest.raises(OutputError, match=r"rod.section or fabrication.slot_depth has a length"):
            Results.of(found)
    found = slotted().results.plain()
    found["rods"][0]["joints"][0]["slot"] = 1e9
    with pytest.raises(OutputError, match=r"rods\[0\] has a length that is not from"):
        Results.of(found)


def test_a_curved_rod_of_an_unknown_section_has_its_centre_line() -> None:
    found = curved([0.0, LENGTH], [0.0, 0.0]).results.plain()
    del found["rod"]
    (blank,) = blanks_of(Archive(Results.of(found), {}, "")).values()
    assert blank.board == pytest.approx((LENGTH + 2 * MORE, 0.0), abs=1e-9)
