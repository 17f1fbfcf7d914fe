"""SVG and PNG files, what they are drawn from, and pictures of a shell."""

import io
import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from rodshell.geometry.boxes import lines_meet
from rodshell.output.colour_scale import ABOVE, BINS, mixed, scale_of
from rodshell.output.drawing import BELOW, LETTER, LINE, Drawing, Mark, Path, Pen, Pencil, Text
from rodshell.output.grid import rods_of, shape_of
from rodshell.output.labels import Room
from rodshell.output.pictures import DEPTHS, PAPER, deployment_picture, picture
from rodshell.output.png import drawing_png
from rodshell.output.svg import drawing_svg, number
from rodshell.results import Archive, Results
from tests.output.forms import archive as archive_of
from tests.output.forms import formed, found
from tests.output.sample_archive import sample_archive

numbers = st.floats(-1e6, 1e6).map(lambda x: float(np.round(x, 4))) | st.sampled_from([0.0, -0.001, 100.0, -0.5, 1.005])


def test_the_deployment_of_a_target_far_from_the_origin_is_drawn_alike() -> None:
    """The flat grid with its middle at the origin, too."""
    made = archive_of("dome")
    aside = {
        name: values + (3.0, -5.0, 0.25) if values.ndim > 1 and values.shape[-1] == 3 and name != "flat" else values
        for name, values in made.states.items()
        if name != "target_faces"
    }
    here, there = deployment_picture(made), deployment_picture(replace(made, states=aside))
    edges = [np.linalg.norm(np.diff(path.points, axis=0), axis=1) for path in here.paths if path.layer == "CUT"]
    assert 3 < np.median(np.concatenate(edges)) < 7  # the nodes are 2 units apart
    assert len(here.paths) == len(there.paths)
    for one, other in zip(here.paths, there.paths, strict=True):
        np.testing.assert_allclose(other.points, one.points, atol=1e-6)


def test_a_png_is_read_back_pixel_by_pixel() -> None:
    """Half of it red, and a line of text that has both inks in it."""
    pencil = Pencil()
    pencil.line([(0, 0), (40, 0), (40, 20), (0, 20)], "TITLE", closed=True, pen=Pen("#ffffff", 0.0, fill="#ffffff"))
    pencil.line([(0, 0), (20, 0), (20, 20), (0, 20)], "TITLE", closed=True, pen=Pen("#ff0000", 0.0, fill="#ff0000"))
    data = drawing_png(pencil.done("", "", 2.0), width=80)
    with Image.open(io.BytesIO(data)) as image:
        image.verify()
    with Image.open(io.BytesIO(data)) as image:
        pixels = np.asarray(image.convert("RGB"))
    assert pixels.shape == (40, 80, 3)
    assert (pixels[:, :39] == (255, 0, 0)).all()
    assert (pixels[:, 42:] == 255).all()


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.1])
def test_no_seam_shows_between_two_lines_that_follow_each_other(angle: float) -> None:
    """Ten pieces of one line, ending within pixels, are as dark as the line in one piece."""
    along = np.array([np.cos(angle), np.sin(angle)])
    at = np.linspace(-19.0, 19.0, 11)[:, None] * along
    pencil = Pencil()
    pencil.line([(-20, -20), (20, -20), (20, 20), (-20, 20)], "CUT", closed=True, pen=Pen("#ffffff", 0, fill="#ffffff"))
    for piece in pairwise(at):
        pencil.line(piece, "CUT", pen=Pen("#000000", 2.0))
    with Image.open(io.BytesIO(drawing_png(pencil.done("", "", 2.0), width=131))) as image:
        pixels = np.asarray(image.convert("L"))
    middle = np.linspace(-18.0, 18.0, 400)[:, None] * along
    column, row = (131 / 40 * (middle + 20)).T.astype(int)
    assert pixels[130 - row, column].max() < 40


