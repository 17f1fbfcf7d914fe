"""Energies and supports of one's own, against laws that hold for any energy and against the package's own kinds."""

import numpy as np
import pytest

import rodshell as rs

ROD = rs.Rod(rs.Circle(radius=1e-3), rs.Material(25e9, 1900))


@pytest.fixture(scope="module")
def form() -> rs.Form:
    layout = rs.GridLayout.orthogonal(rods=(5, 5), spacing=0.08, length="auto", edge=0.02)
    return rs.find_form(rs.Hemisphere(radius=0.2), layout, ROD, ends=("pinned", "clamped"))


def volume(x):
    """Of tetrahedra (m, 4, 3), squared: a smooth energy of four nodes."""
    return np.linalg.det(x[:, 1:] - x[:, :1]) ** 2


def test_gradients_and_hessians_are_those_of_the_formula():
    random = np.random.default_rng(1)
    state, blocks = random.normal(size=(9, 3)), random.permuted(np.tile(np.arange(9), (5, 1)), axis=1)[:, :4]
    energy = rs.LocalEnergy(blocks, volume)
    gradient, hessians = np.zeros_like(state), np.empty((5, 12, 12))
    assert energy.evaluate(state, gradient, hessians) == pytest.approx(volume(state[blocks]).sum(), rel=1e-14)
    for m, row in enumerate(blocks):
        edges = state[row[1:]] - state[row[0]]
        cofactors = np.linalg.det(edges) * np.linalg.inv(edges).T  # d det / d edges
        slope = np.vstack([-cofactors.sum(axis=0), cofactors])
        np.testing.assert_allclose(rs.LocalEnergy(row[None], volume)._gradient(state[row[None]])[0],
                                   2 * np.linalg.det(edges) * slope, rtol=1e-12)  # fmt: skip
        np.testing.assert_allclose(hessians[m] @ np.tile(np.eye(3), (4, 1)), 0, atol=1e-6)  # moved as a whole
    np.testing.assert_allclose(gradient.sum(axis=0), 0, atol=1e-12)


def test_a_dead_load_is_an_energy_and_is_what_the_supports_carry(form):
    node, force = int(form.footprint.mesh.joint_nodes[4]), np.array([0.02, -0.01, -0.1])
    shell = rs.settle(form.popped["pinned"], rs.LocalEnergy([[node]], lambda x: -(x[:, 0] @ force)))
    assert shell.report.stable
    np.testing.assert_allclose(shell.equilibrium.gradient.sum(axis=0), -force, rtol=1e-9)
    before = form.popped["pinned"]
    assert (shell.positions[node] - before.positions[node]) @ force > 0


def test_stiff_springs_at_free_ends_are_supports_and_weak_ones_are_none(form):
    pinned, nodes = form.popped["pinned"], form.footprint.mesh.ends.reshape(-1, 1)
    points, free = form.boundary.points, {end: np.eye(3)[:2] for end in range(len(form.boundary.points))}
    reaction = pinned.equilibrium.gradient[nodes[:, 0], :2]

    def on_springs(k):
        return rs.settle(pinned, rs.LocalEnergy(nodes, lambda x: k / 2 * ((x[:, 0] - points) ** 2).sum(1)), free=free)

    stiff, weak = on_springs(1e7), on_springs(10.0)
    slid = stiff.positions[nodes[:, 0], :2] - points[:, :2]
    np.testing.assert_allclose(-1e7 * slid, reaction, atol=1e-3 * np.abs(reaction).max())
    assert np.abs(weak.positions[nodes[:, 0]] - points).max() > 0.01
    assert weak.equilibrium.problem.potential(weak.state) < pinned.equilibrium.energy


def test_without_anything_new_a_shell_stays_where_it_is(form):
    for shell in form.popped.values():
        np.testing.assert_allclose(rs.settle(shell).positions, shell.positions, atol=1e-12)


@pytest.mark.parametrize(
    ("energies", "options", "sentence"),
    [
        ([rs.LocalEnergy([[10**6]], lambda x: x[:, 0, 0])], {}, "acts on node 1000000: the shell has "),
        ([rs.LocalEnergy([[0]], lambda x: np.abs(x[:, 0, 0]))], {}, "no gradient: leave abs, real and norm out of it"),
        (
            [rs.LocalEnergy([[0], [1]], lambda x: x[:, 0])],
            {},
            r"shape \(2, 3\): give one energy for each of its 2 parts",
        ),
        ([], {"free": {99: [(1, 0, 0)]}}, "a rod end in free"),
        ([], {"free": {0: [(1, 0, 0), (1, 1, 0)]}}, "rod end 0 may move are not at right angles"),
        ([], {"free": {0: [(0, 0, 0)]}}, "a direction of rod end 0"),
        ([3], {}, "energies must be an energy, such as rodshell.LocalEnergy, or a list of them, not 3"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_sentence(form, energies, options, sentence):
    with pytest.raises(rs.InputError, match=sentence):
        rs.settle(form.popped["pinned"], energies, **options)
    with pytest.raises(rs.InputError, match="a clamped rod end cannot be set free"):
        rs.settle(form.popped["clamped"], free={0: [(1, 0, 0)]})


@pytest.mark.parametrize("blocks", [[[0.5]], [0, 1], [[-1]], "nodes"])
def test_nodes_are_a_table_of_whole_numbers(blocks):
    with pytest.raises(rs.InputError, match="the nodes of an energy"):
        rs.LocalEnergy(blocks, volume)
