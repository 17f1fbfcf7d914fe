"""Names on the support plan and the flat plan: each leads to its own place, whatever the outline."""

from itertools import combinations, pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from rodshell.geometry.boxes import boxes_meet, lines_meet
from rodshell.output.drawing import Drawing, Text
from rodshell.output.drawings.flat import flat_drawing, flat_plan
from rodshell.output.drawings.shell import supports_drawing
from rodshell.output.labels import Room, callouts, outward
from rodshell.results import Archive
from tests.output.forms import formed

pytestmark = pytest.mark.slow

Floats = NDArray[np.float64]

TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])
NAMES = ("dome", "oval", "roof", "opening", "sewn")


def off(box: Floats, points: Floats) -> Floats:
    """How far points (..., 2) are from a rectangle (4, 2)."""
    sides = box[[1, 3]] - box[0]
    lengths = np.linalg.norm(sides, axis=1)
    at = (points - box[0]) @ (sides / lengths[:, None]).T
    return np.linalg.norm(np.maximum(np.maximum(-at, at - lengths), 0.0), axis=-1)


def cross(a: Floats, b: Floats) -> bool:
    """Whether two polylines (k, 2) cross, their ends not counted."""

    def side(p: Floats, q: Floats, r: Floats) -> float:
        return float((q - p)[0] * (r - p)[1] - (q - p)[1] * (r - p)[0])

    return any(
        side(p, q, r) * side(p, q, s) < 0 and side(r, s, p) * side(r, s, q) < 0
        for p, q in pairwise(a)
        for r, s in pairwise(b)
    )


def read_from(drawing: Drawing, place: Floats, labels: list[Text]) -> set[str]:
    """The names that a reader finds for a place: where the lines that begin there end, or else the nearest."""
    lines = [path.points for path in drawing.paths if path.layer == "DIM" and path.flat]
    ends = [line[-1] for line in lines if np.linalg.norm(line[0] - place) < 1e-6] or [place]
    return {min(labels, key=lambda label: float(off(label.box(), end))).text for end in ends}


def supports_of(made: Archive) -> dict[str, Floats]:
    """Where each rod end that is not sewn goes [mm], by its name."""
    sewn = {end for seam in made.results.plain().get("seams") or [] for one in seam["meetings"] for end in one["ends"]}
    names = [f"{rod['id']}.{end}" for rod in made.results.plain()["rods"] for end in (0, 1)]
    places = 1e3 * np.array(made.results.plain()["boundary"])[:, :2]
    return {name: place for name, place in zip(names, places, strict=True) if name not in sewn}


@pytest.mark.slow
@pytest.mark.parametrize("share", [1.0, 0.6], ids=["usual size", "small"])
@pytest.mark.parametrize("name", NAMES)
def test_every_support_is_read_by_its_own_name(name: str, share: float) -> None:
    """Supports within a millimetre of each other may be read for one another: no drawing tells them apart."""
    made = formed(name)
    plan, supports = flat_plan(made), supports_of(made)
    drawing = supports_drawing(made, share * plan.text)
    ends = np.array([made.states[made.final or ""][rod.nodes[[0, -1]], :2] for rod in plan.rods]).reshape(-1, 2)
    labels = [text for text in drawing.texts if text.text in supports]
    assert sorted(text.text for text in labels) == sorted(supports)
    misread = []
    for own, asked in supports.items():
        place = 1e3 * ends[int(np.linalg.norm(1e3 * ends - asked, axis=1).argmin())]
        found = read_from(drawing, place, labels)
        if all(np.linalg.norm(supports[one] - asked) > 1.0 for one in found):
            misread.append((own, found))
    assert misread == []


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_no_line_to_a_name_crosses_another_or_runs_through_a_name(name: str) -> None:
    made = formed(name)
    plan = flat_plan(made)
    drawing = supports_drawing(made, plan.text)
    ends = np.array([made.states[made.final or ""][rod.nodes[[0, -1]], :2] for rod in plan.rods]).reshape(-1, 2)
    lines = [path.points for path in drawing.paths if path.layer == "DIM" and path.flat]
    lines = [line for line in lines if np.linalg.norm(1e3 * ends - line[0], axis=1).min() < 1e-6]
    apart = [(a, b) for a, b in combinations(lines, 2) if np.linalg.norm(a[0] - b[0]) > 1.0]
    assert len(lines) >= len(supports_of(made))
    assert not [1 for a, b in apart if cross(a, b)]
    boxes = [text.box() for text in drawing.texts if text.layer == "LABEL"]
    for line in lines:
        along = np.concatenate([a + np.linspace(0, 0.99, 40)[:, None] * (b - a) for a, b in pairwise(line)])
        assert min(float(off(box, along).min()) for box in boxes) > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["roof", "opening"])
