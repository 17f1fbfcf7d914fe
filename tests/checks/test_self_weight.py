"""What share of its own weight a shell bears, and what is said of it. Figures: `checks/test_loaded_shells.py`."""

import numpy as np
import pytest

import rodshell as rs
from rodshell.checks.self_weight import self_weight
from rodshell.figures.checks import SelfWeight
from rodshell.model import Shell
from tests.checks.shells import ROD, dome


def found(form: rs.Form) -> SelfWeight:
    popped = form.popped["pinned"]
    return self_weight(popped.shell, popped.equilibrium)[0]


def with_rod(rod: rs.Rod) -> rs.Form:
    form = dome()
    return rs.find_form(form.target, form.layout, rod, ends=("pinned",))


def test_the_factor_goes_with_stiffness_over_density():
    stiffer = rs.Rod(ROD.section, rs.Material(youngs_modulus=60e6, density=2e3))
    small, large = found(dome()), found(with_rod(stiffer))
    assert large.load_factor == pytest.approx(30 * small.load_factor, rel=1e-6)


@pytest.mark.parametrize("times", [2.0, 5.0])
def test_the_factor_goes_with_the_square_of_the_thickness(times):
    """By which the verdict says how thick rods would have to be. It is 4 % less where they are 5 times as thick: they
    are less slender then."""
    thick = rs.Rod(rs.Circle(times * ROD.section.radius), ROD.material)
    small, large = found(dome()), found(with_rod(thick))
    assert 0.95 < large.load_factor / (times**2 * small.load_factor) < 1.005


def test_the_deflection_goes_with_density_over_stiffness_alone():
    stiff = rs.Rod(ROD.section, rs.Material(youngs_modulus=200e6, density=1e3))
    stiffer = rs.Rod(ROD.section, rs.Material(youngs_modulus=2e9, density=10e3))
    assert found(with_rod(stiffer)).deflection == pytest.approx(found(with_rod(stiff)).deflection, rel=1e-6)


def test_what_bears_more_than_100_times_its_weight_has_no_factor_but_a_deflection():
    steel = found(with_rod(rs.Rod(ROD.section, rs.Material(210e9, 7850, 0.3))))
    assert steel.load_factor is None
    assert steel.limit == "none"
    assert 0 < steel.deflection < 1e-4 * 0.2


def test_rods_without_a_mass_are_said_to_have_none():
    given = rs.Rod(rs.GivenSection(EA=3.0, EI1=8e-7, EI2=8e-7, GJ=5e-7))
    form = with_rod(given)
    archive = form.archive()
    assert archive.results.plain()["self_weight"]["pinned"] == {
        "load_factor": None,
        "deflection": None,
        "limit": "no mass",
    }
    assert "no mass was given" in archive.results.plain()["verdict"]["reasons"][0]
    assert "own weight: pinned unknown: no mass was given" in archive.summary(verbose=True)


@pytest.mark.parametrize("eccentricity", [0.0, 1e-3])
def test_joints_weigh_what_they_are_said_to_weigh_half_on_either_rod(eccentricity):
    mesh = dome().footprint.mesh
    bare, heavy = (
        Shell.of(mesh, ROD, joint=rs.Pin(eccentricity=eccentricity, mass=mass)).mass[:, 2] for mass in (0.0, 2e-3)
    )
    more = (heavy - bare)[heavy > bare]
    assert more.sum() == pytest.approx(2e-3 * len(mesh.grid.crossings))
    assert np.allclose(more, 1e-3 if eccentricity else 2e-3)


def test_heavy_joints_leave_less_to_bear():
    form = dome()
    heavy = rs.find_form(form.target, form.layout, ROD, ends=("pinned",), joint=rs.Ball(mass=1e-4))
    share = ROD.mass_per_length * form.footprint.mesh.edge_lengths.sum()
    share /= share + 1e-4 * len(form.footprint.mesh.grid.crossings)
    assert found(heavy).load_factor == pytest.approx(share * found(form).load_factor, rel=0.2)  # they sit high up


def test_summary_and_result_say_both_kinds_of_ends():
    archive = dome().archive()
    for ends, said in archive.results.plain()["self_weight"].items():
        assert said["limit"] == "bifurcation"
        assert f" {ends} {100 * said['load_factor']:.2g} %" in archive.summary()
    assert "stable, unloaded" in archive.summary(verbose=True)


def test_a_rubber_hemisphere_sinks_evenly_under_its_weight():
    popped = dome().popped["clamped"]
    shell, settled = popped.shell, popped.equilibrium
    lighter, _ = self_weight(shell, settled, gravity=9.81 / 100)
    half, _ = self_weight(shell, settled, gravity=9.81 / 200)
    assert lighter.load_factor == pytest.approx(half.load_factor / 2, rel=1e-6)
    assert np.isclose(lighter.deflection, 2 * half.deflection, rtol=0.15)  # nearly linear far below the limit


@pytest.mark.slow
def test_a_roof_of_thin_laths_is_said_first_not_to_stand():
    """5 x 15 mm over 12 m: their EA is some 1e5 times EI over the square of the spacing. Differences of the stiffness
    on one side of a point lose this path after 120 factorisations."""
    case = {"target.unit": "mm", "rod.material.preset": "larch", "checks.stages": 0}
    results = rs.Job.load("examples/data/freeform.obj", case).run().archive().results
    assert {weighed.limit for weighed in results.self_weight.values()} == {"limit point"}
    assert results.verdict.reasons[0].startswith(
        "the shell does not stand under its own weight: it carries only 9.2 % of it with pinned ends and 62 % of it "
        "with clamped ends; its section was chosen to withstand its bends, and no size that is sold is likely to "
        "carry it and to withstand its bends; made of rods about 2.1 times as thick, it would carry 2.7 times its own "
        "weight with clamped ends, by an estimate, but they would use 120 % of larch's permanent design strength by "
        "EN 1995-1-1"
    )
    assert results.verdict.reasons[-1].startswith("U14 runs ")
    assert not any("could not be followed" in reason for reason in results.verdict.reasons)
