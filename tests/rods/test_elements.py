"""The elastic elements against slow twins from the paper, against Taylor's theorem, and against themselves.

All quantities are without units here: edges, stiffnesses and angles of the order of 1. One state serves all
elements: the blocks of a chain are x_0, theta_0, x_1, theta_1, ... Run as a script, this file writes what the
kernels give for every case; a test compares that under NUMBA_DISABLE_JIT.
"""

import os
import subprocess
import sys
from dataclasses import replace
from math import atan2, cos, pi, sin, sqrt, tan

import numpy as np
import pytest
from numpy.linalg import norm

from rodshell.errors import InputError
from rodshell.geometry.frames import directors_along, parallel_transport
from rodshell.rods.bend_twist import BendTwist
from rodshell.rods.elements import Stretch
from rodshell.rods.isotropic import AT_ONCE, IsotropicBend, IsotropicBendTwist

NODES = 7
Z = np.array([0.0, 0.0, 1.0])


# Chains and cases


def unit(v):
    return v / norm(v)


def rotated(v, axis, angle):
    """Rodrigues' formula."""
    return cos(angle) * v + sin(angle) * np.cross(axis, v) + (1 - cos(angle)) * np.dot(axis, v) * axis


def chain(edges, angles):
    state = np.zeros((2 * len(edges) + 1, 3))
    state[2::2] = np.cumsum(edges, axis=0)
    state[1::2, 0] = angles
    return state


def straight(rng, twist=0.0):
    lengths = rng.uniform(0.7, 1.3, (NODES - 1, 1))
    return chain(lengths * unit(rng.normal(size=3)), twist * rng.normal(size=NODES - 1))


def bent(rng, turn, twist=1.0):
    """Each edge turns by about `turn` [rad] from the one before, in any direction."""
    tangents = [unit(rng.normal(size=3))]
    for _ in range(NODES - 2):
        axis = unit(np.cross(tangents[-1], rng.normal(size=3)))
        tangents.append(rotated(tangents[-1], axis, turn * rng.uniform(0.8, 1.2)))
    return chain(rng.uniform(0.7, 1.3, (NODES - 1, 1)) * tangents, twist * rng.normal(size=NODES - 1))


def moved(rng, state, size):
    """`state` after a random displacement of its degrees of freedom of the given size."""
    step = rng.normal(size=state.shape)
    step[1::2, 1:] = 0.0
    return state + size * step


def windows(width, stride):
    """Blocks of the elements of a chain: `width` of them, `stride` apart."""
    starts = np.arange(0, 2 * NODES - 1 - stride * (width - 1), 2)
    return np.ascontiguousarray(starts[:, None] + stride * np.arange(width))


def stretch(rng, state, strain):
    blocks = windows(2, 2)
    lengths = norm(state[blocks[:, 1]] - state[blocks[:, 0]], axis=1) / (1 + strain)
    return Stretch.elastic(blocks, lengths, rng.uniform(0.5, 2, len(blocks)))


def pulled_stretch(rng, state):
    elastic = stretch(rng, state, rng.normal(size=NODES - 1) / 4)
    return replace(elastic, multipliers=rng.normal(size=NODES - 1))


def isotropic_bend(rng, _state):
    return IsotropicBend(windows(3, 2), rng.uniform(0.5, 2, NODES - 2))


def bend_twist(rng, state, natural=1.0):
    """Anisotropic, with natural curvature and twist of the given size; sources at `state`."""
    return BendTwist.starting_at(
        windows(5, 1),
        state,
        rng.normal(size=state.shape),
        bend_stiffness=rng.uniform(0.5, 2, (NODES - 2, 2)),
        twist_stiffness=rng.uniform(0.5, 2, NODES - 2),
        natural_curvature=natural * rng.normal(size=(NODES - 2, 2)),
        natural_twist=natural * rng.normal(size=NODES - 2),
    )


def isotropic_bend_twist(rng, state):
    """Isotropic and naturally straight, with natural twist; sources at `state`."""
    return IsotropicBendTwist.starting_at(
        windows(5, 1),
        state,
        rng.normal(size=state.shape),
        bend_stiffness=rng.uniform(0.5, 2, (NODES - 2, 1)),
        twist_stiffness=rng.uniform(0.5, 2, NODES - 2),
        natural_twist=rng.normal(size=NODES - 2),
    )


