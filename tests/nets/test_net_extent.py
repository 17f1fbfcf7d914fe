"""How far a net is marched: everything that is used is there, and is what a march over the whole lattice finds."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import label

import rodshell as rs
from rodshell.geometry.curves import resampled
from rodshell.nets import net_extent
from rodshell.nets.apron import RINGS
from rodshell.nets.compass import Net, axes, fill_quadrants
from rodshell.nets.net_ends import inside_nodes
from rodshell.nets.net_extent import Covering, march_covering, wanted_nodes
from tests.nets.whole_march import march
from tests.targets.test_nets_on_files import TARGETS as FILES

SIZE = 0.2
ANCHOR = (0.03, -0.02)
EXACT = 1e-11  # of the size; 2e-13 measured
TWO_BUMPS = "0.08*(exp(-((x-.09)^2/.06^2 + y^2/.07^2)/2) + exp(-((x+.09)^2/.06^2 + y^2/.07^2)/2))"
SLIM = "0.1 - x^2 - .3*x*y + .3*y^2"
TARGETS: dict[str, rs.Target] = {
    "hemisphere": rs.Hemisphere(SIZE),
    "bumps": rs.HeightField(formula=TWO_BUMPS, domain=rs.Disc(SIZE)),
    "slim": rs.HeightField(formula=SLIM, domain=rs.Rectangle((0.5, 0.12))),
    "opening": FILES["opening"],
}


SHARP = rs.HeightField(
    formula="-1.69*x^2 + .417*y^2 + .083*x*y + .0837*exp(-((x-.104)^2/.04^2 + (y+.079)^2/.122^2))"
    " + .0507*exp(-((x-.058)^2/.062^2 + (y-.031)^2/.12^2))",
    domain=rs.Disc(SIZE),
)


def net_of(name):
    """With lines that miss the anchor, turned against the target; the opening's anchor lies in the opening."""
    target = TARGETS[name]
    anchor = (0.0, 0.0) if name == "opening" else ANCHOR
    s = 0.15 * target.size
    layout = rs.GridLayout.orthogonal(spacing=(s, 1.2 * s), edge=s / 3, rotate=0.2, offset=(0.2 * s, 0.3 * s))
    return rs.chebyshev_net(target, layout, anchor=anchor)


def whole_march(net):
    """The same lattice, node by node and to its corners; the first chord leaves along the heading."""
    points = net.net.points
    i, j = net.net.origin
    return march(net.target, net.net.u, net.net.v, points[i, j], points[i + 1, j] - points[i, j])


@pytest.fixture(params=TARGETS)
def both(request):
    net = net_of(request.param)
    return net, whole_march(net)


def test_the_nodes_of_a_net_are_those_of_a_march_over_the_whole_lattice(both):
    net, whole = both
    away = np.linalg.norm(net.net.points - whole.points, axis=2)
    known = np.isfinite(net.net.points[:, :, 0])
    assert known.mean() < 0.99
    assert away[known].max() < EXACT * net.target.size
    np.testing.assert_array_equal(net.net.inside, inside_nodes(net.target, whole))


def test_a_net_goes_on_for_two_rings_of_joints_past_every_end_wherever_the_march_does(both):
    net, whole = both
    found, exists = (np.isfinite(one.points[:, :, 0]) for one in (net.net, whole))
    u, v = net.lines
    rows, columns = np.searchsorted(net.net.u, u - 1e-12), np.searchsorted(net.net.v, v - 1e-12)
    for rod in net.rods:
        if rod.family == "u":
            at, across = u, int(np.argmin(np.abs(v - rod.offset)))
            on, there = found[rows, columns[across]], exists[rows, columns[across]]
        else:
            at, across = v, int(np.argmin(np.abs(u - rod.offset)))
            on, there = found[rows[across], columns], exists[rows[across], columns]
        first, last = np.searchsorted(at, rod.start) - RINGS, np.searchsorted(at, rod.end) + RINGS
        assert on[max(first, 0) : last][there[max(first, 0) : last]].all()


