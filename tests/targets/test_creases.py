"""Creases of meshes: seams near them are moved onto them, and each piece between them is a smooth surface."""

import re

import numpy as np
import pytest
from numpy.typing import NDArray

import rodshell as rs
from rodshell.targets.creased import Creased, cut_at
from rodshell.targets.freeform import Freeform
from rodshell.targets.patch import Seam
from rodshell.targets.polygons import Polygons
from tests.targets.meshes import CREASED, Mesh, bend, creased, creased_quads, sheet, strewn

Floats = NDArray[np.float64]

TURN = np.linspace(0, 2 * np.pi, 25)
CIRCLE = np.column_stack([np.cos(TURN), np.sin(TURN)])
CIRCLE[-1] = CIRCLE[0]
SEAMS: dict[str, list[list[tuple[float, float]]]] = {  # a few centimetres off the creases
    "ridge": [[(0.1, -6.0), (-0.2, 6.0)]],
    "groin": [[(-5.1, -5.0), (4.9, 5.0)], [(-5.0, 5.1), (5.0, -5.1)]],
    "valley": [[(float(bend(np.array(y))) + 0.1, y) for y in (-6.0, -4.0, -2.0, 0.0, 2.0, 4.0, 6.0)]],
    "ring": [(2.6 * CIRCLE).tolist()],
}
every = pytest.mark.parametrize("name", CREASED)


def cut(mesh: Mesh, lines: list[list[tuple[float, float]]]) -> Creased:
    target = cut_at(Freeform.of(*mesh), [Seam.of(line) for line in lines])
    assert isinstance(target, Creased)
    return target


def off_crease(name: str, x: Floats) -> Floats:
    """(n,) distances in plan from the crease."""
    return np.abs({
        "ridge": lambda: x[:, 0], "groin": lambda: (np.abs(x[:, 0]) - np.abs(x[:, 1])) / np.sqrt(2),
        "valley": lambda: x[:, 0] - bend(x[:, 1]), "ring": lambda: np.hypot(x[:, 0], x[:, 1]) - 2.5,
    }[name]())  # fmt: skip


@every
def test_seams_are_moved_onto_the_creases_near_them(name: str) -> None:
    """To the cubics between the vertices of a curved crease, and 1e-5 by which points are left out."""
    target = cut(creased(name), SEAMS[name])
    for seam in target.seams:
        along = np.vstack(
            [a + np.linspace(0, 1, 20)[:, None] * (b - a) for a, b in zip(seam.points, seam.points[1:], strict=False)]
        )
        inside = along[np.abs(along).max(axis=1) < 5]
        assert len(inside) > 10
        assert off_crease(name, inside).max() < 2e-5 * target.size
        top = seam.height(inside)
        known = np.isfinite(top)
        assert known.mean() > 0.6  # not at the crown of the groin
        assert np.abs(top - CREASED[name](*inside.T))[known].max() < 5e-5 * target.size


@every
def test_each_piece_is_the_surface_on_its_side_up_to_the_crease(name: str) -> None:
    """Not rounded off, as one field for both sides is by 0.02 of the size."""
    target = cut(creased(name), SEAMS[name])
    random = np.random.default_rng(1)
    x = random.uniform(-4.9, 4.9, (4000, 2))
    x = x[np.hypot(*x.T) < 4.9] if name == "ring" else x
    x = x[off_crease(name, x) > 1e-3]
    np.testing.assert_allclose(target.height_at(x), CREASED[name](*x.T), rtol=0, atol=2e-4 * target.size)
    assert target.deviation.max < 2e-4 * target.size
    points, areas = target.survey()
    assert len(target.pieces) == {"groin": 4}.get(name, 2)
    assert areas.sum() == pytest.approx(target.surface.areas.sum(), rel=1e-3)
    assert off_crease(name, points).min() >= 0


BRIDGED = {  # farthest that the seam is from the crease, of the size
    "ridge, no vertex on it": ("ridge", creased("ridge", 61), 1e-5),
    "ridge, vertices at random": ("ridge", strewn(CREASED["ridge"], 5.0, 1600), 1e-4),
    "groin, vertices at random": ("groin", strewn(CREASED["groin"], 5.0, 1600), 1e-3),
}