def _cases():
    """name -> (elements, state). Each case has its own random numbers."""
    rng = iter(np.random.default_rng(2021).spawn(30))
    r, line = next(rng), straight(next(rng), twist=1.0)
    gentle, sharp, wound = bent(r, 0.4), bent(r, 2.4), bent(r, 1.2, twist=20.0)
    yield "stretch", (stretch(r, gentle, r.normal(size=NODES - 1) / 4), gentle)
    yield "stretch at zero strain", (stretch(r, gentle, 0.0), gentle)
    yield "stretch, strongly compressed", (stretch(r, gentle, -0.6), gentle)
    yield "stretch with multipliers", (pulled_stretch(r, gentle), gentle)
    yield "isotropic bend", (isotropic_bend(r, gentle), gentle)
    yield "isotropic bend, straight", (isotropic_bend(r, line), line)
    yield "isotropic bend, strongly bent", (isotropic_bend(r, sharp), sharp)
    states = {"gentle": gentle, "straight": line, "strongly bent": sharp, "strongly twisted": wound}
    for name, state in states.items():
        r = next(rng)
        elements = bend_twist(r, state)
        yield f"bend and twist, {name}", (elements, state)
        yield f"bend and twist, {name}, away from the source", (elements, moved(r, state, 0.15))
    elements = bend_twist(r, line, natural=0.0)
    untwisted = line * [[1, 1, 1] if row % 2 == 0 else [0, 0, 0] for row in range(len(line))]
    yield "bend and twist at zero strain, straight", (elements.relaxed(untwisted), untwisted)
    yield "bend and twist at zero strain, bent", (bend_twist(r, gentle).relaxed(gentle), gentle)
    for name, state in states.items():
        r = next(rng)
        elements = isotropic_bend_twist(r, state)
        yield f"isotropic bend and twist, {name}", (elements, state)
        yield f"isotropic bend and twist, {name}, away from the source", (elements, moved(r, state, 0.1))
    yield "isotropic bend and twist at zero strain, straight", (isotropic_bend_twist(r, line).relaxed(line), line)


CASES = dict(_cases())
every_case = pytest.mark.parametrize("name", CASES)


def evaluate(elements, state):
    """Energy, gradient (N, 3) and assembled Hessian (3N, 3N)."""
    gradient, width = np.zeros_like(state), 3 * elements.blocks.shape[1]
    hessians = np.full((len(elements.blocks), width, width), np.nan)
    energy = elements.evaluate(state, gradient, hessians)
    total = np.zeros((state.size, state.size))
    for blocks, hessian in zip(elements.blocks, hessians, strict=True):
        rows = (3 * blocks[:, None] + np.arange(3)).ravel()
        total[np.ix_(rows, rows)] += hessian
    return energy, gradient, total


# Twins, written from the paper with explicit frames and angles


def turned_along(v, start, end, share=1.0):
    """`v` after `share` of the rotation that takes the tangent `start` to `end` along their great circle."""
    normal = np.cross(start, end)
    if norm(normal) == 0.0:
        return v
    return rotated(v, unit(normal), share * atan2(norm(normal), np.dot(start, end)))


def angle_about(axis, start, end):
    return atan2(np.dot(axis, np.cross(start, end)), np.dot(start, end))


def stretch_twin(elements, x):
    """HQK Eq 1a, and the work of the multipliers."""
    energy = 0.0
    for (a, b), rest, ea, multiplier in zip(
        elements.blocks, elements.rest_lengths, elements.stiffness, elements.multipliers, strict=True
    ):
        strain = norm(x[b] - x[a]) / rest - 1
        energy += (multiplier * strain + ea * strain**2 / 2) * rest
    return energy


def isotropic_bend_twin(elements, x):
    """HQK Eq 1b and Fig 2b: |kappa| = 2 tan(phi/2)."""
    energy = 0.0
    for (a, b, c), stiffness in zip(elements.blocks, elements.stiffness, strict=True):
        e, f = x[b] - x[a], x[c] - x[b]
        turning = atan2(norm(np.cross(e, f)), np.dot(e, f))
        energy += stiffness * (2 * tan(turning / 2)) ** 2 / 2
    return energy