def test_a_net_leaves_the_corners_alone_and_asks_the_target_seldom(monkeypatch):
    """A third of the lattice lies past what is used. From node to node the target is asked for the first net alone,
    whose steps are a tenth of the target's width: 109 calls for all, and 401 where the rough march goes so, too."""
    asked, marched = list[int](), list[int]()
    layout = rs.GridLayout.orthogonal(spacing=0.03, edge=0.005)
    for name in ("level", "implicit"):
        answer, told = getattr(rs.Hemisphere, name), asked if name == "implicit" else marched
        monkeypatch.setattr(
            rs.Hemisphere, name, lambda self, x, say=answer, told=told: told.append(len(x)) or say(self, x)
        )
    net = rs.chebyshev_net(rs.Hemisphere(SIZE), layout)
    assert np.isfinite(net.net.points[:, :, 0]).mean() < 0.7  # 0.66
    most, next_to_most = sorted(asked, reverse=True)[:2]
    assert most < 0.7 * net.net.points[:, :, 0].size
    assert next_to_most < 0.3 * most  # the coarser march: the finer one, foreseen from two, settles in one round
    assert len(asked) + len(marched) < 130
    assert max(marched) <= 4 * net_extent.STRIDES


def test_a_rougher_net_that_tells_too_little_does_no_harm():
    """Of two bumps it knows but the anchor, or nothing: the march goes on from what it finds itself."""
    net = net_of("bumps")
    margin = 2.3 * np.array(net.layout.spacing[::-1])
    expected = net.net
    i, j = expected.origin
    start = axes(net.target, expected.points[i, j], expected.points[i + 1, j] - expected.points[i, j])
    for known in (1, 0):
        inside = np.zeros_like(expected.inside)
        inside[i, j] = known
        found = march_covering(net.target, expected.u, expected.v, start, margin, replace(expected, inside=inside))
        np.testing.assert_array_equal(found.inside, expected.inside)
        assert np.isfinite(found.points[expected.inside]).all()


def test_a_node_is_found_alone_where_it_is_found_with_others():
    """Where the surface is bent most, Newton's method for a node comes by a place more than a step away."""
    lattice = np.arange(-20, 8) * 0.0241
    whole = march(SHARP, lattice, lattice, SHARP.lift(np.array([[-0.1286, -0.1487]]))[0], np.array([-0.73, 0.68, 0.0]))
    known = np.isfinite(whole.points[:, :, 0])
    known[whole.origin[0]] = known[:, whole.origin[1]] = False
    for i, j in np.argwhere(known):
        net, alone = replace(whole, points=whole.points.copy()), np.zeros_like(known)
        net.points[i, j], alone[i, j] = np.nan, True
        fill_quadrants(SHARP, net, alone)
        np.testing.assert_allclose(net.points[i, j], whole.points[i, j], rtol=0, atol=1e-12)


@pytest.mark.parametrize("past", [0, 1])
@pytest.mark.parametrize("seed", range(8))
def test_wanted_nodes_are_all_on_the_way_to_a_margin_around_the_inside_ones(past, seed):
    """By its definition, node by node; blobs that need not hold the anchor, and lattices that are not even."""
    random = np.random.default_rng(seed)

    def knots(count):
        at = np.cumsum(random.uniform(0.5, 1.5, count))
        return at - at[random.integers(1, count - 1)]

    u, v, fine_u, fine_v = (knots(count) for count in (9, 12, 21, 17))
    margin = random.uniform(0.3, 2.5, 2)
    inside = np.zeros((9, 12), dtype=bool)
    i, j = random.integers(0, 8), random.integers(0, 10)
    inside[i : i + 3, j : j + random.integers(1, 5)] = True
    inside[random.integers(0, 9), random.integers(0, 12)] = True
    expected = np.zeros((len(fine_u), len(fine_v)), dtype=bool)
    for a, b in np.argwhere(inside):
        for along in (-1, 1):  # the quadrant
            for across in (-1, 1):
                end = along * u[np.clip(a + along * past, 0, 8)], across * v[np.clip(b + across * past, 0, 11)]
                for more in ((margin[0], 0.0), (0.0, margin[1])):
                    expected |= ((along * fine_u >= 0) & (along * fine_u <= end[0] + more[0]))[:, None] & (
                        (across * fine_v >= 0) & (across * fine_v <= end[1] + more[1])
                    )
    near = Covering(u, v, np.zeros((9, 12, 3)), inside)
    np.testing.assert_array_equal(wanted_nodes(near, past, fine_u, fine_v, margin), expected)


