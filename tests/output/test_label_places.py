"""Where names stand, by the geometry of whole drawings and of openings made at random: clear of all, near their own."""

from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rodshell.geometry.boxes import boxes_meet, lines_meet
from rodshell.output.drawing import LETTER, LINE, Drawing
from rodshell.output.drawings.flat import FlatPlan, flat_drawing, flat_plan
from rodshell.output.drawings.sheets import fitted
from rodshell.output.drawings.shell import supports_drawing
from rodshell.output.labels import Label, Room, callouts, outward
from rodshell.results import Archive
from tests.output.forms import formed
from tests.output.sample_archive import table_archive
from tests.output.test_callouts import cross, off

Floats = NDArray[np.float64]

NAMES = ("oval", "roof", "opening", "sewn", "table")


def named(name: str) -> tuple[Archive, FlatPlan]:
    made = table_archive() if name == "table" else formed(name)
    return made, flat_plan(made)


def leaders(drawing: Drawing, ends: Floats) -> list[Floats]:
    """The lines of a drawing that begin at an end and lead to a text."""
    lines = [path.points for path in drawing.paths if path.layer == "DIM" and path.flat and not path.pen]
    return [line for line in lines if np.linalg.norm(ends - line[0], axis=1).min() < 1e-6]


@pytest.mark.slow
@pytest.mark.parametrize("share", [1.0, 0.6], ids=["usual size", "small"])
@pytest.mark.parametrize("name", NAMES)
def test_texts_of_the_flat_plan_lie_on_no_rod(name: str, share: float) -> None:
    """Neither rods' names nor joints'."""
    _, plan = named(name)
    drawing = flat_drawing(plan, share * plan.text)
    texts = [text for text in drawing.texts if text.layer == "LABEL"]
    assert [text.text for text in texts if lines_meet(text.box(), plan.cuts)] == []
    assert {rod.id for rod in plan.rods} <= {text.text for text in texts}


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_no_two_leaders_of_the_flat_plan_cross_nor_run_through_a_name(name: str) -> None:
    _, plan = named(name)
    drawing = flat_drawing(plan, plan.text)
    lines = leaders(drawing, plan.cuts.reshape(-1, 2))
    assert [1 for a, b in combinations(lines, 2) if cross(a, b)] == []
    boxes = [text.box() for text in drawing.texts if text.layer == "LABEL"]
    for line in lines:
        along = np.concatenate([a + np.linspace(0, 0.99, 40)[:, None] * (b - a) for a, b in pairwise(line)])
        assert min(float(off(box, along).min()) for box in boxes) > 0.0
        assert np.linalg.norm(np.diff(line, axis=0), axis=1).sum() < 8 * plan.text


@pytest.mark.slow
@pytest.mark.parametrize("name", ["oval", "roof", "opening", "sewn"])
def test_ids_of_joints_can_be_read_on_the_sheet(name: str) -> None:
    """Capitals of 1.8 mm or more, each nearer to its own joint than to any other, and of most joints at 1:1."""
    _, plan = named(name)
    at = {joint.id: mark for joint, mark in zip(plan.joints, plan.marks, strict=True)}
    whole, scale = fitted(lambda size: flat_drawing(plan, size), np.zeros(2), (420.0, 297.0))
    for text in whole.texts:
        assert text.text not in at or 0.718 * text.size / scale >= 1.8
    drawing = flat_drawing(plan, plan.text)
    written = [text for text in drawing.texts if text.text in at]
    assert len(written) > 0.8 * len(plan.joints)
    for text in written:
        assert text.size >= 0.749 * plan.text
        nearest = off(text.box(), plan.marks).argmin()
        assert plan.joints[int(nearest)].id == text.text


def turns(outline: Floats) -> Floats:
    """Angles [rad] by which a closed curve turns at its places, to the left positive."""
    along = np.roll(outline, -1, axis=0) - outline
    way = np.arctan2(along[:, 1], along[:, 0])
    return np.asarray((way - np.roll(way, 1) + np.pi) % (2 * np.pi) - np.pi)


