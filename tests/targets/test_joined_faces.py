"""Faces of polysurfaces, joined to one surface, against the surface as a single face or as a formula."""

import numpy as np
import pytest

import rodshell as rs
from rodshell.targets.creased import Creased, cut_at
from rodshell.targets.freeform import Freeform
from rodshell.targets.joined_faces import joined
from rodshell.targets.nurbs import Nurbs
from rodshell.targets.patch import Seam

R = 5.0
BEZIER = {degree: np.repeat([0.0, 1.0], degree + 1) for degree in (1, 2, 3)}


def arc(first: float, last: float, shift: float = 1.0) -> np.ndarray:
    """Controls (3, 3) x, z and weight of a circle of radius R; `shift` changes its parameter only."""
    half = 0.5 * (last - first)
    angle, weight = np.array([first, first + half, last]), np.array([1.0, np.cos(half) * shift, shift**2])
    r = R / np.array([1.0, np.cos(half), 1.0])
    return np.column_stack([weight * r * np.sin(angle), weight * r * np.cos(angle), weight])


def barrel(angles: tuple[float, float], y: tuple[float, float], shift: float = 1.0, mirror: bool = False) -> Nurbs:
    x, z, w = arc(*angles, shift).T
    controls = np.stack([np.column_stack([x, at * w, z, w]) for at in y], axis=1)
    return Nurbs((2, 1), (BEZIER[2], BEZIER[1]), controls[::-1] if mirror else controls)


def cap(k: int, of: int = 4) -> Nurbs:
    """A part of a sphere from its pole to 50 degrees."""
    half = np.pi / of
    r, z, w = arc(0.0, np.radians(50)).T
    turn, weight = 2 * half * (k + np.array([0.0, 0.5, 1.0])), np.array([1.0, np.cos(half), 1.0])
    wide = np.array([1.0, 1 / np.cos(half), 1.0]) * weight
    x, y = r[:, None] * wide * np.cos(turn), r[:, None] * wide * np.sin(turn)
    return Nurbs((2, 2), (BEZIER[2],) * 2, np.stack([x, y, z[:, None] * weight, w[:, None] * weight], axis=2))


LOFT = np.array([2.6, 3.4, 3.9, 4.1, 4.3, 4.0, 3.1])  # heights; the fourth is in line with its neighbours


def loft(rows: slice, knots: np.ndarray) -> Nurbs:
    x, y = np.meshgrid(np.linspace(-4.0, 4.0, 7)[rows], np.linspace(-3.0, 3.0, 3), indexing="ij")
    z = LOFT[rows, None] + np.array([-0.4, 0.5, -0.2])
    return Nurbs((3, 2), (knots, BEZIER[2]), np.stack([x, y, z, np.ones_like(x)], axis=2))


ROUND = np.radians(48)
FACES: dict[str, tuple[list[Nurbs], list[Nurbs]]] = {
    "a barrel, cut at its ridge": (
        [barrel((-ROUND, 0.0), (-4.0, 4.0)), barrel((0.0, ROUND), (4.0, -4.0))],
        [barrel((-ROUND, ROUND), (-4.0, 4.0))],
    ),
    "a barrel, cut across, with other parameters": (
        [barrel((-ROUND, ROUND), (-4.0, 0.5)), barrel((-ROUND, ROUND), (0.5, 4.0), 1.8, mirror=True)],
        [barrel((-ROUND, ROUND), (-4.0, 4.0))],
    ),
    "a cap in four faces": ([cap(k) for k in range(4)], [cap(k, 3) for k in range(3)]),
    "a loft of two faces": (
        [loft(slice(0, 4), BEZIER[3]), loft(slice(3, 7), BEZIER[3])],
        [loft(slice(0, 7), np.repeat([0.0, 1.0, 2.0], [4, 3, 4]))],
    ),
}


def target(faces: list[Nurbs]) -> Freeform:
    return Freeform.of(*(joined(faces, "it")[:2] if len(faces) > 1 else faces[0].triangles()))


@pytest.mark.parametrize("name", FACES)
def test_faces_that_meet_smoothly_are_the_surface_as_a_whole(name: str) -> None:
    """Within three times the distances from their points that both fits tell."""
    faces, single = FACES[name]
    found, whole = target(faces), target(single)
    assert joined(faces, "it")[2] < np.radians(0.5)  # where faces meet at other angles than right ones
    assert len(found.surface.loops) == 1
    assert found.surface.doubled[:, 2].sum() == pytest.approx(whole.surface.doubled[:, 2].sum(), rel=1e-3)
    x, y = 3.6 * np.random.default_rng(2).uniform(-1, 1, (2, 2000))
    plan = np.column_stack([x, 0.8 * y])
    plan = plan[whole.margin(np.column_stack([plan, whole.height_at(plan)])) > 0.01]
    assert len(plan) > 1500
    off = np.abs(found.height_at(plan) - whole.height_at(plan)).max()
    assert off < 3 * (found.deviation.max + whole.deviation.max)
    assert off < 2e-4 * whole.size
    points = np.column_stack([plan, whole.height_at(plan)])
    assert np.abs(found.margin(points) - whole.margin(points)).max() < 1e-3 * whole.size


