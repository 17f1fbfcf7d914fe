"""Records of rods, joints, shells and their energies: shown in one line, compared and hashed without surprises; and
arguments of the wrong kind are refused in one sentence each."""

import numpy as np
import pytest

import rodshell as rs
from rodshell.contact.modified_mass import ModifiedMass
from rodshell.joints.crossings import RodNodes

CIRCLE, RUBBER = rs.Circle(radius=1e-3), rs.Material(youngs_modulus=1e6, density=1e3)
ROD = rs.Rod(CIRCLE, RUBBER)
LATH = rs.Rod(rs.RectangularSection(width=1e-3, height=2e-3), RUBBER)
CROSS = rs.straight_rods([[[-1, 0], [1, 0]], [[0, -1], [0, 1]]])
MESH = rs.mesh_grid(CROSS, 0.2)
LINE = np.column_stack([np.linspace(0, 1, 11), np.zeros((11, 2))])
ALONE = rs.ElasticRod.of(LINE, LATH, clamped=("start",))
SHELL = rs.Shell.of(MESH, ROD, clamped=True, joint=rs.Pin(eccentricity=1e-3))
LINKED = rs.Shell.of(MESH, LATH, joint=rs.Linker(), coupling=rs.ImplicitPenalty())
VALUES = [
    CIRCLE,
    rs.Tube(0.02, 0.003),
    rs.Ellipse(0.02, 0.01),
    LATH.section,
    rs.GivenSection(EA=1.0, EI1=1.0, EI2=1.0, GJ=1.0, fibre_distances=[0.1, 0.2]),  # type: ignore[arg-type]
    RUBBER,
    rs.Material.preset("larch"),
    ROD,
    rs.Ball(),
    rs.Pin(eccentricity=0.01),
    rs.Rigid(),
    rs.Spring(1.0),
    rs.Linker(rod=ROD, corners=4),
    rs.SharedDofs(),
    rs.ImplicitPenalty(C1=1.0),
    rs.ExplicitPenalty(),
]
RECORDS = [
    ALONE,
    ALONE.stretch,
    *ALONE.elements,
    ALONE.strains(ALONE.state()),
    ALONE.freedom(),
    SHELL,
    *SHELL.elements,
    SHELL.freedom(),
    LINKED,
    *LINKED.elements,
    RodNodes(MESH, MESH.rod_nodes, 22),
    ModifiedMass(rs.Hemisphere(0.2), np.arange(3)),
]


def name(record: object) -> str:
    return type(record).__name__


@pytest.mark.parametrize("record", [*VALUES, *RECORDS], ids=name)
def test_a_record_is_shown_in_one_line_that_names_it(record: object) -> None:
    shown = repr(record)
    assert shown.startswith(f"{name(record)}(")
    assert "\n" not in shown
    assert "array" not in shown
    assert len(shown) < 260


@pytest.mark.parametrize("value", VALUES, ids=name)
def test_a_value_is_made_again_by_what_it_shows_and_equals_that(value: object) -> None:
    again = eval(repr(value), vars(rs) | {name: getattr(rs, name) for name in rs.__all__})
    assert again == value
    assert hash(again) == hash(value)
    assert value != "another"


@pytest.mark.parametrize("record", RECORDS, ids=name)
def test_a_record_that_holds_arrays_is_equal_to_itself_alone_and_can_be_hashed(record: object) -> None:
    assert all((record == other) == (record is other) for other in RECORDS)
    assert len({record, record}) == 1


def test_what_a_shell_and_a_rod_show_is_what_matters() -> None:
    assert repr(SHELL) == "Shell(22 nodes, 20 edges, clamped)"
    assert repr(LINKED).endswith(", 20 edges, pinned, implicit coupling)")
    assert repr(ALONE) == "ElasticRod(11 nodes, 1 m, clamped at start)"
    assert repr(ALONE.stretch) == "Stretch(blocks=(10, 2), rest_lengths=(10,), stiffness=(10,), multipliers=(10,))"
    assert repr(rs.Pin(eccentricity=0.01)) == "Pin(eccentricity=0.01)"
    assert repr(rs.Pin(eccentricity=np.float64(0.05))) == repr(rs.Pin(eccentricity=np.array(0.05)))
    assert repr(rs.Pin(eccentricity=np.array(0.05))) == "Pin(eccentricity=0.05)"
    assert repr(RUBBER) == "Material(youngs_modulus=1000000.0, density=1000.0)"