def twin_strains(elements, x):
    """Curvatures and twist by the definitions; the reference twist is followed from the source on."""
    strains = []
    for (a, i, b, j, c), tangents, directors, source_twist in zip(
        elements.blocks,
        elements.source_tangents,
        elements.source_directors,
        elements.source_twist,
        strict=True,
    ):
        present = [unit(x[b] - x[a]), unit(x[c] - x[b])]
        reference_twist = []
        for share in np.linspace(0, 1, 40):
            t, d = (
                [turned_along(v, s, p, share) for v, s, p in zip(part, tangents, present, strict=True)]
                for part in (tangents, directors)
            )
            reference_twist.append(angle_about(t[1], turned_along(d[0], t[0], t[1]), d[1]))
        followed = np.unwrap(reference_twist)
        m1 = [rotated(d[k], t[k], theta) for k, theta in enumerate((x[i, 0], x[j, 0]))]
        m2 = [np.cross(t[k], m1[k]) for k in range(2)]
        binormal = 2 * np.cross(t[0], t[1]) / (1 + np.dot(t[0], t[1]))
        curvature = np.dot(binormal, m2[0] + m2[1]) / 2, -np.dot(binormal, m1[0] + m1[1]) / 2
        strains.append([*curvature, x[j, 0] - x[i, 0] + source_twist + followed[-1] - followed[0]])
    return np.array(strains)


def bend_twist_twin(elements, x):
    """HQK Eq 1b and 1c, with two stiffnesses, natural curvature and natural twist."""
    strains = twin_strains(elements, x)
    bent_by, twisted_by = strains[:, :2] - elements.natural_curvature, strains[:, 2] - elements.natural_twist
    bend = np.sum(elements.bend_stiffness * bent_by**2) / 2
    return bend + np.sum(elements.twist_stiffness * twisted_by**2) / 2


def isotropic_bend_twist_twin(elements, x):
    """HQK Eq 1b and 1c of a round rod: the bending of the centre line, and the twist of the material frames."""
    bends = IsotropicBend(elements.blocks[:, ::2], elements.bend_stiffness[:, 0])
    twisted_by = twin_strains(elements, x)[:, 2] - elements.natural_twist
    return isotropic_bend_twin(bends, x) + np.sum(elements.twist_stiffness * twisted_by**2) / 2


TWINS = {
    Stretch: stretch_twin,
    IsotropicBend: isotropic_bend_twin,
    BendTwist: bend_twist_twin,
    IsotropicBendTwist: isotropic_bend_twist_twin,
}


@pytest.mark.slow
@every_case
def test_energy_is_that_of_the_slow_twin(name):
    elements, state = CASES[name]
    energy = elements.evaluate(state, np.zeros_like(state))
    # Round-off only. Zero strain: a rounding error of 1e-16 in each strain, squared.
    assert energy == pytest.approx(TWINS[type(elements)](elements, state), rel=1e-12, abs=1e-26)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in CASES if "twist" in name])
def test_strains_are_those_of_the_slow_twin(name):
    elements, state = CASES[name]
    np.testing.assert_allclose(elements.strains(state), twin_strains(elements, state), rtol=1e-12, atol=1e-13)


# Derivatives


def taylor_slope(remainder):
    """Order of `remainder(step)` in the step. Below 1e-5 round-off shows, above 1e-3 the next order."""
    steps = np.geomspace(1e-5, 1e-3, 7)
    return np.polyfit(np.log(steps), np.log([remainder(step) for step in steps]), 1)[0]


@every_case
def test_gradient_is_the_derivative_of_the_energy(name):
    elements, state = CASES[name]
    energy, gradient, _ = evaluate(elements, state)
    ray = moved(np.random.default_rng(1), 0 * state, 1.0)
    change = np.sum(gradient * ray)
    slope = taylor_slope(lambda h: abs(evaluate(elements, state + h * ray)[0] - energy - h * change))
    assert slope == pytest.approx(2.0, abs=0.05)


@every_case
def test_hessian_is_the_derivative_of_the_gradient(name):
    elements, state = CASES[name]
    _, gradient, hessian = evaluate(elements, state)
    ray = moved(np.random.default_rng(2), 0 * state, 1.0)
    change = (hessian @ ray.ravel()).reshape(ray.shape)
    slope = taylor_slope(lambda h: norm(evaluate(elements, state + h * ray)[1] - gradient - h * change))
    assert slope == pytest.approx(2.0, abs=0.05)


