"""What follows from a factor on EI, against the rod of the changed section."""

import numpy as np
import pytest

from rodshell.checks.bending import fibre_strain, torsion_stress
from rodshell.errors import InputError
from rodshell.rods.materials import Material
from rodshell.rods.section import Circle, Ellipse, GivenSection, RectangularSection, Rod, Tube
from rodshell.rods.varied import sizes, varied

GLASS = Material(25e9, 1900.0, shear=4e9)
CIRCLE, TUBE = Circle(3e-3), Tube(20e-3, 3e-3)
UPRIGHT, FLAT, OVAL = RectangularSection(30e-3, 8e-3), RectangularSection(4e-3, 25e-3), Ellipse(2e-3, 5e-3)
SERIES = 3e-6  # the torsion constant's series, cut after eight terms here and after 25 there


def changed(section, varies, factor):
    """The section of which EI1 is `factor` times that of `section`."""
    lengths = dict(vars(section))
    if varies == "size":
        lengths = {name: factor**0.25 * value for name, value in lengths.items()}
    else:
        lengths[varies] *= factor ** (1 / 3) if varies in ("width", "a") else factor
    return type(section)(**lengths)


@pytest.mark.parametrize("factor", [0.05, 0.4, 1.0, 8.0])
@pytest.mark.parametrize(
    ("section", "varies"),
    [(CIRCLE, "size"), (TUBE, "size"), (UPRIGHT, "size"), (OVAL, "size")]
    + [(section, side) for section in (UPRIGHT, FLAT) for side in ("width", "height")]
    + [(OVAL, "a"), (OVAL, "b")],
)
def test_every_value_is_that_of_the_changed_section(section, varies, factor):
    rod, other = Rod(section, GLASS), Rod(changed(section, varies, factor), GLASS)
    by = {name: value[0] for name, value in vars(varied(rod, varies, np.array([factor]))).items()}
    ei1, ei2 = rod.bend_stiffnesses
    assert (by["bend1"] * ei1, by["bend2"] * ei2) == pytest.approx(other.bend_stiffnesses, rel=1e-12)
    assert by["bend1"] == pytest.approx(factor, rel=1e-12)
    assert by["twist"] * rod.twist_stiffness == pytest.approx(other.twist_stiffness, rel=SERIES)
    assert by["stretch"] * rod.stretch_stiffness == pytest.approx(other.stretch_stiffness, rel=1e-12)
    assert by["stretch"] * rod.mass_per_length == pytest.approx(other.mass_per_length, rel=1e-12)
    assert by["rotary"] * rod.rotary_inertia == pytest.approx(other.rotary_inertia, rel=1e-12)
    for axis, name in enumerate(("fibre1", "fibre2")):
        bend = np.eye(2)[axis]
        assert by[name] * fibre_strain(rod, *bend) == pytest.approx(fibre_strain(other, *bend), rel=1e-12)
    rate = np.ones(1)
    # 33 points on a quarter of an ellipse: its narrowest place is one of them, exactly
    assert by["shear"] * torsion_stress(rod, rate) == pytest.approx(torsion_stress(other, rate), rel=1e-3)
    whole = changed(section, varies, factor)
    expected = whole.depth if varies == "size" else getattr(whole, varies) * (2 if varies in "ab" else 1)
    assert sizes(rod, varies, np.array([factor]))[0] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("section", [CIRCLE, UPRIGHT, GivenSection(1e4, 2.0, 3.0, 1.0, mass=0.3)])
def test_two_laths_that_slip_have_twice_the_stiffness_and_the_fibres_of_one(section):
    rod = Rod(section) if isinstance(section, GivenSection) else Rod(section, GLASS)
    by = varied(rod, "laths", np.array([2.0]))
    for name in ("bend1", "bend2", "twist", "stretch", "rotary", "depth1"):
        assert getattr(by, name)[0] == 2.0, name
    for name in ("fibre1", "fibre2", "depth2", "shear"):
        assert getattr(by, name)[0] == 1.0, name
    assert sizes(rod, "laths", np.array([2.0])) is None


def test_a_length_that_a_section_does_not_have_is_refused():
    with pytest.raises(InputError, match=r"a Circle has no width .* choose size or laths"):
        varied(Rod(CIRCLE, GLASS), "width", np.ones(1))