GIVEN = {"EA": 1.0, "EI1": 1.0, "EI2": 1.0, "GJ": 1.0}
WRONG = [
    (lambda: rs.Circle("1 mm"), 'section radius must be a number in m, not "1 mm"'),
    (lambda: rs.Circle(1e-300), "section radius must be at least 1e-09 m, not 1e-300 m"),
    (lambda: rs.Material(1e300, 1e3), r"Young's modulus must be at most 1e\+15 Pa, not 1e\+300 Pa"),
    (lambda: rs.Material(1e6, 1e-300), "density must be at least 1e-06 kg/m3, not 1e-300 kg/m3"),
    (lambda: rs.Circle(None), "section radius must be a number in m, not None"),
    (lambda: rs.Tube(0.02, "3 mm"), 'section thickness must be a number in m, not "3 mm"'),
    (lambda: rs.Tube(0.01, 0.02), "a tube's wall of 20 mm is thicker than half of its diameter, 20 mm"),
    (lambda: rs.Ellipse(0.1, [0.2]), "half-axis b must be a number in m, not a list"),
    (lambda: rs.RectangularSection(0.0, 0.1), "section width must be positive, not 0.0 m"),
    (lambda: rs.GivenSection(**GIVEN | {"GJ": "1"}), 'GJ must be a number in N m2, not "1"'),
    (lambda: rs.GivenSection(**GIVEN, mass=-1.0), "mass must be 0 or more, not -1.0 kg/m"),
    (lambda: rs.GivenSection(**GIVEN, fibre_distances=0.1), "fibre_distances must be two lengths .*, not 0.1"),
    (
        lambda: rs.GivenSection(**GIVEN, fibre_distances=(0.1, "x")),
        "fibre_distances must be two lengths .*, not",
    ),
    (lambda: rs.Material("stiff", 1e3), 'Young\'s modulus must be a number in Pa, not "stiff"'),
    (lambda: rs.Material(1e6, 1e3, "0.3"), 'Poisson\'s ratio must be a number, not "0.3"'),
    (lambda: rs.Material(1e6, 1e3, name="larsh"), 'there is no material "larsh"'),
    (lambda: rs.Material.preset("larch", colour=1.0), "a preset has no colour to replace: its values are youngs_mod"),
    (lambda: rs.Rod(RUBBER, CIRCLE), "section must be a circle, .*, not a Material"),
    (lambda: rs.Rod(rs.Circle), "section must be a circle, .*, not the class Circle itself"),
    (lambda: rs.Rod(CIRCLE, "larch"), 'material must be a rodshell Material, not "larch"'),
    (lambda: rs.Ball("1 kg"), 'the joint\'s mass must be a number in kg, not "1 kg"'),
    (lambda: rs.Pin(eccentricity="20 mm"), 'the joint\'s eccentricity must be a number in m, not "20 mm"'),
    (lambda: rs.Rigid(rest_angle="90 deg"), 'rest angle must be a number in rad, not "90 deg"'),
    (lambda: rs.Spring("stiff"), 'shear stiffness must be a number in N m/rad, not "stiff"'),
    (lambda: rs.Linker(rod=CIRCLE), "the rod of a linker must be a rodshell Rod, not a Circle"),
    (lambda: rs.Linker(corners="2"), '2 or 4 of its corners, not in "2"'),
    (lambda: rs.ImplicitPenalty("1e6"), 'the penalty stiffness C1 must be a number in N/m, not "1e6"'),
    (lambda: rs.Shell.of(ROD, MESH), "mesh must be a rodshell GridMesh, not a Rod"),
    (lambda: rs.Shell.of(MESH, CIRCLE), "rod must be a rodshell Rod, not a Circle"),
    (lambda: rs.Shell.of(MESH, [ROD, "x"]), 'rod must be a rodshell Rod, not "x"'),
    (lambda: rs.Shell.of(MESH, [ROD]), "the grid has 2 rods: give one value for all, or one for each, not 1"),
    (lambda: rs.Shell.of(MESH, ROD, joint="pin"), r'joint must be .* such as rodshell.Pin\(\), not "pin"'),
    (lambda: rs.Shell.of(MESH, ROD, joint=[rs.Pin]), "not the class Pin itself"),
    (lambda: rs.Shell.of(MESH, ROD, coupling="shared"), r'coupling such as rodshell.SharedDofs\(\), not "shared"'),
    (lambda: rs.Shell.of(MESH, ROD, joint=rs.Pin(), twist=False), "need twist angles: leave out twist=False"),
    (lambda: rs.ElasticRod.of(ROD, LINE), "needs 3 nodes or more, .*, not a Rod"),
    (lambda: rs.ElasticRod.of([[0, 0, 0], [1, 0]], ROD), "needs 3 nodes or more, .*, not a list"),
    (lambda: rs.ElasticRod.of(LINE[:2], ROD), r"needs 3 nodes or more, .*, not an array \(2, 3\)"),
    (lambda: rs.ElasticRod.of(LINE, CIRCLE), "rod must be a rodshell Rod, not a Circle"),
    (lambda: rs.ElasticRod.of(LINE, "larch"), 'rod must be a rodshell Rod, not "larch"'),
    (lambda: rs.ElasticRod.of(LINE, ROD, clamped=5), "clamped must be a sequence of ends, .*, not 5"),
    (lambda: rs.ElasticRod.of(LINE, ROD, clamped="start"), 'clamped must be a sequence of ends, .*, not "start"'),
    (lambda: rs.ElasticRod.of(LINE, ROD, director="z"), r"director must be three numbers \(x, y, z\)"),
    (lambda: ALONE.state(3.0), r"positions of this rod's nodes must be \(n, 3\) in m, not 3.0"),
    (lambda: ALONE.state(tangents={"end": (1, 0, 0)}), 'not clamped at its "end", where a tangent is given'),
    (lambda: ALONE.weight(9.81), r"gravity must be three numbers \(x, y, z\), not 9.81"),
    (lambda: ModifiedMass(3, np.arange(2)), "target must be a rodshell Target, not 3"),
    (lambda: ModifiedMass(rs.Hemisphere(0.2), np.arange(2), stopped="most"), '"all" or "normal", not "most"'),
]


@pytest.mark.parametrize(("call", "sentence"), WRONG)
def test_a_wrong_argument_is_refused_in_one_sentence(call, sentence):  # type: ignore[no-untyped-def]
    with pytest.raises(rs.InputError, match=sentence) as refused:
        call()
    assert "\n" not in str(refused.value)