@given(st.lists(st.tuples(numbers, numbers), min_size=2, max_size=6))
def test_numbers_of_svg_paths_are_as_short_as_can_be(points: list[tuple[float, float]]) -> None:
    drawing = Drawing("", "", 2.0, paths=(Path(np.array(points), "DIM"),))
    data = re.search(r' d="M([^"]*)"', drawing_svg(drawing))
    assert data is not None
    shown = [text for pair in data[1].split("L") for text in pair.split(" ")]
    for text, value in zip(shown, [value for x, y in points for value in (x, -y)], strict=True):
        assert text == number(float(text))
        assert abs(float(text) - value) <= 0.005 + 1e-9  # to either side where it lies halfway


@given(st.floats(-3, 3), st.sampled_from(["start", "middle", "end"]), numbers, numbers)
def test_the_box_of_a_text_is_a_rectangle_turned_about_its_place(angle: float, anchor: str, x: float, y: float) -> None:
    text = Text("seven ch", np.array([x, y]), 2.0, "LABEL", anchor=anchor, angle=angle)  # type: ignore[arg-type]
    width = 8 * 2.0 * LETTER
    left = {"start": 0.0, "middle": -0.5, "end": -1.0}[anchor] * width
    flat = np.array([[left, -2 * BELOW], [left + width, -2 * BELOW], [left + width, 2 * (LINE - BELOW)],
                     [left, 2 * (LINE - BELOW)]])  # fmt: skip
    turned = flat @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    np.testing.assert_allclose(text.box(), turned + [x, y], atol=1e-9)


def test_a_drawing_that_is_placed_keeps_what_does_not_change_and_scales_the_rest() -> None:
    pen = Pen("#123456", 0.5, (1.0, 2.0), "#abcdef")
    path, space = Path(np.eye(2), "CUT", True, pen, "U01", "a note"), Path(np.eye(3), "CUT")
    mark, text = Mark(np.ones(2), 3.0, "MARK", pen, "another"), Text("words", np.ones(2), 2.0, "LABEL", "end", 0.3)
    placed = Drawing("n", "t", 2.0, (path, space), (mark,), (text,)).placed(2.0, np.array([10.0, 0.0]))
    wide = Pen("#123456", 1.0, (2.0, 4.0), "#abcdef")
    assert (placed.name, placed.title, placed.text) == ("n", "t", 4.0)
    (line,), (ring,), (word,) = placed.paths, placed.marks, placed.texts
    np.testing.assert_array_equal(line.points, 2 * np.eye(2) + [10.0, 0.0])
    assert (line.layer, line.closed, line.pen, line.name, line.note) == ("CUT", True, wide, "U01", "a note")
    np.testing.assert_array_equal(ring.at, [12.0, 2.0])
    assert (ring.radius, ring.layer, ring.pen, ring.note) == (6.0, "MARK", wide, "another")
    np.testing.assert_array_equal(word.at, [12.0, 2.0])
    assert (word.text, word.size, word.anchor, word.angle) == ("words", 4.0, "end", 0.3)


@given(st.lists(st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(0.1, 30), st.floats(0.1, 30)), max_size=8))
def test_a_box_is_free_unless_it_meets_one_that_was_taken(boxes: list[tuple[float, float, float, float]]) -> None:
    room, taken = Room(7.0), list[tuple[float, float, float, float]]()
    for x, y, width, height in boxes:
        corners = np.array([[x, y], [x + width, y], [x + width, y + height], [x, y + height]])
        apart = [x >= a + w or a >= x + width or y >= b + h or b >= y + height for a, b, w, h in taken]
        assert room.free(corners) == all(apart)
        room.take(corners)
        taken.append((x, y, width, height))


@given(st.floats(-3, 3), st.lists(st.floats(-3, 3), min_size=4, max_size=4))
def test_a_line_meets_a_box_where_one_of_its_points_lies_inside(angle: float, ends: list[float]) -> None:
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    line = np.array(ends).reshape(2, 2)
    box = np.array([[-1.5, -0.5], [1.5, -0.5], [1.5, 0.5], [-1.5, 0.5]])
    along = line[0] + np.linspace(0, 1, 2001)[:, None] * (line[1] - line[0])
    beyond = np.max(np.abs(along) - (1.5, 0.5), axis=1).min()  # how far the best of the points is outside
    if abs(beyond) > 0.005:  # no longer than a step between two points
        assert lines_meet(box @ turn + 7.0, line[None] @ turn + 7.0) == (beyond < 0)


