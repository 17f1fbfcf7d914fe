"""Joints and ties against Taylor's theorem, against a slow twin, and against rigid motions.

The grid has crossings of two rods, one of three, a rod that ends on another and a corner of two rod ends; joints of
every kind, on shared and on separate nodes. Quantities are of the order of 1.
"""

from dataclasses import replace
from functools import cache
from math import inf

import numpy as np
import pytest
from numpy.linalg import norm
from scipy.spatial.transform import Rotation

import rodshell as rs
from rodshell.joints import ExplicitPenalty, ImplicitPenalty, SharedDofs
from rodshell.joints.relative_rotation import RelativeRotation

RODS = [
    [[-2.0, 0.0], [2.0, 0.0]],
    [[-2.0, 1.0], [2.0, 1.2]],
    [[-0.5, -2.0], [-0.5, 2.0]],
    [[-2.0, -1.5], [1.0, 1.5]],  # meets the first and the third where they cross
    [[1.2, 0.0], [1.3, 2.0]],  # ends on the first
    [[2.0, 0.0], [2.8, 2.0]],  # a corner with the first
    [[-1.5, 1.025], [-1.8, -1.0]],  # ends on the second
]
JOINTS = {
    "pin": rs.Pin(),
    "rigid": rs.Rigid(),
    "spring": rs.Spring(0.7, 1.3, 0.4),
    "spring at another angle": rs.Spring(0.7, 1.3, 0.4, rest_angle=0.4),
    "shear alone": rs.Spring(0.7),
    "twist alone": rs.Spring(twist=2.0),
    "two linkers": rs.Linker(),
    "four linkers of their own rod": rs.Linker(rod=rs.Rod(rs.GivenSection(EA=1, EI1=0.4, EI2=0.9, GJ=0.3)), corners=4),
    "eccentric pin": rs.Pin(eccentricity=0.2),
    "eccentric spring": rs.Spring(0.3, 0.2, 0.2, eccentricity=0.2),
}
COUPLINGS = {
    "shared": SharedDofs(),
    "implicit": ImplicitPenalty(C1=3.0, C2=2.0),
    "explicit": ExplicitPenalty(C1=3.0, C2=2.0),
}
CASES = [(joint, coupling) for joint in JOINTS for coupling in COUPLINGS]
every_case = pytest.mark.parametrize(("joint", "coupling"), CASES, ids=[" ".join(case) for case in CASES])


def grid_of(joint):
    rods = RODS if JOINTS[joint].eccentricity == 0 else [RODS[k] for k in (0, 1, 2, 4, 5)]  # those fit in two layers
    return rs.straight_rods(rods)


@cache
def shell_of(joint, coupling, isotropic=False):
    rod = rs.Rod(rs.GivenSection(EA=3, EI1=1, EI2=1 if isotropic else 2, GJ=0.8, mass=1, rotary_inertia=0.1))
    mesh = rs.mesh_grid(grid_of(joint), 0.5)
    return rs.Shell.of(mesh, rod, joint=JOINTS[joint], coupling=COUPLINGS[coupling])


def unused(shell):
    """(N, 3) 1 where a block's component is a degree of freedom."""
    mask = np.ones((len(shell.like), 3))
    mask[shell.like >= shell.mesh.node_count + len(shell.ghosts), 1:] = 0.0
    return mask


def state_of(shell, rng, size):
    return shell.state(shell.mesh.flat) + size * unused(shell) * rng.normal(size=(len(shell.like), 3))


def evaluate(elements, state):
    """Energy, gradient (N, 3), and the product of the Hessian with a direction."""
    gradient, width = np.zeros_like(state), 3 * elements.blocks.shape[1]
    hessians = np.full((len(elements.blocks), width, width), np.nan)
    energy = elements.evaluate(state, gradient, hessians)

    def times(direction):
        result = np.zeros_like(state)
        product = np.einsum("mij,mj->mi", hessians, direction[elements.blocks].reshape(-1, width))
        np.add.at(result, elements.blocks, product.reshape(*elements.blocks.shape, 3))
        return result

    return energy, gradient, hessians, times


def joint_elements(shell):
    """All that is not a rod's own."""
    return [*shell.within[1:], *shell.between]


@every_case
@pytest.mark.parametrize("away", [0.0, 0.03], ids=["at the source", "away from the source"])
def test_gradient_and_hessian_are_the_derivatives(joint, coupling, away):
    shell, rng = shell_of(joint, coupling), np.random.default_rng(5)
    state = state_of(shell, rng, 0.04)
    direction = unused(shell) * rng.normal(size=state.shape)
    elements = joint_elements(shell)
    assert elements
    for one in elements:
        moved = one.refreshed(state)
        at = state + away * unused(shell) * rng.normal(size=state.shape)
        energy, gradient, hessians, times = evaluate(moved, at)
        assert norm(gradient) > 0
        steps, first, second = 10 ** np.linspace(-2, -3, 5), [], []
        for h in steps:  # central differences: what is left over is of third order
            ahead, behind = np.zeros_like(at), np.zeros_like(at)
            change = moved.evaluate(at + h * direction, ahead) - moved.evaluate(at - h * direction, behind)
            first.append(abs(change - 2 * h * np.vdot(gradient, direction)))
            second.append(norm(ahead - behind - 2 * h * times(direction)))
        floor = 1e-11 * (abs(energy) + norm(gradient))  # ties of rods that meet are quadratic: nothing is left over
        for left in (first, second):
            # a wrong gradient or Hessian leaves the first order; where the third happens to be small, the fifth is left
            assert max(left) <= floor or np.polyfit(np.log(steps), np.log(left), 1)[0] > 2.9
        assert norm(hessians - hessians.transpose(0, 2, 1)) <= 1e-12 * norm(hessians)


