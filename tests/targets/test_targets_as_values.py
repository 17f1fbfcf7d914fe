"""Targets, layouts and grids as Python values: wrong arguments, repr, equality and hashing."""

import re
from dataclasses import replace

import numpy as np
import pytest

import rodshell as rs
from rodshell.geometry.curves import closed_loops
from rodshell.layout import Crossings
from rodshell.targets.heightfield import Formula, parse_formula
from rodshell.targets.patch import Patch, Seam
from rodshell.targets.rim import EllipseDomain
from tests.nets.sphere_net import sphere_net_end, sphere_net_rod
from tests.nets.whole_march import march
from tests.targets.meshes import sheet

VERTICES, FACES = sheet(lambda x, y: 0.1 - x**2 - y**2, 0.2, 12)
DISC = rs.Disc(0.2)
SEAM = [(-0.3, 0.0), (0.3, 0.0)]
LAYOUT = rs.GridLayout.orthogonal(rods=(5, 7), spacing=0.06, length=1.0)

# every length that a constructor takes, with what else it needs
LENGTHS = {
    "target radius": lambda x: rs.Hemisphere(radius=x),
    "target radius of a cap": lambda x: rs.Cap(radius=x, base=0.0),
    "target radius of a paraboloid": lambda x: rs.Paraboloid(radius=x, height=0.1),
    "target height": lambda x: rs.Paraboloid(radius=0.2, height=x),
    "target a": lambda x: rs.Ellipsoid(a=x, b=0.2, c=0.1),
    "target b": lambda x: rs.Ellipsoid(a=0.2, b=x, c=0.1),
    "target c": lambda x: rs.Ellipsoid(a=0.2, b=0.2, c=x),
    "domain radius": lambda x: rs.Disc(radius=x),
    "domain size": lambda x: rs.Rectangle(size=(x, 0.3)),
    "domain a": lambda x: EllipseDomain(a=x, b=0.2),
    "domain b": lambda x: EllipseDomain(a=0.2, b=x),
    "target scale": lambda x: rs.Placement(scale=x),
    "layout spacing": lambda x: rs.GridLayout.orthogonal(spacing=x),
    "layout spacing of one family": lambda x: rs.GridLayout.orthogonal(spacing=(0.05, x)),
    "layout length": lambda x: rs.GridLayout.orthogonal(spacing=0.05, length=x),
    "layout edge": lambda x: rs.GridLayout.orthogonal(spacing=0.05, edge=x),
    "unit": lambda x: rs.surface_from("dome.obj", unit=0.0 if x is None else x),
    "size": lambda x: rs.heights_from("dome.csv", size=(x, 1.0)),
    "height": lambda x: rs.heights_from("dome.csv", size=(1.0, 1.0), height=0.0 if x is None else x),
    "radius": lambda x: sphere_net_end(x, 0.1),
}
NO_LENGTH = ["20", None, True, float("nan"), float("inf"), -1.0, 0, [1.0], np.ones(3), 10**400]


def refusal(call) -> str:
    with pytest.raises(rs.InputError) as caught:
        call()
    return str(caught.value)


