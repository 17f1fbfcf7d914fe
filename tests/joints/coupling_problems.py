"""What couplings must do: the same shell as with shared DOFs, or nearly so, by a known order.

The tests in `test_couplings.py` and the table of `tests/acceptance/joints.py` both read them.
"""

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.csgraph import connected_components

import rodshell as rs
from rodshell.solve.implicit_euler import ImplicitEuler, Refused, Step
from rodshell.solve.linear_stability import step_limit
from rodshell.solve.newton_matrix import Banded
from tests.joints.joint_problems import flat_state, lattice, response

KINDS = {"ball": rs.Ball(), "pin": rs.Pin(), "rigid": rs.Rigid(), "two linkers": rs.Linker()}
ROD = rs.Rod(rs.GivenSection(EA=300.0, EI1=1.0, EI2=1.0, GJ=0.7, mass=1.0, rotary_inertia=0.02))
EDGE = 0.15
DECADES = 10.0 ** np.arange(2, 7)  # of C over the stiffness of an edge in bending and in twist


def bent(joint, coupling, count=2):
    """A lattice of 2 by 2 rods."""
    grid = lattice(joint, edge=EDGE, rod=ROD, count=count)
    return rs.Shell.of(grid.mesh, ROD, joint=joint, coupling=coupling, twist=True)


def firm(share):
    return rs.ImplicitPenalty(C1=share * 1.0 / EDGE**3, C2=share * 0.7 / EDGE)


def _loaded(shell):
    """Supports at the ends of both rods along x, and a load on a rod along y: a force, and a moment about it."""
    free = shell.freedom().with_directions(shell.ends[:4])
    load = np.zeros((len(shell.like), 3))
    load[shell.ends[4]] = [0.3, -0.2, 1.0]
    edge = shell.first_angle + int(np.flatnonzero(shell.mesh.edge_rods == 2)[-1])
    if not len(shell.spinning):  # else it would turn the rod about itself for ever
        load[edge, 0] = 0.5
    return free, load


def static_errors(joint):
    """Of the small response under a load with implicit ties, relative to shared DOFs, for each of DECADES."""
    shared = bent(joint, rs.SharedDofs())
    exact = shared.positions(response(shared, *_loaded(shared)))
    errors = []
    for share in DECADES:
        shell = bent(joint, firm(share))
        moved = shell.positions(response(shell, *_loaded(shell)))
        errors.append(float(np.linalg.norm(moved - exact) / np.linalg.norm(exact)))
    return np.array(errors)


def step_errors(joint, step=0.02):
    """Of the nodes' motion in one step of a lattice that is thrown, relative to shared DOFs, for each of DECADES."""
    moved = []
    for coupling in (rs.SharedDofs(), *(firm(share) for share in DECADES)):
        shell = bent(joint, coupling)
        taken = ImplicitEuler().take(rs.Motion.of(shell), flat_state(shell), thrown(shell, 0.05), time=0.0, step=step)
        assert isinstance(taken, Step)
        moved.append(shell.positions(taken.state - flat_state(shell)))
    return np.array([np.linalg.norm(one - moved[0]) / np.linalg.norm(moved[0]) for one in moved[1:]])


def thrown(shell, speed=1.0):
    """(N, 3) velocities, those of tied nodes the same."""
    rng, shared = np.random.default_rng(3), np.zeros((shell.like.max() + 1, 3))
    shared[: shell.mesh.node_count] = speed * rng.normal(size=(shell.mesh.node_count, 3))
    return shared[shell.like]


def explicit_errors(joint, steps, until=0.02):
    """Between explicit and implicit ties of the same stiffness, of the nodes' places at `until` [m], by the step."""
    ties = {"C1": 20.0 / EDGE**3, "C2": 0.7 / EDGE}
    errors = []
    for count in steps:
        ends = []
        for coupling in (rs.ImplicitPenalty(**ties), rs.ExplicitPenalty(**ties)):
            shell = bent(joint, coupling)
            series = rs.simulate(
                rs.Motion.of(shell), flat_state(shell), thrown(shell, 0.1), until=until, step=until / count
            )
            ends.append(shell.positions(series.states[-1]))
        errors.append(float(np.abs(ends[1] - ends[0]).max()))
    return np.array(errors)