@pytest.mark.parametrize("state", ["flat", "popped_pinned"])
def test_a_picture_draws_every_rod_whole_and_once_over_a_halo(state: str) -> None:
    archive = sample_archive(5)
    shape = picture(archive, state)
    rods = [path for path in shape.paths if path.layer == "CUT" and path.pen]
    halo, ink = ([path for path in rods if path.pen and (path.pen.colour == PAPER) == paper] for paper in (True, False))
    lengths = [sum(np.linalg.norm(np.diff(path.points, axis=0), axis=1).sum() for path in some) for some in (halo, ink)]
    nodes = {tuple(point) for path in ink for point in np.round(path.points, 9)}
    assert len(nodes) == len(np.unique(archive.states["rod_nodes"]))
    assert lengths[0] == pytest.approx(lengths[1], rel=1e-12)
    pieces = sum(len(path.points) - 1 for path in ink)
    assert pieces == sum(len(rod.nodes) - 1 for rod in rods_of(archive))
    assert len({path.pen.width for path in ink if path.pen}) <= DEPTHS
    assert len(ink) >= len(rods_of(archive))


def covered_of_rods(archive: Archive, state: str) -> float:
    """Share of the points on drawn rods that are as light as paper in the PNG."""
    shape = picture(archive, state)
    pixels = np.asarray(Image.open(io.BytesIO(drawing_png(shape, 1600))).convert("RGB"), dtype=int)
    (left, _), (right, top) = shape.box()
    scale = pixels.shape[1] / (right - left)
    rods = [path.points for path in shape.paths if path.layer == "CUT" and path.pen and path.pen.colour != PAPER]
    share = np.linspace(0.1, 0.9, 9)[:, None]
    points = np.concatenate([a + share * (b - a) for rod in rods for a, b in pairwise(rod)])
    column, row = (scale * (points - (left, top)) * (1, -1)).astype(int).T
    return float(np.mean(pixels[row, column].min(axis=1) > 225))


@pytest.mark.slow
def test_rods_are_set_off_only_against_what_they_pass_over() -> None:
    """On the flat grid no rod is broken at a joint; the back of a dome is, where the front passes over it."""
    archive = sample_archive(25, 4)
    assert covered_of_rods(archive, "flat") < 2e-4  # a point or two of 18,000 at soft ends of lines
    assert covered_of_rods(archive, "popped_clamped") > 0.01


@pytest.mark.parametrize(("rise", "filled"), [(0.0, True), (0.03, False)])
def test_only_a_level_edge_is_filled(rise: float, filled: bool) -> None:
    """An edge that rises by 3 % of its width would look like a surface."""
    archive = sample_archive(9)
    tilted = archive.states["popped_clamped"].copy()
    tilted[:, 2] += rise * tilted[:, 0]
    shape = picture(replace(archive, states={**archive.states, "popped_clamped": tilted}), "popped_clamped")
    (edge,) = (path for path in shape.paths if path.layer == "BOUNDARY-FINAL")
    assert edge.pen is not None
    assert bool(edge.pen.fill) == filled


def test_all_shapes_share_one_scale_of_stress_and_say_their_own_largest() -> None:
    plain = sample_archive(5)
    count = len(plain.states["rod_nodes"])
    stages = np.array([0.0, 2e6, 9e6, 4e6])
    states = {
        **plain.states,
        "stress_pinned": np.full(count, 3e6),
        "history": np.tile(plain.states["draped"], (4, 1, 1)),
        "history_share": np.linspace(0, 1, 4),
        "history_stress": stages[:, None] * np.ones(count),
    }
    archive = replace(plain, states=states)
    found = {
        name: scale_of(archive, shape_of(archive, name), "stress") for name in ("popped_pinned", "stage_1", "stage_2")
    }
    limits = {name: (scale.high, scale.caption) for name, scale in found.items() if scale}
    assert limits == {
        "popped_pinned": (10.0, "stress in MPa, here up to 3"),
        "stage_1": (10.0, "stress in MPa, here up to 2"),
        "stage_2": (10.0, "stress in MPa, here up to 9"),
    }


