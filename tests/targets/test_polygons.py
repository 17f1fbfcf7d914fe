"""Faces of any number of corners: split well, whatever their shape, and the same from every format."""

import struct

import numpy as np
import pytest

import rodshell as rs
from rodshell.targets.mesh_files import read_mesh
from rodshell.targets.polygons import Polygons
from rodshell.targets.trianglemesh import sound_mesh
from tests.acceptance.targets_broken import WRITERS, dome
from tests.targets.meshes import creased_quads

Face = list[list[float]]


def split(face: Face) -> np.ndarray:
    """Corners (t, 3, 3) of the triangles of one face."""
    x = np.array(face, dtype=float)
    return x[Polygons(x, np.arange(len(x)), np.array([len(x)])).triangles("it")]


def areas(corners: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Signed, seen against `up`."""
    a, b, c = corners.transpose(1, 0, 2)
    return 0.5 * np.cross(b - a, c - a) @ up


def smallest_angle(corners: np.ndarray) -> float:
    along = np.roll(corners, -1, axis=1) - corners
    along /= np.linalg.norm(along, axis=2)[..., None]
    return float(np.degrees(np.arccos(np.clip(-np.sum(along * np.roll(along, 1, axis=1), axis=2), -1, 1)).min()))


def star(points: int) -> Face:
    angle, radius = np.pi * np.arange(2 * points) / points, np.tile([1.0, 0.4], points)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle]).tolist()


FACES: dict[str, tuple[Face, float]] = {  # with its area
    "an arrow, of which one diagonal lies outside": ([[0, 0, 0], [2, 1, 0], [0, 2, 0], [0.5, 1, 0]], 1.5),
    "an L": ([[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0]], 3.0),
    "a comb": ([[0, 0, 0], [5, 0, 0], [5, 3, 0], [4, 3, 0], [4, 1, 0], [3, 1, 0], [3, 3, 0], [2, 3, 0], [2, 1, 0],
                [1, 1, 0], [1, 3, 0], [0, 3, 0]], 11.0),
    "a star": (star(30), 60 * 0.5 * 0.4 * np.sin(np.pi / 30)),
    "corners along its sides": ([[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [2, 2, 0], [1, 2, 0], [0, 2, 0]], 4.0),
}  # fmt: skip


@pytest.mark.parametrize("turn", range(3))
@pytest.mark.parametrize("name", FACES)
def test_triangles_cover_a_face_once_whatever_its_shape_and_first_corner(name: str, turn: int) -> None:
    face, area = FACES[name]
    tilted = np.roll(np.array(face, dtype=float), turn, axis=0) @ np.array([[0.6, 0.0, 0.8], [0, 1, 0], [-0.8, 0, 0.6]])
    found = areas(split(tilted.tolist()), np.array([-0.8, 0.0, 0.6]))
    assert len(found) == len(face) - 2
    assert (found > 1e-4).all()
    assert found.sum() == pytest.approx(area)


@pytest.mark.parametrize(
    ("face", "least"),
    [
        ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0], [0, 1, 0]], 44.9),  # two squares; a fan has 0
        ([[0, 0, 0], [3, 0.3, 0], [3.4, 1, 0], [0.4, 0.7, 0]], 9.0),  # its other diagonal leaves 4
        ([[0, 0, 0], [1, 0, 0.1], [1, 1, 0], [1, 2, 0.1], [0, 2, 0], [0, 1, 0.1]], 40.0),  # not flat
    ],
)
def test_of_all_diagonals_those_are_taken_that_leave_no_slivers(face: Face, least: float) -> None:
    for turn in range(len(face)):
        assert smallest_angle(split(face[turn:] + face[:turn])) > least


def groin(count: int, edit: str) -> tuple[np.ndarray, list[list[int]]]:
    """The groin of two barrels over a lattice, with its faces changed in one way."""
    x, quads = creased_quads("groin", count)
    faces = [list(map(int, face)) for face in quads]
    if edit == "turned":
        faces = [face[k % 4 :] + face[: k % 4] for k, face in enumerate(faces)]
    if edit == "facing both sides":
        faces = [face[:: 1 - 2 * (k % 2)] for k, face in enumerate(faces)]
    if edit == "not joined":
        x, faces = x[np.concatenate(faces)], np.arange(4 * len(faces)).reshape(-1, 4).tolist()
    if edit == "joined to hexagons":  # cells (i, j) and (i, j + 1) in plan
        pairs = zip(faces[::2], faces[1::2], strict=True)
        faces = [[a[0], a[1], a[2], b[2], b[3], a[3]] for a, b in pairs]
    return x, faces


def crossed(x: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Middles (n, 3) of the edges that run from one side of a groin to another."""
    ends = x[np.vstack([triangles[:, [k, k - 2]] for k in range(3)])]
    side = np.sign(np.round(ends[..., 0] ** 2 - ends[..., 1] ** 2, 6))
    return ends[side[:, 0] * side[:, 1] < 0].mean(axis=1)


@pytest.mark.parametrize("count", [10, 20, 60])
@pytest.mark.parametrize("edit", ["", "turned", "facing both sides", "not joined", "joined to hexagons"])
def test_diagonals_run_along_a_groin_and_not_across(edit: str, count: int) -> None:
    """But near the crown, where both barrels are level and the crease fades: at most three cells from it."""
    x, faces = groin(count, edit)
    triangles = Polygons(x, np.concatenate(faces), np.array(list(map(len, faces)))).triangles("it")
    assert len(triangles) == 2 * count**2
    assert np.abs(crossed(x, triangles)[:, :2]).max(initial=0) < 3 * 10 / count
    plan = 0.5 * np.abs(np.cross(x[triangles[:, 1]] - x[triangles[:, 0]], x[triangles[:, 2]] - x[triangles[:, 0]]))
    assert plan[:, 2].sum() == pytest.approx(100.0)  # each place is covered once


def test_a_fine_mesh_of_a_smooth_surface_keeps_the_better_shaped_diagonals() -> None:
    x, faces = creased_quads("groin", 100)
    x[:, 2] = 3.2 + 0.9 * np.cos(x[:, 0] / 4.5) * np.cos(x[:, 1] / 4) + 0.15 * np.sin(x[:, 0] / 3)
    found = Polygons(x, faces.ravel(), np.full(len(faces), 4)).triangles("it")
    alone = [Polygons(x, face, np.array([4])).triangles("it") for face in faces[::97]]
    for k, triangles in zip(range(0, len(faces), 97), alone, strict=True):
        np.testing.assert_array_equal(found[2 * k : 2 * k + 2], triangles)


def test_a_face_of_too_many_corners_is_refused() -> None:
    x = np.array(star(2000))
    with pytest.raises(
        rs.InputError, match=r"faces of up to 4000 corners.* triangles or quads, or set RODSHELL_LIMITS="
    ):
        Polygons(x, np.arange(len(x)), np.array([len(x)])).triangles("it")


# Files


def mixed() -> tuple[np.ndarray, list[list[int]]]:
    """The dome with quads, of which some are joined in pairs, and triangles at its top."""
    x, _ = dome()
    faces = [[a := 24 * i + j, a + 24, 24 * i + 24 + (j + 1) % 24, 24 * i + (j + 1) % 24]
             for i in range(1, 13) for j in range(24) if i != 7]  # fmt: skip
    faces += [[j, 24 + j, 24 + (j + 1) % 24] for j in range(24)]
    for j in range(0, 24, 2):
        a, b = 24 * 7 + j, 24 * 8 + j
        last = [24 * 7 + (j + 2) % 24, 24 * 8 + (j + 2) % 24]
        faces.append([a, b, b + 1, last[1], last[0], a + 1])
    return x, faces


def as_obj(x: np.ndarray, faces: list[list[int]]) -> bytes:
    rows = ["f " + " ".join(f"{k + 1}//1" for k in face) for face in faces]
    return "\n".join([*("v {} {} {} 0.5 0.5 0.5".format(*p) for p in x.tolist()), "vn 0 0 1", *rows, ""]).encode()


def as_off(x: np.ndarray, faces: list[list[int]]) -> bytes:
    rows = [f"{len(face)} {' '.join(map(str, face))} 255 0 0" for face in faces]
    return "\n".join(["OFF", f"{len(x)} {len(faces)} 0", *("{} {} {}".format(*p) for p in x.tolist()), *rows]).encode()


def as_ply(x: np.ndarray, faces: list[list[int]], form: str) -> bytes:
    order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[form]
    head = f"ply\nformat {form} 1.0\ncomment any\nelement vertex {len(x)}\nproperty double x\nproperty uchar red\n"
    head += f"property double y\nproperty double z\nelement face {len(faces)}\nproperty float quality\n"
    head += "property list uchar int vertex_indices\nelement edge 1\nproperty int vertex1\nend_header\n"
    if not order:
        rows = [f"{p[0]} 9 {p[1]} {p[2]}" for p in x.tolist()]
        rows += [f"0.5 {len(face)} {' '.join(map(str, face))}" for face in faces]
        return (head + "\n".join([*rows, "1", ""])).encode()
    parts = [struct.pack(order + "dBdd", p[0], 9, p[1], p[2]) for p in x.tolist()]
    parts += [struct.pack(f"{order}fB{len(face)}i", 0.5, len(face), *face) for face in faces]
    return head.encode() + b"".join(parts) + struct.pack(order + "i", 1)


MIXED = {
    "obj": as_obj,
    "off": as_off,
    "ascii.ply": lambda *mesh: as_ply(*mesh, "ascii"),
    "little.ply": lambda *mesh: as_ply(*mesh, "binary_little_endian"),
    "big.ply": lambda *mesh: as_ply(*mesh, "binary_big_endian"),
}


@pytest.mark.parametrize("kind", MIXED)
def test_faces_of_three_to_six_corners_are_read_from_every_format(kind, tmp_path):
    x, faces = mixed()
    path = tmp_path / f"dome.{kind}"
    path.write_bytes(MIXED[kind](x, faces))
    vertices, triangles, notes, *_ = read_mesh(path)
    assert notes == ()
    np.testing.assert_array_equal(vertices, x)
    np.testing.assert_array_equal(
        triangles, Polygons(x, np.concatenate(faces), np.array([len(face) for face in faces])).triangles("it")
    )
    assert len(sound_mesh(vertices, triangles, "it")[0].loops) == 1


def test_indices_of_an_obj_may_count_from_the_end_and_lines_go_on(tmp_path):
    text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2\\\n -1\nv 0 1 0\nf 1 3 4\n"
    (tmp_path / "two.obj").write_text(text)
    assert read_mesh(tmp_path / "two.obj")[1].tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize("kind", ["obj", "off"])
def test_a_byte_order_mark_hides_no_first_line(kind, tmp_path):
    (tmp_path / f"dome.{kind}").write_bytes(b"\xef\xbb\xbf" + WRITERS[kind](*dome()))
    np.testing.assert_allclose(read_mesh(tmp_path / f"dome.{kind}")[0], dome()[0], rtol=1e-6, atol=1e-6)


ROOF_AND_BOX = (
    "o roof\nv 0 0 0\nv 1 0 0.1\nv 1 1 0\nv 0 1 0.1\nv 2 0 0\nv 2 1 0.1\nf 1 2 3 4\nf 2 5 6 3\n"
    "o box of wood\ng side\nv 5 5 5\nv 5.1 5 5\nv 5.1 5.1 5\nv 5 5.1 5\nf 7 8 9 10\ng top side\nf 7 8 9\n"
)


@pytest.mark.parametrize(("name", "faces"), [("roof", 4), ("box of wood", 3), ("side", 2), ("top side", 1), (None, 7)])
def test_objects_and_groups_of_an_obj_are_chosen_by_their_names(name, faces, tmp_path):
    (tmp_path / "objects.obj").write_text(ROOF_AND_BOX)
    assert len(read_mesh(tmp_path / "objects.obj", name)[1]) == faces


def test_a_name_that_is_not_there_is_answered_by_those_that_are(tmp_path):
    (tmp_path / "objects.obj").write_text(ROOF_AND_BOX)
    with pytest.raises(
        rs.InputError, match=r'no object named "door": it has "roof", "box of wood", "side", "top side"$'
    ):
        read_mesh(tmp_path / "objects.obj", "door")
    (tmp_path / "dome.ply").write_bytes(WRITERS["ply"](*dome()))
    with pytest.raises(rs.InputError, match='no object named "door": none in it has a name'):
        read_mesh(tmp_path / "dome.ply", "door")


def test_vertices_that_belong_to_no_face_are_told_and_do_not_matter(tmp_path):
    x, faces = dome()
    kept = faces[np.linalg.norm(x[faces].mean(axis=1)[:, :2] - [1, 2], axis=1) > 1.5]
    (tmp_path / "hole.obj").write_bytes(WRITERS["obj"](x, kept).rstrip(b"\n"))
    _, triangles, (note,), *_ = read_mesh(tmp_path / "hole.obj")
    assert len(triangles) == len(kept)
    loose = len(x) - len(np.unique(kept))
    assert note == f"{loose} of the 336 vertices of hole.obj belong to no face: if it lacks any, export it again"


def test_a_file_whose_last_line_is_not_whole_is_truncated(tmp_path):
    whole = WRITERS["obj"](*dome())
    (tmp_path / "cut.obj").write_bytes(whole[: int(0.6 * len(whole))])
    with pytest.raises(rs.InputError, match="truncated: its last line is not complete, and faces are missing"):
        read_mesh(tmp_path / "cut.obj")