def test_faces_that_meet_at_an_angle_are_patches_of_a_seam_along_it() -> None:
    faces = [moved(barrel((side * 0.9, side * 0.4), (-4.0, 4.0)), -side * R * np.sin(0.4)) for side in (-1, 1)]
    assert joined(faces, "it")[2] == pytest.approx(0.8, abs=1e-3)
    found = target(faces)
    assert "the surface has creases" in found.creased
    cut = cut_at(found, [Seam.of([(0.1, -5.0), (-0.1, 5.0)])])
    assert isinstance(cut, Creased)
    assert len(cut.pieces) == 2
    x, y = np.random.default_rng(4).uniform(-1, 1, (2, 500)) * [[2.0], [3.5]]
    known = np.sqrt(R**2 - (np.abs(x) + R * np.sin(0.4)) ** 2)
    assert np.abs(cut.height_at(np.column_stack([x, y])) - known).max() < 2e-4 * cut.size


def moved(face: Nurbs, by: float) -> Nurbs:
    """Along x."""
    return Nurbs(face.degrees, face.knots, face.controls + by * face.controls[..., 3:] * [1, 0, 0, 0])


def test_a_face_that_shares_a_part_of_an_edge_is_named() -> None:
    faces = [barrel((-ROUND, 0.0), (-4.0, 4.0)), barrel((0.0, ROUND), (-4.0, 0.0)), barrel((0.0, ROUND), (0.0, 4.0))]
    with pytest.raises(rs.InputError, match="face 1 of 3 shares a part of an edge: split its neighbour there"):
        joined(faces, "it")


def test_faces_of_a_brep_are_joined(tmp_path) -> None:
    """A ball of six faces, which are 1.2e-4 of its radius off it themselves, above a plane."""
    rhino3dm = pytest.importorskip("rhino3dm")
    model, ball = rhino3dm.File3dm(), rhino3dm.Sphere(rhino3dm.Point3d(0, 0, 0), R)
    model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Meters
    model.Objects.AddBrep(rhino3dm.Brep.CreateQuadSphere(ball))
    model.Write(str(tmp_path / "ball.3dm"), 7)
    found = rs.surface_from(tmp_path / "ball.3dm", base=1.0)
    x, y = 3.0 * np.random.default_rng(3).uniform(-1, 1, (2, 1000))
    known = np.sqrt(R**2 - x**2 - y**2)
    off = np.abs(found.height_at(np.column_stack([x, y])) - known) * known / R  # along the normal
    own = np.abs(np.linalg.norm(found.surface.vertices, axis=1) - R).max()
    assert off.max() < own + 3 * found.deviation.max < 3e-4 * R
    assert not any("reversed" in warning for warning in found.warnings)


def test_a_polysurface_of_trimmed_faces_says_what_to_do(tmp_path) -> None:
    rhino3dm = pytest.importorskip("rhino3dm")
    model = rhino3dm.File3dm()
    cylinder = rhino3dm.Cylinder(rhino3dm.Circle(2.0), 3.0)
    model.Objects.AddBrep(rhino3dm.Brep.CreateFromCylinder(cylinder, True, True))
    model.Write(str(tmp_path / "drum.3dm"), 7)
    with pytest.raises(rs.InputError, match=r"has 3 faces.* only untrimmed ones: merge them, or export a mesh"):
        rs.surface_from(tmp_path / "drum.3dm", unit=1.0)


def test_an_angle_at_which_faces_of_a_brep_meet_is_named(tmp_path) -> None:
    """Two faces of a roof, 20 degrees steep."""
    rhino3dm = pytest.importorskip("rhino3dm")
    model, mesh = rhino3dm.File3dm(), rhino3dm.Mesh()
    for x, y in ((-4, 0), (0, 0), (4, 0), (-4, 6), (0, 6), (4, 6)):
        mesh.Vertices.Add(x, y, 3 - abs(x) * np.tan(np.radians(20)))
    mesh.Faces.AddFace(0, 1, 4, 3)
    mesh.Faces.AddFace(1, 2, 5, 4)
    brep = rhino3dm.Brep.CreateFromMesh(mesh, True)
    assert len(brep.Faces) == 2
    model.Objects.AddBrep(brep)
    model.Write(str(tmp_path / "roof.3dm"), 7)
    found = rs.surface_from(tmp_path / "roof.3dm", unit=1.0)
    assert "faces of roof.3dm meet at angles of up to 40 degrees: a seam along such an edge keeps" in found.warnings[0]