def test_names_stand_outside_the_shell(name: str) -> None:
    """Beyond the sides of the roof, or in the opening: on no rod."""
    made = formed(name)
    drawing = supports_drawing(made, flat_plan(made).text)
    rods = np.concatenate([1e3 * made.states[made.final or ""][rod.nodes, :2] for rod in flat_plan(made).rods])
    for text in drawing.texts:
        if text.text in supports_of(made):
            assert off(text.box(), rods).min() > 0, text.text


def test_a_way_out_is_the_right_hand_normal_of_the_outline() -> None:
    """Of a circle its radius, outwards where it is walked counterclockwise, inwards where clockwise."""
    turn = np.sort(np.random.default_rng(0).uniform(0, 2 * np.pi, 400))
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    assert np.einsum("ki,ki->k", outward(circle), circle).min() > 0.99
    assert np.einsum("ki,ki->k", outward(circle[::-1]), circle[::-1]).max() < -0.99


def test_places_at_one_point_have_their_names_side_by_side() -> None:
    """Each of ten pairs of places 0.01 mm apart: both names equally far out, hardly farther apart than they must."""
    turn = np.repeat(np.linspace(0, 2 * np.pi, 10, endpoint=False), 2) + np.tile([0.0, 1e-4], 10)
    places = 100 * np.column_stack([np.cos(turn), np.sin(turn)])
    found = callouts(
        [f"R{k:02d}" for k in range(20)], places, outward(places), 10.0, Room(40.0),
        np.empty((0, 2, 2)),
    )  # fmt: skip
    assert {one.written.size for one in found} == {10.0}
    middles = np.array([one.written.box().mean(axis=0) for one in found])
    np.testing.assert_allclose(np.linalg.norm(middles, axis=1), 100 + 13 + 3 + 0.5 * 3 * 6.2, rtol=0.03)
    beside = np.linalg.norm(middles[::2] - middles[1::2], axis=1)
    assert beside.min() > 11.0  # 1.1 of the text
    assert beside.max() < 20.0  # their ways part by the outline's turn


def test_rods_that_end_at_an_opening_are_named_in_it() -> None:
    """On the flat plan, by lines from their ends; no name lies on a rod."""
    plan = flat_plan(formed("opening"))
    drawing = flat_drawing(plan, plan.text)
    middle = plan.footprint[1].mean(axis=0)
    reach = np.linalg.norm(plan.footprint[1] - middle, axis=1).max()
    inside = [text for text in drawing.texts if np.linalg.norm(text.box().mean(axis=0) - middle) < reach]
    named = {rod.id for rod in plan.rods}
    labels = [text for text in inside if text.text in named]
    ends = plan.lines.reshape(-1, 2)
    assert len(labels) == np.count_nonzero(np.linalg.norm(ends - middle, axis=1) < 1.2 * reach)
    for k, end in enumerate(ends):
        if np.linalg.norm(end - middle) < 1.2 * reach:
            assert read_from(drawing, end, labels) == {plan.rods[k // 2].id}


def ring(radius: float, count: int = 12) -> Floats:
    """Places on a circle, counterclockwise."""
    turn = np.linspace(0, 2 * np.pi, count, endpoint=False)
    return radius * np.column_stack([np.cos(turn), np.sin(turn)])


def test_names_keep_clear_of_those_of_another_outline() -> None:
    """Two rings of places that face each other, so near that their names would meet."""
    room, boxes, lines = Room(40.0), list[Floats](), list[Floats]()
    for places in (ring(100.0), ring(160.0)[::-1]):
        found = callouts([f"R{k:02d}" for k in range(12)], places, outward(places), 10.0, room, np.empty((0, 2, 2)))
        boxes += [one.written.box() for one in found]
        lines += [one.line for one in found]
    assert not any(boxes_meet(a, b[None]) for a, b in combinations(boxes, 2))
    assert len(lines) == 24


def test_names_keep_clear_of_rods() -> None:
    """Of a rod across the way of each, a little off its place: each stands beyond it or is written between."""
    places = ring(100.0)
    rods = np.stack([1.3 * places - 8 * ring(1.0) @ TURN, 1.3 * places + 8 * ring(1.0) @ TURN], axis=1)
    found = callouts([f"R{k:02d}" for k in range(12)], places, outward(places), 10.0, Room(40.0), rods)
    assert [one.written.text for one in found if lines_meet(one.written.box(), rods)] == []