@every_case
def test_hessian_is_symmetric(name):
    _, _, hessian = evaluate(*CASES[name])
    assert norm(hessian - hessian.T) <= 1e-12 * norm(hessian)


@every_case
def test_evaluation_adds_to_the_gradient_and_overwrites_the_hessians(name):
    elements, state = CASES[name]
    _, gradient, hessian = evaluate(elements, state)  # starts from zeros and from nan
    before = np.random.default_rng(3).normal(size=state.shape)
    after = before.copy()
    elements.evaluate(state, after)
    np.testing.assert_allclose(after - before, gradient, rtol=1e-12, atol=1e-13 * norm(gradient) + 1e-14)
    unused = np.arange(state.size).reshape(state.shape)[1::2, 1:].ravel()
    assert not hessian[unused].any()
    assert not hessian[:, unused].any()


def test_stretch_takes_given_forces_for_the_geometric_stiffness():
    elements, state = CASES["stretch with multipliers"]
    forces = elements.multipliers + elements.stiffness * elements.strains(state)
    _, _, exact = evaluate(elements, state)
    _, _, given = evaluate(replace(elements, forces=forces), state)
    _, _, slack = evaluate(replace(elements, forces=np.zeros(NODES - 1)), state)
    np.testing.assert_allclose(given, exact, rtol=1e-12, atol=1e-13)
    assert np.linalg.eigvalsh(slack).min() > -1e-12  # what is left is A'EA A
    assert np.linalg.eigvalsh(exact).min() < -0.1


# Frames


def test_rigid_motion_with_the_material_frames_changes_nothing():
    """The reference frames do not move rigidly; the twist angles take up the difference."""
    rng = np.random.default_rng(4)
    state = bent(rng, 0.9, twist=3.0)
    elements = bend_twist(rng, state)
    energy, gradient, _ = evaluate(elements, state)
    axis, angle, shift = unit(rng.normal(size=3)), 0.1, rng.normal(size=3)
    turned_gradient = gradient.copy()
    first = gradient.copy()
    for _ in range(25):  # 2.5 rad in all
        before, present = elements, state.copy()
        present[0::2] = [rotated(x, axis, angle) + shift for x in state[0::2]]
        reached = before.refreshed(present)
        for (_, i, _, j, _), old, new, tangents in zip(
            before.blocks,
            before.source_directors,
            reached.source_directors,
            reached.source_tangents,
            strict=True,
        ):
            for row, d_old, d_new, t in zip((i, j), old, new, tangents, strict=True):
                present[row, 0] = state[row, 0] + angle_about(t, d_new, rotated(d_old, axis, angle))
        assert before.evaluate(present, np.zeros_like(state)) == pytest.approx(energy, rel=1e-12)
        elements, state = reached, present
        turned_gradient[0::2] = [rotated(g, axis, angle) for g in turned_gradient[0::2]]
        _, gradient, _ = evaluate(elements, state)
        np.testing.assert_allclose(gradient, turned_gradient, rtol=0, atol=1e-12 * norm(gradient))
    assert norm(gradient - first) > 0.1 * norm(first)  # it did turn


def test_bends_do_not_depend_on_those_that_are_evaluated_with_them():
    """More than are taken at once, in an order that shares no edges; each alone against all together."""
    rng, count = np.random.default_rng(8), 2 * AT_ONCE + 5
    state = np.cumsum(rng.uniform(0.5, 1.5, (count + 2, 3)), axis=0)
    blocks = rng.permutation(np.arange(count)[:, None] + np.arange(3))
    whole = IsotropicBend(blocks, rng.uniform(0.5, 2.0, count))
    gradient, hessians = np.zeros_like(state), np.full((count, 9, 9), np.nan)
    energy = whole.evaluate(state, gradient, hessians)
    for row, stiffness, hessian in zip(blocks, whole.stiffness, hessians, strict=True):
        single, alone = np.zeros_like(state), np.full((1, 9, 9), np.nan)
        energy -= IsotropicBend(row[None], np.array([stiffness])).evaluate(state, single, alone)
        gradient -= single
        assert np.array_equal(alone[0], hessian)
    assert abs(energy) < 1e-12
    assert np.abs(gradient).max() < 1e-12


