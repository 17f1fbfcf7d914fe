"""What beams along the edge use of their strength: by hand, and what the verdict says of it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import rodshell as rs
from rodshell.loads.edge_beams import used_beams
from rodshell.loads.settings import Strength
from rodshell.results.verdict import verdict
from tests.loads.shells import TUBE, grid, one

TUBE_OF_STEEL = rs.Tube(0.02, 0.002)
YIELD = 235e6


@cache
def on(rod: rs.Rod) -> rs.Form:
    ring, posts = rs.Ring(rod=rod), rs.SprungEnds(stiffness=(2e3, 2e3, 1e8))
    return rs.find_form(rs.Cap(10.0, 4.0), grid(3.0, 1.5), TUBE, ends=rs.SupportGroups(groups=(ring, posts)))


def of_steel() -> rs.Form:
    return on(rs.Rod(TUBE_OF_STEEL, rs.Material.preset("steel")))


def test_stress_and_share_are_those_of_forces_and_bends_by_hand() -> None:
    popped = of_steel().popped["given"]
    (beam,) = popped.shell.beams
    (used,) = used_beams(popped.shell, popped.equilibrium, Strength(), None)
    forces, strains = beam.forces(popped.state), beam.bend.strains(popped.state)
    bends = strains[:, :2] - beam.bend.natural_curvature
    twists = strains[:, 2] - beam.bend.natural_twist
    lengths = beam.stretch.rest_lengths
    n = len(lengths)
    voronoi = 0.5 * (lengths + np.roll(lengths, -1))  # at the node after each edge
    section, e, g = beam.rod.section, 210e9, 81e9
    axial = 0.5 * (forces[:n] + np.roll(forces[:n], -1)) / section.area
    normal = np.abs(axial) + e * section.radius * np.linalg.norm(bends, axis=1) / voronoi
    shear = g * section.radius * np.abs(twists) / voronoi
    by_hand = np.sqrt(normal**2 + 3 * shear**2).max()
    assert used.max_stress == pytest.approx(by_hand, rel=2e-2)  # 3 of von Mises, the preset has sqrt(3) rounded
    assert used.tension == pytest.approx(forces.max())
    assert used.compression == 0.0 == used.euler
    assert used.utilisation is not None
    assert used.utilisation == pytest.approx(by_hand / YIELD, rel=2e-2)


def test_a_beam_pressed_between_two_rod_ends_is_held_against_its_euler_load() -> None:
    popped = of_steel().popped["given"]
    (beam,) = popped.shell.beams
    pressed = replace(popped.equilibrium, state=0.9995 * popped.state)  # as a whole
    (used,) = used_beams(popped.shell, pressed, Strength(effective_length=2.0), None)
    push = np.maximum(-beam.forces(pressed.state), 0.0)[:-1]
    assert used.compression == pytest.approx(push.max())
    assert push.max() > 0
    expected = (push * (2 * beam.stretch.rest_lengths) ** 2).max() / (np.pi**2 * beam.rod.bend_stiffness)
    assert used.euler == pytest.approx(expected, rel=1e-9)


def test_a_beam_that_breaks_is_said_and_a_shell_on_it_cannot_be_built() -> None:
    form = of_steel()
    (name, share) = ("E1", 1.234)
    used = form.results().edge_beams[0].unloaded
    assert used is not None
    broken = form.results().edge_beams[0].changed(unloaded=used.changed(utilisation=share))
    said = verdict(form.results().changed(edge_beams=(broken,)))
    assert said.level == "unbuildable"
    (finding,) = (each for each in said.findings if each.code == "strength_of_beam")
    assert (finding.figure, finding.limit, finding.support) == (share, 1.0, "given")
    assert any(name in reason and "123 % of its design strength before loads act" in reason for reason in said.reasons)


def test_of_a_beam_of_unknown_strength_that_is_said_with_loads_and_without() -> None:
    form = on(rs.Rod(TUBE_OF_STEEL, rs.Material(200e9, 7850.0)))
    said = "the design strength of beams along the edge is not known"
    assert [said in reason for reason in form.verdict.reasons].count(True) == 1
    assert not any(said in reason for reason in of_steel().verdict.reasons)


def judged(**figures: float | None) -> rs.Verdict:
    """The verdict on a shell under a combination, its beam having these figures."""
    form = of_steel()
    results = form.results()
    loads = one(rs.Snow(10.0), stability=rs.Stability(modes=1, imperfection=0), strength=Strength(permanent=1e9))
    shell = rs.check_loads(form, loads).shells["all"]["given"]
    beam = shell.edge_beams[0].changed(**figures)
    return verdict(results.changed(loads={"all": {"given": shell.changed(edge_beams=(beam,))}}))


@pytest.mark.parametrize(
    ("euler", "code", "words"),
    [
        (1.4, "strength_of_beam", "140 % of its Euler load under all, and buckles between two rod ends"),
        (0.8, "reserve_under_loads", "80 % of its Euler load under all, and with a reserve of 1.5 it may carry 67 %"),
        (0.6, None, "Euler"),
    ],
)
def test_a_beam_that_buckles_between_rod_ends_is_said(euler: float, code: str | None, words: str) -> None:
    found = judged(euler=euler)
    said = [each for each in found.findings if each.figure == euler]
    assert [each.code for each in said] == [code] * bool(code)
    assert any(words in reason for reason in found.reasons) == bool(code)
    assert code != "strength_of_beam" or found.level == "unbuildable"


def test_the_mass_of_beams_is_said_next_to_that_of_the_rods() -> None:
    form = of_steel()
    (beam,) = form.results().edge_beams
    assert beam.mass == pytest.approx(beam.length * 7850 * np.pi * (0.02**2 - 0.018**2))
    assert f" kg and beams of {beam.mass:.3g} kg along the edge" in form.archive().summary()