def masses(shell):
    """Total mass [kg] and total rotary inertia [kg m2]."""
    nodes = shell.like < shell.mesh.node_count
    return float(shell.mass[nodes, 0].sum()), float(shell.mass[~nodes, 0].sum())


# The step limit of explicit ties


def element(joint, coupling=None, rod=ROD, edge=0.1):
    """Two rods of two edges each that cross in their middles."""
    grid = rs.straight_rods([[[-edge, 0], [edge, 0]], [[0, -edge], [0, edge]]])
    ties = coupling or rs.ExplicitPenalty(C1=5.0 / edge**3, C2=0.7 / edge)
    return rs.Shell.of(rs.mesh_grid(grid, edge), rod, joint=joint, coupling=ties, twist=True)


def growth(joint, share, steps):
    """Largest motion in `steps` steps over that at the start, the step being `share` of the limit; inf once it is lost.

    The start is a hundred thousandth of an edge: the motion is that of the linearised element.
    """
    shell = element(joint)
    motion, state = rs.Motion.of(shell), flat_state(shell)
    step = share * step_limit(motion, state)
    rng, unused = np.random.default_rng(1), np.zeros_like(state)
    free = motion.constraint_at(0.0).freedom(state)
    start = 1e-6 * free.expand(rng.normal(size=free.size))
    flat, state, velocity, largest = state, state + start, unused, 0.0
    stepper = ImplicitEuler()
    for number in range(steps):
        taken = stepper.take(motion, state, velocity, time=number * step, step=step)
        if isinstance(taken, Refused):
            return np.inf
        state, velocity = taken.state, taken.velocity
        motion = motion.refreshed(state)
        largest = max(largest, float(np.abs(state - flat).max() / np.abs(start).max()))
        if largest > 1e3:
            return np.inf
    return largest


def closed_form_limits():
    """Limits found, over sqrt(2m/C1) for ball joints, sqrt(m/2C1) with two linkers, and sqrt(I/C2) for twist.

    m and I are those of a single rod's node and edge; the rods are so soft that only ties count.
    """
    soft = rs.Rod(rs.GivenSection(EA=1e-6, EI1=1e-9, EI2=1e-9, GJ=1e-9, mass=1.0, rotary_inertia=0.02))
    edge = 0.1
    m, inertia = edge * soft.mass_per_length, edge * soft.rotary_inertia
    found = {}
    for name, joint, c1, c2, exact in (
        ("ball", rs.Ball(), 3.0, 1e-9, np.sqrt(2 * m / 3.0)),
        ("two linkers", rs.Linker(), 3.0, 1e-9, np.sqrt(m / (2 * 3.0))),
        ("twist", rs.Linker(), 1e-6, 3.0, np.sqrt(inertia / 3.0)),
    ):
        shell = element(joint, rs.ExplicitPenalty(C1=c1, C2=c2), soft, edge)
        found[name] = step_limit(rs.Motion.of(shell), flat_state(shell)) / exact
    return found


# Banded systems


def systems(shell):
    """Half bandwidth of the matrix of a step, and of how many systems that do not touch it consists."""
    stepper = ImplicitEuler()
    motion = rs.Motion.of(shell)
    taken = stepper.take(motion, flat_state(shell), thrown(shell), time=0.0, step=1e-4)
    assert isinstance(taken, Step)
    pairs = [np.column_stack([one.blocks[:, :-1].ravel(), one.blocks[:, 1:].ravel()]) for one in motion.elements]
    row, column = np.vstack(pairs).T
    graph = csc_matrix((np.ones(len(row)), (row, column)), shape=(len(shell.like),) * 2)
    width = stepper.matrix.half_bandwidth if isinstance(stepper.matrix, Banded) else None
    return width, connected_components(graph, directed=False)[0]
