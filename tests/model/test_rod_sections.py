"""Rods whose sections change along them, in a shell: closed forms of beams, and rods of the changed section."""

from itertools import pairwise
from math import log

import numpy as np
import pytest
from scipy.sparse import csc_matrix

from rodshell.joints import Ball, Linker, Pin, Rigid, Spring
from rodshell.layout import FlatGrid, Profile, mesh_grid
from rodshell.layout.gridlayout import lattice_rod
from rodshell.model import Shell
from rodshell.model.assembly import Assembly
from rodshell.rods.materials import Material
from rodshell.rods.section import Circle, GivenSection, RectangularSection, Rod

LENGTH, FORCE = 0.8, 1e-3
ROD = Rod(Circle(2e-3), Material(10e9, 1500.0))
LATH = Rod(RectangularSection(width=3e-3, height=12e-3), Material(10e9, 600.0, shear=0.6e9))


def cantilever_tip(profile, edges):
    """Deflection of the end of a rod clamped at its start, per force at the end [m/N], for small displacements."""
    mesh = mesh_grid(FlatGrid.of([lattice_rod(0, "U", 0.0, 0.0, LENGTH)]), LENGTH / edges).with_profiles(profile)
    shell = Shell.of(mesh, ROD, clamped=True, twist=False)
    first, last = mesh.ends[0]
    free = shell.freedom().with_directions(np.array([first, shell.ghosts[0]]))
    free = free.with_directions(np.array([shell.ghosts[1]]), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    state = shell.state(mesh.flat, np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    parts, blocks, hessians = (*shell.elements, shell.stretch), [], []
    for part in parts:
        size = 3 * part.blocks.shape[1]
        hessians.append(np.empty((len(part.blocks), size, size)))
        blocks.append(part.blocks)
        part.evaluate(state, np.zeros_like(state), hessians[-1])
    assembly = Assembly.of(blocks, free)
    data = assembly.assemble(hessians, blocks, free)
    upper = csc_matrix((data, assembly.indices, assembly.indptr), shape=(free.size, free.size)).toarray()
    load = np.zeros_like(state)
    load[last, 2] = 1.0
    return free.expand(np.linalg.solve(upper + np.triu(upper, 1).T, free.reduce(load)))[last, 2]


def linear_tip(root, tip):
    """The integral of (L - s)^2 / EI over a cantilever whose EI is linear from its root to its tip [m/N]."""
    slope = (tip - root) / LENGTH  # EI = tip - slope x, x from the tip: integral of x^2 / (tip - slope x)
    return -(LENGTH**2 / (2 * slope)) - tip * LENGTH / slope**2 + tip**2 / slope**3 * log(tip / root)


def test_cantilever_of_linear_stiffness_meets_its_closed_form_to_second_order():
    root, tip = 4 * ROD.bend_stiffness, 0.5 * ROD.bend_stiffness
    profile = Profile((0.0, 1.0), (4.0, 0.5))
    errors = [abs(cantilever_tip(profile, n) / linear_tip(root, tip) - 1.0) for n in (8, 16, 32)]
    assert errors[-1] < 2e-3  # 1.3e-3 at 32 edges; of a uniform rod 4.9e-4
    assert [first / second for first, second in pairwise(errors)] == pytest.approx([4.0, 4.0], rel=0.05)


def test_double_laths_over_the_middle_bend_as_a_beam_of_three_segments():
    share, stiffness = 0.6, ROD.bend_stiffness
    a, b = 0.5 * (1 - share) * LENGTH, 0.5 * (1 + share) * LENGTH  # where they begin and end, from the clamp
    beam = ((LENGTH**3 - (LENGTH - a) ** 3) + (LENGTH - b) ** 3) / (3 * stiffness)
    beam += ((LENGTH - a) ** 3 - (LENGTH - b) ** 3) / (3 * 2 * stiffness)
    errors = [cantilever_tip(Profile.double(share), n) / beam - 1.0 for n in (11, 22, 44)]  # steps within edges
    assert np.abs(errors).max() < 5e-3
    assert abs(errors[-1]) < 5e-4


def test_mass_of_a_tapered_round_rod_is_that_of_its_solid():
    low, high = 0.3, 2.0
    mesh = mesh_grid(FlatGrid.of([lattice_rod(0, "U", 0.0, 0.0, LENGTH)]), LENGTH / 40)
    shell = Shell.of(mesh.with_profiles(Profile((0.0, 1.0), (low, high))), ROD)
    # EI grows as f, the area as sqrt(f), whose mean over f linear from a to b is 2/3 (b^1.5 - a^1.5)/(b - a)
    mean = 2 / 3 * (high**1.5 - low**1.5) / (high - low)
    assert shell.mass[: mesh.node_count, 2].sum() == pytest.approx(mean * LENGTH * ROD.mass_per_length, rel=1e-9)


def crossed(profile):
    """Three rods along x and two along y."""
    rods = [lattice_rod(0, f"U{k}", 0.1 * k, -0.3, 0.3) for k in (-1, 0, 1)]
    rods += [lattice_rod(1, f"V{k}", 0.1 * k, -0.3, 0.3) for k in (-1, 1)]
    return mesh_grid(FlatGrid.of(rods), 0.05).with_profiles(profile)


def bent(shell):
    """A state away from the flat grid, the same for shells of one mesh."""
    random = np.random.default_rng(5)
    flat = shell.mesh.flat
    raised = flat + np.column_stack([0 * flat[:, :2], 0.5 * flat[:, 0] ** 2 - 0.3 * flat[:, 1] ** 2])
    tangents = np.zeros((len(shell.ends), 3))
    tangents[0::2], tangents[1::2] = (-1.0, 0.0, 0.2), (1.0, 0.0, 0.2)
    state = shell.state(raised, tangents if len(shell.ghosts) else None)
    return state + 1e-4 * random.standard_normal(state.shape)


def evaluated(shell):
    state, gradient = bent(shell), np.zeros((len(shell.like), 3))
    return sum(part.evaluate(state, gradient) for part in (*shell.elements, shell.stretch)), gradient


JOINTS = [Ball(), Pin(), Rigid(), Spring(shear=0.02, out_of_plane=0.3, twist=0.1)]


@pytest.mark.parametrize("clamped", [False, True])
@pytest.mark.parametrize("joint", JOINTS, ids=lambda joint: joint.name)
def test_a_constant_profile_is_the_rod_of_the_changed_section(joint, clamped):
    thick = Rod(RectangularSection(width=2 ** (1 / 3) * 3e-3, height=12e-3), LATH.material)
    varied = Shell.of(crossed(Profile((0.0, 1.0), (2.0, 2.0), "width")), LATH, joint=joint, clamped=clamped)
    uniform = Shell.of(crossed(None), thick, joint=joint, clamped=clamped)
    (energy, gradient), (expected, by) = evaluated(varied), evaluated(uniform)
    assert energy == pytest.approx(expected, rel=1e-6)  # the torsion constant's series
    assert gradient == pytest.approx(by, abs=1e-6 * np.abs(by).max())
    assert varied.mass == pytest.approx(uniform.mass, rel=1e-12)


def test_two_laths_are_the_rod_of_twice_the_stiffness():
    ei1, ei2 = LATH.bend_stiffnesses
    both = Rod(GivenSection(2 * LATH.stretch_stiffness, 2 * ei1, 2 * ei2, 2 * LATH.twist_stiffness))
    varied = Shell.of(crossed(Profile((0.0, 1.0), (2.0, 2.0), "laths")), LATH, joint=Pin(), clamped=True)
    (energy, gradient), (expected, by) = (
        evaluated(varied),
        evaluated(Shell.of(crossed(None), both, joint=Pin(), clamped=True)),
    )
    assert energy == pytest.approx(expected, rel=1e-12)
    assert gradient == pytest.approx(by, abs=1e-12 * np.abs(by).max())


@pytest.mark.parametrize("joint", [*JOINTS, Linker()], ids=lambda joint: joint.name)
@pytest.mark.parametrize("varies", ["size", "width", "height", "laths"])
def test_a_factor_of_one_changes_no_bit(joint, varies):
    ones = Profile((0.0, 0.3, 1.0), (1.0, 1.0, 1.0), varies)
    (energy, gradient), (expected, by) = (
        evaluated(Shell.of(crossed(profile), LATH, joint=joint)) for profile in (ones, None)
    )
    assert energy == expected
    assert np.array_equal(gradient, by)


def test_one_rod_may_vary_among_uniform_ones():
    profiles = (None, Profile.double(0.5), None, None, None)
    shell, uniform = Shell.of(crossed(profiles), LATH), Shell.of(crossed(None), LATH)
    changed = shell.stretch.stiffness / uniform.stretch.stiffness
    own = shell.mesh.edge_rods == 1
    assert (changed[~own] == 1.0).all()
    assert sorted(set(changed[own].round(12))) == [1.0, 2.0]