@every_case
def test_joints_are_at_rest_in_the_flat_grid_and_feel_no_rigid_motion(joint, coupling):
    shell, rng = shell_of(joint, coupling), np.random.default_rng(6)
    flat = shell.state(shell.mesh.flat, normals=np.tile([0.0, 0.0, 1.0], (shell.mesh.node_count, 1)))
    bent = flat + 0.1 * unused(shell) * rng.normal(size=flat.shape)
    turn, shift = Rotation.from_rotvec([0.7, -0.4, 1.1]).as_matrix(), np.array([0.3, -2.0, 0.9])
    for one in joint_elements(shell):
        at_rest = one.evaluate(flat, np.zeros_like(flat))
        if "angle" not in joint:
            assert at_rest < 1e-20
        # along the way the source follows, as it does in a solve; frames then turn with the rods
        moved, state = one.refreshed(bent), bent.copy()
        energy = moved.evaluate(bent, np.zeros_like(bent))
        nodes = shell.like < shell.mesh.node_count
        state[nodes] = bent[nodes] @ turn.T + shift
        turned = _rotated(moved, turn)
        assert turned.evaluate(state, np.zeros_like(state)) == pytest.approx(energy, rel=1e-11, abs=1e-18)


def _rotated(element, turn):
    """The element with its source frames turned."""
    if hasattr(element, "bends"):
        return replace(element, bends=_rotated(element.bends, turn))
    if not hasattr(element, "source_tangents"):
        return element
    return replace(
        element,
        source_tangents=element.source_tangents @ turn.T,
        source_directors=element.source_directors @ turn.T,
    )


def test_strains_are_the_rotation_of_one_section_against_the_other():
    """A twin by rotation matrices: turn the second rod as a body about its joint and read the angles off."""
    shell = shell_of("spring", "shared")
    joint = next(one for one in shell.between if isinstance(one, RelativeRotation) and len(one.legs) == 4)
    flat = shell.state(shell.mesh.flat)
    only = 0  # one joint of the set
    a, b = (joint.sections(flat)[only, rod] for rod in range(2))
    for axis, expected in (((0, 0, 1), (1, 0, 0)), (a[0], (0, -1, 0)), (np.cross([0, 0, 1], a[0]), (0, 0, 1))):
        for angle in (1e-4, -1e-4):
            state, turn = flat.copy(), Rotation.from_rotvec(angle * np.asarray(axis)).as_matrix()
            middle = flat[joint.blocks[only, joint.legs[0, 1]]]
            for leg in joint.legs[joint.legs[:, 3] == 1]:
                nodes = joint.blocks[only, leg[:2]]
                state[nodes] = (flat[nodes] - middle) @ turn.T + middle
                tangent = b[0] / norm(b[0])
                state[joint.blocks[only, leg[2]], 0] = angle * np.dot(axis, tangent)
            # second order terms: 1e-8
            assert joint.strains(state)[only] == pytest.approx(angle * np.array(expected), abs=2e-8)


def test_a_joint_gives_way_freely_where_it_is_said_to():
    pin = next(one for one in shell_of("pin", "shared").between)
    assert np.abs(pin.stiffness[:, 0]).max() == 0.0
    assert np.abs(pin.stiffness[:, :, 0]).max() == 0.0
    assert np.linalg.eigvalsh(pin.stiffness[:, 1:, 1:]).min() > 0.1


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: rs.Spring(-1.0), "shear stiffness must be 0 or more, not -1.0"),
        (lambda: rs.Spring(float("nan")), "shear stiffness must be 0 or more, not nan"),
        (lambda: rs.Pin(eccentricity=-0.1), "eccentricity must be 0 or more, not -0.1"),
        (lambda: rs.Rigid(rest_angle=7.0), "rest angle must lie between -pi and pi, not 7.0"),
        (lambda: rs.Linker(corners=3), "2 or 4 of its corners, not in 3"),
        (lambda: rs.ImplicitPenalty(C1=0.0), "C1 must be positive, not 0.0"),
        (lambda: rs.ExplicitPenalty(C2=inf), "C2 must be positive, not inf"),
    ],
)
def test_nonsense_is_refused(make, words):
    with pytest.raises(rs.InputError, match=words):
        make()