@pytest.mark.parametrize("wrong", NO_LENGTH, ids=repr)
@pytest.mark.parametrize("name", LENGTHS)
def test_what_is_no_length_is_refused_in_one_sentence(name, wrong):
    words = refusal(lambda: LENGTHS[name](wrong))
    assert name.split(" of ")[0] in words
    assert "\n" not in words
    assert len(words) < 200


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: rs.Cap(radius=0.2, base="0.1"), 'target base must be a number in m, not "0.1"'),
        (lambda: rs.Cap(radius=0.2, base=np.nan), "target base must be finite, not nan m"),
        (lambda: rs.Cap(radius=0.2, base=0.3), "give a base between -0.2 and 0.2 m"),
        (lambda: rs.Rectangle(size=0.3), "domain size must be two lengths in m: width along x, depth along y, not 0.3"),
        (lambda: rs.Rectangle(size=(0.3,)), "domain size must be two lengths"),
        (lambda: rs.HeightField(formula="x", domain=0.2), r"domain = 0.2: use Disc\(radius\) or"),
        (lambda: rs.HeightField(formula=3, domain=DISC), "a formula must be text"),
        (lambda: rs.HeightField(function=3, domain=DISC), "function must be a function z.* not 3"),
        (lambda: rs.HeightField(formula="x", domain=DISC, name=3), "name must be text, not 3"),
        (lambda: rs.Freeform.of("dome.obj", FACES), r"vertices must be numbers of the shape \(n, 3\), not 'dome.obj'"),
        (lambda: rs.Freeform.of(VERTICES[:, :2], FACES), r"vertices must have the shape \(n, 3\), not \("),
        (lambda: rs.Freeform.of(VERTICES, VERTICES), r"faces must be integers of the shape \(n, 3\)"),
        (lambda: rs.Freeform.of(VERTICES, -FACES), "a face refers to vertex -"),
        (lambda: rs.Freeform.of(VERTICES, FACES, base="0"), 'target base must be a number in m, not "0"'),
        (lambda: rs.Freeform.of(VERTICES, FACES, curves=((0, 1),)), "a boundary curve must have the shape"),
        (lambda: rs.Placement(up="x"), 'target up must be "z" or "y", not "x"'),
        (lambda: rs.Placement(turn=(0.1, 0.2)), "target turn must be three finite angles"),
        (lambda: rs.Placement(turn="90 deg"), "target turn must be three finite angles .* not '90 deg'"),
        (lambda: rs.Placement(move=(0, 0, np.nan)), "target move must be three finite lengths"),
        (lambda: rs.surface_from(3), "file must be the path of a file, not 3"),
        (lambda: rs.surface_from("dome.obj", name=3), "name must be text, the name of an object, not 3"),
        (lambda: rs.surface_from("dome.obj", base="0"), 'target base must be a number in m, not "0"'),
        (lambda: rs.surface_from("dome.obj", placement=2.0), "placement must be a rodshell Placement, not 2.0"),
        (lambda: rs.surface_from("dome.xyz"), "dome.xyz is not a surface file: use one of .obj"),
        (lambda: rs.heights_from("dome.csv", size=3.0), "size must be two lengths in m"),
        (lambda: rs.heights_from("dome.obj", size=(1, 1)), "dome.obj is not a file of heights: use one of .csv"),
        (lambda: Seam.of("a line"), r"a seam must be a list of points \(x, y\) in m, not 'a line'"),
        (lambda: Seam.of([(0, 0), (0, np.nan)]), "a seam must be a list of finite points"),
        (
            lambda: rs.GridLayout.orthogonal(spacing=0.05, rotate="45 deg"),
            'layout rotate must be a number in rad, not "',
        ),
        (lambda: rs.GridLayout.orthogonal(spacing=0.05, offset=0.1), "layout offset must be two lengths in m, not 0.1"),
        (
            lambda: rs.GridLayout.orthogonal(spacing=0.05, rods="all"),
            'layout rods must be two counts .* "auto", not .all',
        ),
        (lambda: replace(LAYOUT, lines=(1, 2)), "layout lines must be two lists of finite offsets in m, not"),
        (lambda: replace(LAYOUT, left_out="U01"), 'layout left_out must be names of rods, not "U01"'),
        (lambda: rs.straight_rods("rods.csv"), r"rod ends must be numbers of the shape \(rods, 2, 2\), not 'rods.csv'"),
        (lambda: rs.chebyshev_net(rs.Hemisphere(0.2), LAYOUT, anchor="0,0"), "anchor must be two finite numbers"),
        (lambda: rs.chebyshev_net(rs.Hemisphere(0.2), LAYOUT, eccentricity="1"), "eccentricity must be a number in m"),
        (lambda: sphere_net_rod(0.2, "0.1", 0.3), 'offset must be a number in m, not "0.1"'),
    ],
)
def test_a_wrong_argument_is_refused_in_one_sentence(call, sentence):
    words = refusal(call)
    assert re.search(sentence, words), words
    assert "\n" not in words