def test_utilisation_says_by_which_strength_it_is_counted() -> None:
    dome = archive_of("dome")
    bending = dome.results.bending
    assert bending is not None
    for erection, said in ((2e4, (", permanent", ", erection")), (1e4, ("", ""))):
        known = bending.model_copy(update={"strength": 1e4, "erection_strength": erection})
        archive = replace(dome, results=dome.results.model_copy(update={"bending": known}))
        for name, strength, which in zip(("popped_pinned", "stage_1"), (1e4, erection), said, strict=True):
            shape = shape_of(archive, name)
            scale = scale_of(archive, shape, "stress")
            assert scale is not None
            largest = 100 * shape.known["stress"].max() / strength
            said_above = ", above 100 in magenta" if scale.above else ""
            assert scale.caption == f"utilisation in %{which}, here up to {largest:.3g}{said_above}"
            assert scale.values.max() == pytest.approx(largest)


def test_colours_end_at_all_of_the_strength_and_what_is_above_has_its_own() -> None:
    dome = archive_of("dome")
    shape, bending = shape_of(dome, "popped_pinned"), dome.results.bending
    assert bending is not None
    stress = shape.known["stress"]
    for share in (0.5, 1.7):
        strength = float(stress.max()) / share
        known = bending.model_copy(update={"strength": strength, "erection_strength": 1e3 * strength})
        scale = scale_of(replace(dome, results=dome.results.model_copy(update={"bending": known})), shape, "stress")
        assert scale is not None
        over = stress > strength
        assert scale.high == 100 if share > 1 else scale.high <= 100
        assert len(scale.palette) == BINS
        assert np.any(over) == (share > 1)
        assert np.array_equal(scale.bins == BINS - 1, over) or share < 1
        assert (scale.palette[-1] == ABOVE) == (share > 1)
        assert ABOVE not in scale.palette[:-1]


@pytest.mark.parametrize(("gap", "unit", "high"), [(3.3e-5, "mm", 0.04), (0.8, "mm", 800.0), (2.4, "m", 3.0)])
def test_gaps_are_shown_in_a_unit_of_their_size(gap: float, unit: str, high: float) -> None:
    plain = sample_archive(5)
    gaps = np.zeros(len(plain.states["draped"]))
    gaps[7] = -gap
    states = {name: values for name, values in plain.states.items() if not name.startswith("gap_")}
    archive = replace(
        plain, states={**states, "gap_draped": gaps}, results=Results.of({**plain.results.plain(), "agreement": {}})
    )
    scale = scale_of(archive, shape_of(archive, "draped"), "gap")
    assert scale is not None
    assert scale.caption == f"gap to target in {unit}, + outside"
    assert (scale.low, scale.high) == pytest.approx((-high, high))
    assert np.abs(scale.values).max() == pytest.approx(gap if unit == "m" else 1e3 * gap)


def test_what_is_made_of_an_archive_is_made_again_for_another() -> None:
    first = sample_archive(5)
    second = replace(first, results=first.results.changed(rods=first.results.rods[:3]))
    assert rods_of(first) is rods_of(first)
    assert len(rods_of(first)) == 10
    assert len(rods_of(second)) == 3
    assert first == replace(second, results=first.results)


def test_mixed_colours_lie_between() -> None:
    assert mixed("#1f5f8b", "#fdfdfb", 0.0) == "#1f5f8b"
    assert mixed("#1f5f8b", "#fdfdfb", 1.0) == "#fdfdfb"
    assert mixed("#004080", "#80c000", 0.25) == "#206060"


@pytest.mark.slow
def test_a_kept_archive_is_what_the_program_finds_today() -> None:
    """Tests of writers read it; `python -m tests.output.forms` makes it again."""
    kept, now = formed("sewn"), found("sewn")
    assert set(kept.states) == set(now.states)
    for name in ("flat", "popped_pinned", "popped_clamped"):
        np.testing.assert_allclose(kept.states[name], now.states[name], atol=1e-9)  # of a dome of .2 m