@pytest.mark.slow
def test_the_edge_of_a_sewn_shell_has_no_notches_at_its_seam() -> None:
    """Around a dome of two patches it is convex, passes every rod end that is not sewn once, and no seam."""
    made, plan = named("sewn")
    drawing = supports_drawing(made, plan.text)
    (edge,) = (path.points for path in drawing.paths if path.layer == "BOUNDARY-FINAL" and path.closed)
    meetings = 1e3 * np.array([one["point"][:2] for seam in made.results.plain()["seams"] for one in seam["meetings"]])
    assert len(edge) + 2 * len(meetings) == 2 * len(plan.rods)
    apart = np.linalg.norm(edge - np.roll(edge, 1, axis=0), axis=1) > 1.0
    smooth = edge[apart]  # places within a millimetre have no direction
    assert turns(smooth).min() > -np.radians(2)
    assert turns(smooth).sum() == pytest.approx(2 * np.pi)
    seams = [path.points for path in drawing.paths if path.layer == "BOUNDARY-FINAL" and not path.closed]
    for seam in seams:
        assert np.linalg.norm(seam[:, None] - meetings, axis=2).min(axis=1).max() < 1.0


@pytest.mark.slow
@settings(max_examples=25, deadline=None, derandomize=True)
@example(count=4, size=1.0, long=1.0, letters=3, seed=0)  # two ends side by side, whose lines lean to each other
@given(st.integers(4, 24), st.floats(0.24, 1.28), st.floats(1.0, 2.5), st.integers(3, 7), st.integers(0, 99))
def test_names_around_any_opening_are_clear_and_near(
    count: int, size: float, long: float, letters: int, seed: int
) -> None:
    """An oval opening at whose rim rods end at random, with names far too large for it or not."""
    rng = np.random.default_rng(seed)
    turn = np.sort(rng.uniform(0, 2 * np.pi, count))[::-1]  # clockwise: its inside is on the right
    way = np.column_stack([np.cos(turn), np.sin(turn)])
    places = 10 * way * (long, 1.0)
    rods = np.stack([places, places + 30 * way], axis=1)
    names = [f"R{k:02d}".ljust(letters, "a") for k in range(count)]
    found = callouts(names, places, outward(places), size, Room(4 * size), rods)
    boxes = [one.written.box() for one in found]
    assert {one.written.text for one in found} == set(names)
    assert not [1 for a, b in combinations(boxes, 2) if boxes_meet(a, b[None])]
    assert not [1 for box in boxes if lines_meet(box, rods)]
    apart = [(a.line, b.line) for a, b in combinations(found, 2) if np.linalg.norm(a.line[0] - b.line[0]) > size]
    assert not [1 for a, b in apart if cross(a, b)]
    for one, place in zip(found, places, strict=True):
        assert np.array_equal(one.line[0], place)
        assert off(one.written.box(), place) < 22 * size
        assert one.written.size >= 0.749 * size


@pytest.mark.parametrize("angle", [0.0, 0.4, -1.1, np.pi / 2])
def test_a_line_to_a_label_ends_where_its_room_is_nearest(angle: float) -> None:
    size, centre = 3.0, np.array([2.0, -1.0])
    half = 0.5 * size * np.array([LETTER * 4 + 0.2, LINE])
    u, v = (axis.ravel() for axis in np.meshgrid(np.linspace(-1, 1, 401), np.linspace(-1, 1, 401)))
    along = np.array([np.cos(angle), np.sin(angle)])
    room = centre + (half[0] * u)[:, None] * along + (half[1] * v)[:, None] * np.array([-along[1], along[0]])
    for end in np.array([[9.0, 3.0], [-7.0, 2.0], [1.0, -9.0], [3.0, 8.0]]):
        first, last = Label("U01a", centre, angle, end, moved=True).leader(size)
        np.testing.assert_array_equal(first, end)
        nearest = room[np.linalg.norm(room - end, axis=1).argmin()]
        np.testing.assert_allclose(last, nearest, atol=0.02 * size)