def test_where_nothing_is_inside_all_nodes_are_wanted():
    near = Covering(np.arange(-2.0, 3), np.arange(-1.0, 3), np.zeros((5, 4, 3)), np.zeros((5, 4), dtype=bool))
    assert wanted_nodes(near, 1, near.u, near.v, np.ones(2)).all()
    assert near.reach(1).tolist() == [2.0, 2.0, 1.0, 2.0]


def test_inside_nodes_are_those_that_hang_together_with_the_anchor():
    """A sea of waves above and below the base, no steeper than a net's steps are long, against scipy's labels."""
    target = rs.Hemisphere(SIZE)
    s = np.linspace(-1.0, 1.0, 81)
    height = 0.03 * (np.cos(9 * s)[:, None] * np.cos(7 * s) + 0.3 * np.sin(11 * s[:, None] * s) - 0.1)
    points = np.stack([*np.meshgrid(s, s, indexing="ij"), height], axis=-1)
    net = Net(s, s, points)
    islands, count = label(height > 0)
    assert count > 4
    np.testing.assert_array_equal(inside_nodes(target, net), islands == islands[net.origin])


def test_a_line_is_continued_from_the_nodes_that_hang_together_with_its_origin():
    """A cubic is its own interpolant, wherever it is known; other nodes, past a gap, do not count."""
    knots = np.array([-2.0, -1.5, -0.9, 0.0, 0.7, 1.2, 2.0, 2.6, 3.5])
    at = np.sort(np.append(knots, np.linspace(-4.013, 5.987, 181)))

    def cubic(s):
        return np.stack([1 + s - 0.2 * s**3, s**2, 0.5 - s], axis=-1)

    whole, part, three, alone = (cubic(knots) for _ in range(4))
    part[[1, 7]] = np.nan
    part[0] = part[8] = 1e3
    three[[2, 6]] = np.nan
    alone[[2, 4]] = np.nan
    found = resampled(knots, np.stack([whole, part, three, alone], axis=1), 3, at, 2.0)
    for line, low, high in ((0, -3.0, 5.3), (1, -0.9 - 1.8, 2.0 + 1.6), (2, -1.4, 1.2 + 1.0)):
        there = np.isfinite(found[line, :, 0])
        np.testing.assert_array_equal(there, (at > low) & (at < high))
        kept = 0 if line < 2 else 1  # three nodes know no cubic, but a parabola
        np.testing.assert_allclose(found[line, there][:, kept:], cubic(at[there])[:, kept:], rtol=0, atol=1e-11)
    assert at[np.isfinite(found[3, :, 0])].tolist() == [0.0]


@pytest.mark.parametrize(
    ("edge", "steps"), [(0.25, [8, 6, 8]), (0.1, [10, 6, 20]), (0.09, [12, 6, 24]), (1.0, [6, 6, 6])]
)
def test_from_line_to_line_there_are_an_even_number_of_equal_steps_and_at_least_six(edge, steps):
    lines = np.array([-1.0, 0.0, 0.25, 2.25])
    nodes = net_extent._divided(lines, net_extent._steps(lines, edge))
    expected = [
        low + (high - low) * k / n for low, high, n in zip(lines, lines[1:], steps, strict=False) for k in range(n)
    ]
    np.testing.assert_allclose(nodes, [*expected, 2.25], rtol=0, atol=1e-15)
