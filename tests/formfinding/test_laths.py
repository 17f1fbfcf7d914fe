"""Grids of laths, whose stiffness out of the grid and within it differ: drape, pop-up, case file."""

import numpy as np
import pytest

import rodshell as rs
from rodshell.case import load_case

TARGET = rs.Hemisphere(radius=0.2)
LAYOUT = rs.GridLayout.orthogonal(rods=(7, 7), spacing=0.06, length=1.2, edge=0.02)
LATH = rs.Rod(rs.RectangularSection(width=1e-3, height=3e-3), rs.Material(11e9, 500.0, shear=0.69e9))


def given(EI1, EI2, GJ=2e-3):
    return rs.Rod(rs.GivenSection(EA=1e4, EI1=EI1, EI2=EI2, GJ=GJ))


def popped(rod, ends):
    trimmed = rs.trim(rs.drape(LAYOUT, rod, TARGET))
    return rs.pop_up(rs.map_back(trimmed), trimmed.boundary, rod, ends=ends)


def test_drape_asks_for_the_stiffness_within_the_surface_alone():
    """And, nothing being stretched, for no other."""
    states = [rs.drape(LAYOUT, rod, TARGET).positions for rod in (LATH, given(1.0, 7.0), given(3e-3, 3e-3))]
    for other in states[1:]:
        np.testing.assert_allclose(other, states[0], atol=1e-7 * TARGET.radius)


def test_nearly_round_rods_pop_up_as_round_ones():
    """With twist angles and without: two ways to the same shape. Pinned rods are free to spin."""
    round_rods, nearly = (popped(given(3e-3, EI2), "pinned") for EI2 in (3e-3, 3e-3 * (1 + 1e-9)))
    assert nearly.report.stable
    np.testing.assert_allclose(nearly.positions, round_rods.positions, atol=1e-9 * TARGET.radius)  # 3e-12 measured


@pytest.mark.slow
@pytest.mark.parametrize("ends", ["pinned", "clamped"])
def test_flat_and_upright_laths_pop_up(ends):
    """A dome of flat laths comes nearer to its target than one of laths on edge: these do not like to be curved.

    Pinned, these roll over at their ball joints and are the same dome in the end, at 0.87 times the energy of the one
    that steps of a fixed size stop at.
    """
    upright = rs.Rod(rs.RectangularSection(width=3e-3, height=1e-3), LATH.material)
    gaps = []
    for rod in (LATH, upright):
        found = popped(rod, ends)
        assert found.report.stable
        gaps.append(rs.agreement(found, TARGET).rms)
    assert max(gaps) < 0.05 * TARGET.radius
    if ends == "pinned":
        assert gaps[0] == pytest.approx(gaps[1], rel=1e-9)
    else:
        assert gaps[1] - gaps[0] > 1e-4 * TARGET.radius  # which way they lie is felt


SECTIONS = {
    "ellipse": ({"a": "1 mm", "b": "2 mm"}, rs.Ellipse(1e-3, 2e-3)),
    "rectangle": ({"width": "1 mm", "height": "3 mm"}, rs.RectangularSection(1e-3, 3e-3)),
    "given": (
        {"EA": "2 kN", "EI1": "5 N m2", "EI2": "0.006 kN m2", "GJ": "3000000 N mm2", "mass": "500 g/m"},
        rs.GivenSection(2e3, 5.0, 6.0, 3.0, mass=0.5),
    ),
}


@pytest.mark.parametrize("kind", SECTIONS)
def test_case_file_gives_each_section_and_comes_back(kind, tmp_path):
    keys, section = SECTIONS[kind]
    path = tmp_path / "case.toml"
    path.write_text("")
    case = load_case(path, {"rod.section.kind": kind, **{f"rod.section.{key}": text for key, text in keys.items()}})
    rod = case.build().rod
    assert rod.section == section
    assert (rod.material is None) == (kind == "given")
    path.write_text(case.to_toml())
    assert load_case(path).build().rod == rod


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('section = { kind = "given", EA = 1, EI1 = 1, EI2 = 1, GJ = 1 }\nmaterial = { density = 3 }', "leave it out"),
        ('section = { kind = "given", EA = 1, EI1 = 1, EI2 = "1 N", GJ = 1 }', "a bending stiffness such as"),
        ('section = { kind = "rectangle", width = 1 }', "rod.section.height is missing"),
        ('section = { kind = "ellipse", a = 1, b = -1 }', "larger than zero"),
        ('material = { shear = "1 MPa", poisson_ratio = 0.3 }', "in place of poisson_ratio"),
    ],
)
def test_case_file_refuses_sections_that_make_no_sense(text, says, tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(f"[rod]\n{text}\n")
    with pytest.raises(rs.InputError, match=says):
        load_case(path)


def test_timber_has_a_shear_modulus_of_its_own(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text('[rod.material]\nyoungs_modulus = "11 GPa"\nshear = "690 MPa"\n')
    rod = load_case(path).build().rod
    assert rod.material == rs.Material(11e9, 1000.0, shear=690e6)
