"""Steps of a path: where they end, and how their lengths change."""

import itertools

import pytest

from rodshell.solve.continuation import LONGER, SHORTER, Continuation


@pytest.mark.parametrize(("start", "stop"), [(0.0, 1.0), (1.0, 0.25), (0.3, 0.3)])
def test_every_step_succeeds_and_the_end_is_met_exactly(start: float, stop: float) -> None:
    path, places = Continuation(start, stop, 0.1, 1e-3), [start]
    while not path.arrived:
        path.accept(easy=True)
        places.append(path.t)
    assert places[-1] == stop
    assert places == sorted(places, reverse=stop < start)
    lengths = [abs(b - a) for a, b in itertools.pairwise(places)]
    assert lengths[:-1] == pytest.approx([0.1 * LONGER**k for k in range(len(lengths) - 1)])


def test_a_step_that_fails_is_shortened_until_it_is_too_short() -> None:
    path, tried = Continuation(0.0, 1.0, 5.0, 1e-3), list[float]()
    while not path.lost:
        tried.append(path.there)
        path.shorten()
    assert path.t == 0
    assert tried == pytest.approx([SHORTER**k for k in range(len(tried))])  # the first one is cut at the end
    assert tried[-1] >= 1e-3 > path.step


def test_a_step_that_nearly_arrives_arrives() -> None:
    assert Continuation(0.0, 1.0, 1.0 - 1e-12, 1e-3).there == 1.0
    assert Continuation(1.0, 0.0, 1.0 - 1e-12, 1e-3).there == 0.0


def test_a_step_that_was_not_easy_is_followed_by_as_long_a_one() -> None:
    path = Continuation(0.0, 1.0, 0.25, 1e-3)
    path.accept()
    assert (path.t, path.there) == (0.25, 0.5)
