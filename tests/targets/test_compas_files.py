"""Targets from the JSON of COMPAS: the surfaces that other formats give; what is damaged is refused in one sentence."""

import json
from pathlib import Path

import numpy as np
import pytest

import rodshell as rs
from rodshell.targets.compas_files import read_compas
from tests.targets.meshes import sheet

BEZIER = {
    "points": [[[i, j, 0.25 * (1 - i * j * (j - i))] for j in (-1.0, 0.0, 1.0)] for i in (-1.0, 0.0, 1.0)],
    "weights": [[1.0, 1.0, 1.0]] * 3, "knots_u": [0.0, 1.0], "knots_v": [0.0, 1.0], "mults_u": [3, 3],
    "mults_v": [3, 3], "degree_u": 2, "degree_v": 2, "is_periodic_u": False, "is_periodic_v": False,
}  # fmt: skip


def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.asarray(0.3 - 0.5 * x**2 - 0.5 * y**2)


def mesh_json(vertices: np.ndarray, faces: np.ndarray) -> dict:  # type: ignore[type-arg]
    """As `compas.json_dumps(Mesh)` writes it, of version 2.15."""
    vertex = {str(k): dict(zip("xyz", at, strict=True)) for k, at in enumerate(vertices.tolist())}
    data = {"vertex": vertex, "face": {str(k): face for k, face in enumerate(faces.tolist())},
            "default_vertex_attributes": {"x": 0.0, "y": 0.0, "z": 0.0}}  # fmt: skip
    return {"dtype": "compas.datastructures/Mesh", "data": data, "inheritance": []}


def written(folder: Path, tree: object) -> Path:
    (folder / "roof.json").write_text(json.dumps(tree))
    return folder / "roof.json"


def test_a_mesh_gives_the_form_of_the_same_mesh_in_obj(tmp_path: Path) -> None:
    vertices, faces = sheet(height, 0.8, 24)
    lines = [f"v {x} {y} {z}" for x, y, z in vertices.tolist()] + [f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist()]
    (tmp_path / "roof.obj").write_text("\n".join(lines) + "\n")
    layout = rs.GridLayout.orthogonal(rods=(5, 5), spacing=0.15)
    path = written(tmp_path, mesh_json(vertices, faces))
    ours, theirs = (
        rs.find_form(rs.surface_from(file, unit=1.0, base=0.0), layout, rs.Rod(rs.Circle(0.002), rs.Material(1e9, 1e3)))
        for file in (path, tmp_path / "roof.obj")
    )
    np.testing.assert_allclose(ours.footprint.points, theirs.footprint.points, atol=1e-12)


def test_a_surface_is_its_polynomial(tmp_path: Path) -> None:
    """The quadratic Bezier patch against Bernstein's sum."""
    found = read_compas(written(tmp_path, {"dtype": "compas_occ.geometry/OCCNurbsSurface", "data": BEZIER}))
    t = np.linspace(0.0, 1.0, round(len(found.vertices) ** 0.5))
    b = np.stack([(1 - t) ** 2, 2 * t * (1 - t), t**2])
    exact = np.einsum("iu,jv,ijk->uvk", b, b, np.array(BEZIER["points"])).reshape(-1, 3)
    np.testing.assert_allclose(found.vertices, exact, atol=1e-14)


def test_one_of_several_is_chosen_by_its_name(tmp_path: Path) -> None:
    mesh = mesh_json(*sheet(height, 0.8, 4))
    path = written(tmp_path, {"roof": mesh, "more": [{**mesh, "name": "wall"}]})
    assert len(read_compas(path, "wall").faces) == len(read_compas(path, "roof").faces)
    with pytest.raises(rs.InputError, match=r"2 surfaces: choose one by target\.object: roof, wall"):
        read_compas(path)


@pytest.mark.parametrize(
    ("tree", "words"),
    [
        ({"a": 1}, "neither a Mesh nor a NurbsSurface"),
        ({"dtype": "compas.datastructures/Mesh", "data": {"vertex": {}}}, "cannot be read as COMPAS|damaged"),
        ({"dtype": "compas.geometry/NurbsSurface", "data": BEZIER | {"is_periodic_u": True}}, "periodic"),
        ({"dtype": "compas.geometry/NurbsSurface", "data": BEZIER | {"mults_u": [2, 2]}}, "knots"),
    ],
)
def test_what_is_no_surface_is_refused(tree: object, words: str, tmp_path: Path) -> None:
    with pytest.raises(rs.InputError, match=words):
        read_compas(written(tmp_path, tree))


def test_compas_itself_writes_what_is_read_and_reads_what_is_written(tmp_path: Path) -> None:
    compas = pytest.importorskip("compas", reason='no compas: pip install "rodshell[compas]"')
    from compas.datastructures import Graph, Mesh
    from compas.geometry import Polyline

    vertices, faces = sheet(height, 0.8, 24)
    compas.json_dump(Mesh.from_vertices_and_faces(vertices.tolist(), faces.tolist()), tmp_path / "roof.json")
    layout = rs.GridLayout.orthogonal(rods=(5, 5), spacing=0.15)
    rod = rs.Rod(rs.Circle(0.002), rs.Material(1e9, 1e3))
    form = rs.find_form(rs.surface_from(tmp_path / "roof.json", unit=1.0, base=0.0), layout, rod, ends="pinned")
    form.save(tmp_path / "out", kinds="compas")
    back = compas.json_load(tmp_path / "out" / "model" / "popped_pinned.json")
    assert all(isinstance(line, Polyline) for line in back["rods"])
    assert isinstance(back["grid"], Graph)
    assert isinstance(back["cells"], Mesh)
    assert back["cells"].number_of_faces() == 16  # between 5 x 5 rods
    assert back["cells"].number_of_vertices() == back["grid"].number_of_nodes() == 25
    nodes = form.archive().states["rod_nodes"]
    ours = form.popped["pinned"].positions[nodes]
    np.testing.assert_allclose(np.vstack([line.points for line in back["rods"]]), ours, atol=1e-12)