@every_case
def test_forces_and_moments_balance(name):
    """Small rigid motions from the source: d theta = omega.t takes the material frames along."""
    elements, state = CASES[name]
    elements = elements.refreshed(state)
    _, gradient, _ = evaluate(elements, state)
    tangents = [unit(v) for v in np.diff(state[0::2], axis=0)]
    moment = np.cross(state[0::2], gradient[0::2]).sum(axis=0) + gradient[1::2, 0] @ tangents
    scale = norm(gradient) + 1e-14
    assert norm(gradient[0::2].sum(axis=0)) <= 1e-12 * scale
    assert norm(moment) <= 1e-11 * scale  # lever arms up to 7


@pytest.mark.parametrize("name", [name for name in CASES if "away" in name])
def test_refreshing_changes_the_source_and_nothing_else(name):
    elements, state = CASES[name]
    refreshed = elements.refreshed(state)
    energy = elements.evaluate(state, np.zeros_like(state))
    assert refreshed.evaluate(state, np.zeros_like(state)) == pytest.approx(energy, rel=1e-13)
    again = refreshed.refreshed(state)
    np.testing.assert_allclose(again.source_twist, refreshed.source_twist, rtol=0, atol=1e-14)
    np.testing.assert_allclose(again.source_directors, refreshed.source_directors, rtol=0, atol=1e-15)
    t, d = refreshed.source_tangents, refreshed.source_directors
    assert np.abs(np.einsum("bsi,bsi->bs", t, d)).max() < 1e-15
    assert np.abs(np.einsum("bsi,bsi->bs", d, d) - 1).max() < 1e-15
    assert norm(t - elements.source_tangents) > 0.1


@pytest.mark.parametrize("make", [bend_twist, isotropic_bend_twist])
def test_energy_is_the_same_from_the_new_source_however_far_the_state(make):
    """Also where the frames of a node have turned against each other by more than half a revolution."""
    rng = np.random.default_rng(9)
    state = bent(rng, 1.0)
    elements, turned = make(rng, state), 0.0
    for _ in range(50):
        ahead = bent(rng, 1.5)
        there = elements.refreshed(ahead)
        turned = max(turned, np.abs(there.source_twist - elements.source_twist).max())
        energy = elements.evaluate(ahead, np.zeros_like(state))
        assert there.evaluate(ahead, np.zeros_like(state)) == pytest.approx(energy, rel=1e-9)
    assert turned > 3.0


def test_frames_stay_adapted_over_many_refreshes():
    """A round-off of 1e-16 at each of them would show as 1e-13."""
    rng = np.random.default_rng(10)
    state = bent(rng, 0.5)
    elements = bend_twist(rng, state)
    for _ in range(3000):
        state = moved(rng, state, 0.02)
        state[2::2] = state[0] + np.cumsum([unit(edge) for edge in np.diff(state[0::2], axis=0)], axis=0)
        elements = elements.refreshed(state)
    t, d = elements.source_tangents, elements.source_directors
    assert np.abs(np.einsum("bsi,bsi->bs", t, d)).max() < 2e-15
    assert np.abs(np.einsum("bsi,bsi->bs", d, d) - 1).max() < 2e-15


def test_reference_twist_gathers_turns_without_jumps():
    """An edge that circles about its neighbour gains the solid angle of its path as reference twist."""
    blocks = np.arange(5)[None, :]

    def state_at(azimuth):
        tilt = np.array([sin(1.2) * cos(azimuth), sin(1.2) * sin(azimuth), cos(1.2)])
        return chain([Z, tilt], [0.0, 0.0])

    def solid_angle(a, b, c):
        """Van Oosterom and Strackee."""
        return 2 * atan2(np.dot(a, np.cross(b, c)), 1 + np.dot(a, b) + np.dot(b, c) + np.dot(c, a))

    state = state_at(0.0)
    elements = BendTwist.starting_at(blocks, state, [0.0, 1.0, 0.0], bend_stiffness=1.0, twist_stiffness=1.0)
    expected = start = elements.source_twist[0]
    for azimuth in 2 * pi * np.arange(1, 61) / 20:  # three rounds
        ahead = state_at(azimuth)
        expected += solid_angle(Z, unit(state[4] - state[2]), unit(ahead[4] - ahead[2]))
        assert elements.strains(ahead)[0, 2] == pytest.approx(expected, rel=1e-12)
        energy = elements.evaluate(ahead, np.zeros_like(state))
        state, elements = ahead, elements.refreshed(ahead)
        assert elements.source_twist[0] == pytest.approx(expected, rel=1e-12)
        assert elements.evaluate(state, np.zeros_like(state)) == pytest.approx(energy, rel=1e-12)
    assert expected - start > 3.5 * pi  # three caps, 3.83 pi, but with 20 corners on the rim


