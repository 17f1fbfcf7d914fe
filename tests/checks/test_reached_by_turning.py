"""From pinned to clamped by turning the ends."""

import numpy as np

import rodshell as rs
from rodshell.checks import check
from rodshell.checks.deployment import reached_by_turning
from rodshell.formfinding.popup import end_directions, turned
from tests.checks.shells import ROD, dome
from tests.formfinding.altered import at_positions


def test_the_ends_of_the_dome_turn_into_their_clamps() -> None:
    """As the pop-up from flat does it, with other steps: it ends in the clamped shell that was released when draped."""
    form = dome()
    assert reached_by_turning(form.popped["pinned"], form.popped["clamped"])
    assert check(form.popped, ROD, stages=2).clamped_from_flat
    risen = rs.pop_up(form.footprint, form.trimmed.boundary, ROD, ends="clamped", start="flat")
    np.testing.assert_allclose(risen.positions, form.popped["clamped"].positions, atol=1e-8)


def test_shells_with_twist_angles_are_followed_too() -> None:
    """Pins turn the frames of rods: the angles are guessed from the clamped shell."""
    layout = rs.GridLayout.orthogonal(rods=(5, 5), spacing=0.09, edge=0.03)
    form = rs.find_form(rs.Hemisphere(0.2), layout, ROD, joint=rs.Pin())
    assert form.popped["clamped"].shell.angles
    assert reached_by_turning(form.popped["pinned"], form.popped["clamped"])


def test_another_shape_is_not_what_the_ends_turn_to() -> None:
    """The clamped shell moved aside by 1 % of its size stands for a shape that turning does not lead to."""
    form = dome()
    clamped = form.popped["clamped"]
    aside = at_positions(clamped, clamped.positions + [0.002, 0.0, 0.0])
    assert reached_by_turning(form.popped["pinned"], aside) is False


def test_of_a_shell_that_is_not_followed_from_flat_nothing_is_said() -> None:
    assert check(dome().popped, ROD, stages=0).clamped_from_flat is None


def test_directions_turn_by_equal_angles_in_their_planes() -> None:
    random = np.random.default_rng(0)
    now, goal = (v / np.linalg.norm(v, axis=1)[:, None] for v in random.standard_normal((2, 5, 3)))
    whole = np.arccos(np.sum(now * goal, axis=1))
    for t in (0.0, 0.3, 1.0):
        there = turned(now, goal, t)
        np.testing.assert_allclose(np.linalg.norm(there, axis=1), 1.0, rtol=1e-14)
        np.testing.assert_allclose(np.arccos(np.clip(np.sum(now * there, axis=1), -1, 1)), t * whole, atol=1e-7)
        np.testing.assert_allclose(np.sum(np.cross(now, goal) * there, axis=1), 0.0, atol=1e-14)


def test_ends_point_outwards() -> None:
    mesh = dome().footprint.mesh
    outward = end_directions(mesh, mesh.flat)
    along = mesh.flat[mesh.ends[:, 1]] - mesh.flat[mesh.ends[:, 0]]
    assert np.all(np.sum(outward[1::2] * along, axis=1) > 0)
    assert np.all(np.sum(outward[::2] * along, axis=1) < 0)