@pytest.mark.parametrize("case", BRIDGED)
def test_where_faces_bridge_a_crease_it_is_where_the_continued_pieces_meet(case: str) -> None:
    """No edge follows the crease, and the seam is drawn 0.02 of the size off."""
    name, mesh, allowed = BRIDGED[case]
    target = cut(mesh, SEAMS[name])
    for seam in target.seams:
        inside = seam.points[np.abs(seam.points).max(axis=1) < 4.9]
        assert len(inside) > 20
        assert off_crease(name, inside).max() < allowed * target.size
    x = np.random.default_rng(2).uniform(-4.8, 4.8, (3000, 2))
    x = x[off_crease(name, x) > 0.02]
    np.testing.assert_allclose(target.height_at(x), CREASED[name](*x.T), rtol=0, atol=2e-3 * target.size)
    assert target.deviation.max < 5e-4 * target.size


def test_of_a_row_of_faces_that_bridges_a_crease_the_middle_is_named() -> None:
    said = Freeform.of(*creased("ridge", 61)).along_creases
    assert re.search(r'--seams\.lines "0,-?5; 0,-?5"$', said)


def test_what_is_said_of_a_crease_can_be_typed() -> None:
    for name in ("ridge", "groin", "valley"):
        said = Freeform.of(*creased(name)).along_creases
        lines = [
            [tuple(map(float, point.split(","))) for point in line.split(";")]
            for line in said.split('--seams.lines "')[1].rstrip('"').split("|")
        ]
        assert len(lines) == len(SEAMS[name])
        target = cut(creased(name), lines)
        assert all(off_crease(name, seam.points).max() < 1e-4 for seam in target.seams)


def test_a_crease_without_a_seam_is_refused_with_the_line_to_type() -> None:
    with pytest.raises(rs.InputError, match=r'creased near .* where there is no seam.* --seams\.lines "0,-5; 0,5"'):
        cut(creased("ridge"), [[(1.0, -6.0), (1.0, 6.0)]])
    with pytest.raises(rs.InputError, match=r"creased near .* where there is no seam"):  # along one of two
        cut(creased("groin"), [[(-5.0, -5.0), (5.0, 5.0)]])


@pytest.mark.parametrize(
    "mesh",
    [
        sheet(lambda x, y: 3 - 0.05 * x**2 - 0.08 * y**2, 5.0, 14),
        strewn(lambda x, y: 2 + np.cos(x / 2) * np.cos(y / 3), 5.0, 400),
    ],
)
def test_a_smooth_mesh_is_not_cut_however_coarse(mesh: Mesh) -> None:
    target = Freeform.of(*mesh)
    assert cut_at(target, [Seam.of([(0, -6), (0, 6)])]) is target


def test_a_target_is_cut_anew_at_other_seams_and_whole_again_without() -> None:
    target = Freeform.of(*creased("ridge"))
    first = cut_at(target, [Seam.of([(0, -6), (0, 6)])])
    assert cut_at(first, [Seam.of([(0, -6), (0, 6)])]) is first
    second = cut_at(first, [Seam.of([(0, -6), (0, 6)]), Seam.of([(-6, 1), (6, 1)])])
    assert isinstance(second, Creased)
    assert len(second.pieces) == 4
    assert cut_at(second, ()) is target


@pytest.mark.parametrize("shape", ["sheet", "strewn"])
def test_normals_at_the_rim_are_as_good_as_within(shape: str) -> None:
    """Of a paraboloid; without the correction they are off by half a turn from row to row, 0.02 rad."""
    make = {
        "sheet": lambda: sheet(lambda x, y: 3 - 0.05 * (x**2 + y**2), 5.0, 21),
        "strewn": lambda: strewn(lambda x, y: 3 - 0.05 * (x**2 + y**2), 5.0, 400),
    }
    surface = Freeform.of(*make[shape]()).surface
    true = np.column_stack([0.1 * surface.vertices[:, :2], np.ones(len(surface.vertices))])
    true /= np.linalg.norm(true, axis=1)[:, None]
    off = np.linalg.norm(surface.normals - true, axis=1)
    rim = np.abs(surface.vertices[:, :2]).max(axis=1) > 5 - 1e-9
    assert np.sqrt(np.mean(off[rim] ** 2)) < {"sheet": 3e-3, "strewn": 8e-3}[shape]


def test_a_groin_of_quads_is_creased_where_that_of_triangles_is() -> None:
    x, quads = creased_quads("groin")
    faces = Polygons(x, quads.ravel(), np.full(len(quads), 4)).triangles("it")
    found, known = cut((x, faces), SEAMS["groin"]), cut(creased("groin"), SEAMS["groin"])
    for seam, other in zip(found.seams, known.seams, strict=True):
        inside = seam.points[np.abs(seam.points).max(axis=1) < 5]
        assert np.abs(other.distance(inside)).max() < 2e-5 * known.size
    assert len(found.pieces) == len(known.pieces) == 4
    assert found.deviation.max < 5e-4 * found.size  # at the crown faces cross the faded crease