def test_parallel_transport_is_the_smallest_rotation():
    rng = np.random.default_rng(5)
    vectors, start, end = rng.normal(size=(3, 20, 3))
    start, end = (v / norm(v, axis=1, keepdims=True) for v in (start, end))
    expected = [turned_along(*row) for row in zip(vectors, start, end, strict=True)]
    np.testing.assert_allclose(parallel_transport(vectors, start, end), expected, rtol=0, atol=1e-13)
    np.testing.assert_allclose(parallel_transport(vectors, start, start), vectors, rtol=0, atol=1e-14)


def test_directors_carried_along_the_rod_have_no_reference_twist():
    state = bent(np.random.default_rng(6), 0.8)
    tangents = np.array([unit(v) for v in np.diff(state[0::2], axis=0)])
    directors = np.zeros_like(state)
    directors[1::2] = directors_along(tangents, np.array([0.3, -0.2, 0.9]))
    np.testing.assert_allclose(np.einsum("ij,ij->i", directors[1::2], tangents), 0, atol=1e-14)
    elements = BendTwist.starting_at(windows(5, 1), state, directors, bend_stiffness=1.0, twist_stiffness=1.0)
    np.testing.assert_allclose(elements.source_twist, 0, atol=1e-13)


def test_director_along_its_edge_is_refused():
    state = chain([[1.0, 0, 0], [0, 1.0, 0]], [0.0, 0.0])
    with pytest.raises(InputError, match="across"):
        BendTwist.starting_at(np.arange(5)[None], state, [0, 1.0, 0], bend_stiffness=1.0, twist_stiffness=1.0)


# Mechanics


def test_corner_of_a_flat_grid_has_the_curvature_of_its_linker():
    """From x to y with all directors along z: curvature (0, -2 tan 45 degrees) and no twist [HQK Eq 1]."""
    corner = chain([[1.0, 0, 0], [0, 1.0, 0]], [0.0, 0.0])
    elements = BendTwist.starting_at(np.arange(5)[None], corner, Z, bend_stiffness=1.0, twist_stiffness=1.0)
    np.testing.assert_allclose(elements.strains(corner), [[0, -2, 0]], atol=1e-15)
    assert elements.evaluate(corner, np.zeros_like(corner)) == pytest.approx(2.0, rel=1e-14)
    assert elements.relaxed(corner).evaluate(corner, np.zeros_like(corner)) == pytest.approx(0.0, abs=1e-30)


@pytest.mark.parametrize(("lift", "stiffness"), [([0, 1], 2.0), ([1, 0], 3.0)])
def test_bend_towards_each_director_meets_its_own_stiffness(lift, stiffness):
    """Rod along z, m1 along y, and so m2 = z x y along -x."""
    angle = 0.3
    edge = [sin(angle) * lift[0], sin(angle) * lift[1], cos(angle)]
    state = chain([Z, edge], [0.0, 0.0])
    elements = BendTwist.starting_at(
        np.arange(5)[None], state, [0, 1.0, 0], bend_stiffness=[[2.0, 3.0]], twist_stiffness=1.0
    )
    energy = elements.evaluate(state, np.zeros_like(state))
    assert energy == pytest.approx(stiffness * (2 * tan(angle / 2)) ** 2 / 2, rel=1e-12)


def isotropic_pair(rng, state, twist_stiffness):
    """The same isotropic rod as bend-and-twist and as bend elements."""
    bends = isotropic_bend(rng, state)
    both = BendTwist.starting_at(
        windows(5, 1),
        state,
        rng.normal(size=state.shape),
        bend_stiffness=bends.stiffness[:, None],
        twist_stiffness=twist_stiffness,
    )
    return both, bends