def values() -> dict[str, object]:
    """Made anew each time."""
    freeform = rs.Freeform.of(VERTICES, FACES)
    grid = rs.straight_rods([[(0, -1), (0, 1)], [(-1, 0), (1, 0)]])
    net = rs.chebyshev_net(rs.Hemisphere(0.2), LAYOUT)
    return {
        "Hemisphere(radius=0.2)": rs.Hemisphere(np.float64(0.2)),
        "Cap(radius=0.2, base=0.1)": rs.Cap(0.2, 0.1),
        "Paraboloid(radius=0.2, height=0.1)": rs.Paraboloid(0.2, 0.1),
        "Ellipsoid(a=0.2, b=0.3, c=1.0)": rs.Ellipsoid(0.2, 0.3, 1),
        "Disc(radius=0.2)": rs.Disc(0.2),
        "Rectangle(size=(0.2, 0.3))": rs.Rectangle([0.2, 0.3]),
        "EllipseDomain(a=0.2, b=0.3)": EllipseDomain(0.2, 0.3),
        "HeightField(formula='0.1 - x^2', domain=Disc(radius=0.2))": rs.HeightField(formula="0.1 - x^2", domain=DISC),
        "Formula(text='x')": parse_formula("x"),
        "Placement(scale=2.0, move=(1.0, 0.0, 0.0))": rs.Placement(scale=2.0, move=[1, 0, 0]),
        "Freeform(mesh: 242 triangles, 0.4 x 0.4 x 0.0793 m)": freeform,
        "TriangleMesh(144 vertices, 242 faces)": freeform.surface,
        "Seam(2 points, (-0.3, 0) to (0.3, 0) m)": Seam.of(SEAM),
        "Patch(around (0, 0.1) m, 1 seam, Hemisphere(radius=0.2))": Patch(
            whole=rs.Hemisphere(0.2), surface=rs.Hemisphere(0.2), seams=(Seam.of(SEAM),), sides=(1,), middle=(0.0, 0.1)
        ),
        "GridLayout(rods=(5, 7), spacing=(0.06, 0.06), length=1.0, edge='auto')": rs.GridLayout.orthogonal(
            rods=[5, 7], spacing=0.06, length=1
        ),
        "FlatGrid(2 rods, 1 crossings)": grid,
        "Crossings(1)": grid.crossings,
        "GridMesh(2 rods, 9 nodes, 1 joints)": rs.mesh_grid(grid, 0.5),
        "ChebyshevNet(12 rods on Hemisphere(radius=0.2), smallest angle": net,
        "Covering(": net.net,
        "Net(3 x 3 nodes, 9 known)": march(
            rs.Hemisphere(1.0), *2 * [np.linspace(-0.1, 0.1, 3)], np.array([0.0, 0, 1]), np.array([1.0, 0, 0])
        ),
    }


def test_a_repr_is_one_line_that_says_what_it_is():
    for words, value in values().items():
        assert repr(value).startswith(words), repr(value)
        assert "\n" not in repr(value)
        assert len(repr(value)) < 120
        assert "array(" not in repr(value)


def test_values_compare_and_hash_without_an_error():
    """Those that are made of numbers and text by content, so that they are found again in a dict; those that hold a
    mesh or a net only as the same object."""
    by_identity = ("Freeform", "TriangleMesh", "GridMesh", "ChebyshevNet", "Covering", "Net")
    for (words, first), second in zip(values().items(), values().values(), strict=True):
        assert first == first
        assert first != "something else"
        if words.startswith(by_identity):
            assert first != second
            assert {first: 1}.get(second) is None
        else:
            assert first == second
            assert hash(first) == hash(second)
    assert Seam.of(SEAM) != Seam.of(SEAM[::-1])
    grid, other = (rs.straight_rods([[(0, -1), (0, 1)], [(-1, y), (1, y)]]) for y in (0.0, 0.5))
    assert grid != other
    assert grid.crossings != Crossings(grid.crossings.rods, grid.crossings.at + 1e-3)
    assert isinstance(parse_formula("x"), Formula)


def test_a_changed_target_is_checked_again():
    assert replace(rs.Cap(0.2, 0.1), base=0.0) == rs.Cap(0.2, 0.0)
    assert replace(rs.Paraboloid(0.2, 0.1), height=0.3).height == 0.3
    with pytest.raises(rs.InputError, match="must cut the sphere"):
        replace(rs.Cap(0.2, 0.1), radius=0.05)


def test_open_strokes_make_no_loop():
    assert closed_loops([np.array([[0.0, 0, 0], [1, 0, 0]])]) == []