def test_untwisted_isotropic_rod_is_bend_alone():
    rng = np.random.default_rng(7)
    state = bent(rng, 1.8)
    both, bends = isotropic_pair(rng, state, 1.7)
    state[1, 0], state[3::2, 0] = 0.4, 0.4 - np.cumsum(both.source_twist)
    energy, gradient, _ = evaluate(both, state)
    expected, forces, _ = evaluate(bends, state)
    assert energy == pytest.approx(expected, rel=1e-13)
    np.testing.assert_allclose(gradient, forces, rtol=0, atol=1e-12 * norm(forces))


def test_isotropic_rod_with_its_twist_minimised_out_is_bend_alone():
    """Energy, gradient and Hessian: the twist angles are eliminated from the Hessian too."""
    rng = np.random.default_rng(8)
    state = bent(rng, 0.6, twist=0.0)
    both, bends = isotropic_pair(rng, state, 1.0)
    state[1, 0], state[3::2, 0] = 0.0, 0.3 * rng.normal(size=NODES - 2) - np.cumsum(both.source_twist)
    angles = 3 * np.arange(3, 2 * NODES - 1, 2)  # the first stays: a turn of all costs nothing
    for _ in range(8):
        _, gradient, hessian = evaluate(both, state)
        free = np.linalg.solve(hessian[np.ix_(angles, angles)], gradient.ravel()[angles])
        state.ravel()[angles] -= free
    energy, gradient, hessian = evaluate(both, state)
    expected, forces, stiffness = evaluate(bends, state)
    assert energy == pytest.approx(expected, rel=1e-13)
    np.testing.assert_allclose(gradient, forces, rtol=0, atol=1e-12 * norm(forces))
    np.testing.assert_allclose(both.strains(state)[:, 2], 0, atol=1e-13)
    x = np.arange(state.size).reshape(state.shape)[0::2].ravel()
    coupling = hessian[np.ix_(x, angles)]
    followed = np.linalg.solve(hessian[np.ix_(angles, angles)], coupling.T)
    condensed = hessian[np.ix_(x, x)] - coupling @ followed
    np.testing.assert_allclose(condensed, stiffness[np.ix_(x, x)], rtol=0, atol=1e-11 * norm(stiffness))


def test_twist_softens_a_sharp_bend_as_the_averaged_frames_say():
    """|(k1, k2)| = |kb| cos(tau/2): past |kb|^2 = 4 GJ/EI, zero twist is no longer a minimum."""
    for binormal, stable in [(1.9, True), (2.1, False)]:
        angle = 2 * np.arctan(binormal / 2)
        state = chain([Z, [sin(angle), 0, cos(angle)]], [0.0, 0.0])
        elements = BendTwist.starting_at(
            np.arange(5)[None], state, [0, 1.0, 0], bend_stiffness=1.0, twist_stiffness=1.0
        )
        _, _, hessian = evaluate(elements, state)
        assert hessian[3, 3] == pytest.approx(1 - binormal**2 / 4, rel=1e-12)
        assert (hessian[3, 3] > 0) == stable
        state[1, 0] = 0.7
        assert norm(elements.strains(state)[0, :2]) == pytest.approx(binormal * cos(0.35), rel=1e-12)


# Without the compiler


@pytest.mark.slow
def test_kernels_give_the_same_without_the_compiler(tmp_path):
    out = tmp_path / "plain.npz"
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    subprocess.run([sys.executable, __file__, str(out)], env=environment, check=True)
    plain = np.load(out)
    assert bool(plain["plain"])
    for name, case in CASES.items():
        for part, value in zip(("energy", "gradient", "hessian"), evaluate(*case), strict=True):
            # Round-off: the compiler may fuse or reorder nothing, but the maths library differs.
            bound = 1e-13 * (norm(value) + sqrt(np.size(value)))
            np.testing.assert_allclose(plain[f"{name}: {part}"], value, rtol=0, atol=bound)


if __name__ == "__main__":
    from numba import config

    arrays = {"plain": np.array(bool(config.DISABLE_JIT))}
    for _name, _case in CASES.items():
        parts = zip(("energy", "gradient", "hessian"), evaluate(*_case), strict=True)
        arrays |= {f"{_name}: {_part}": np.asarray(_value) for _part, _value in parts}
    np.savez(sys.argv[1], **arrays)
