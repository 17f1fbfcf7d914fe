"""Models for other programs, read back without the code that wrote them."""

import base64
import json
import struct
import xml.etree.ElementTree as ET
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rodshell.errors import InputError
from rodshell.figures.form import Section, Stiffness
from rodshell.output.drawings.flat import flat_plan
from rodshell.output.files import export
from rodshell.output.grid import joints_of, rods_of
from rodshell.output.models import swept
from rodshell.output.sections import section_outline, widths_along
from tests.output.forms import archive, wished

RADIUS = 1e-3  # m, of the rods


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("models")
    export(archive("dome"), folder, ["gltf", "vtp", "compas"])
    return folder


def glb(path: Path) -> tuple[dict[str, Any], bytes]:
    data = path.read_bytes()
    magic, version, length = struct.unpack("<4sII", data[:12])
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack("<I4s", data[12:20])
    assert kind == b"JSON"
    tree = json.loads(data[20 : 20 + size])
    body_size, kind = struct.unpack("<I4s", data[20 + size : 28 + size])
    assert kind == b"BIN\0"
    assert tree["buffers"] == [{"byteLength": body_size}]
    assert size % 4 == body_size % 4 == 0
    return tree, data[28 + size :]


def accessor(tree: dict[str, Any], body: bytes, index: int) -> np.ndarray:
    entry = tree["accessors"][index]
    view = tree["bufferViews"][entry["bufferView"]]
    kind = {5126: "<f4", 5125: "<u4"}[entry["componentType"]]
    assert view["byteOffset"] % 4 == 0
    values = np.frombuffer(body[view["byteOffset"] : view["byteOffset"] + view["byteLength"]], dtype=kind)
    values = values.reshape(entry["count"], {"SCALAR": 1, "VEC3": 3}[entry["type"]])
    if "min" in entry:
        np.testing.assert_allclose(entry["min"], values.min(axis=0), rtol=1e-6)
        np.testing.assert_allclose(entry["max"], values.max(axis=0), rtol=1e-6)
    return values


def test_gltf_holds_every_rod_as_a_tube_of_its_radius(out: Path) -> None:
    tree, body = glb(out / "model/popped_clamped.glb")
    rods, positions = rods_of(archive("dome")), archive("dome").states["popped_clamped"]
    assert [node["name"] for node in tree["nodes"]] == [rod.id for rod in rods]
    assert tree["asset"]["version"] == "2.0"
    for rod, node in zip(rods, tree["nodes"], strict=True):
        (part,) = tree["meshes"][node["mesh"]]["primitives"]
        x, y, z = accessor(tree, body, part["attributes"]["POSITION"]).T
        points = np.column_stack([x, -z, y]).reshape(len(rod.nodes), -1, 3)  # y up in the file, z up here
        off = points - positions[rod.nodes][:, None]
        np.testing.assert_allclose(np.linalg.norm(off, axis=-1), RADIUS, rtol=1e-4)
        np.testing.assert_allclose(off.mean(axis=1), 0, atol=1e-7)
        faces = accessor(tree, body, part["indices"]).reshape(-1, 3)
        assert faces.max() < len(x)
        nx, ny, nz = accessor(tree, body, part["attributes"]["NORMAL"]).T
        normals = np.column_stack([nx, -nz, ny])
        corners = points.reshape(-1, 3)[faces].astype(float)
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert np.all(np.sum(across * normals[faces].mean(axis=1), axis=1) > 0)  # triangles face outwards
        shades = accessor(tree, body, part["attributes"]["COLOR_0"])
        assert shades.min() >= 0
        assert shades.max() <= 1


def test_a_swept_tube_has_its_circumference_times_its_length() -> None:
    angle = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    outline = 0.01 * np.column_stack([np.cos(angle), np.sin(angle)])
    t = np.linspace(0, 2, 200)
    curve = np.column_stack([0.3 * np.cos(t), 0.3 * np.sin(t), 0.1 * t])
    points, normals, faces = swept(curve, outline)
    a, b, c = points[faces].transpose(1, 0, 2)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    sides = 8 * 2 * 0.01 * np.sin(np.pi / 8)
    length = np.linalg.norm(np.diff(curve, axis=0), axis=1).sum()
    assert area == pytest.approx(sides * length, rel=2e-3)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)


def test_a_straight_upright_rod_can_be_swept() -> None:
    curve = np.column_stack([np.zeros(4), np.zeros(4), np.arange(4.0)])
    points, _, _ = swept(curve, np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]))
    np.testing.assert_allclose(np.hypot(points[:, 0], points[:, 1]), 1.0)


def vtk_array(path: Path, name: str) -> np.ndarray:
    array = next(one for one in ET.parse(path).getroot().iter("DataArray") if one.attrib["Name"] == name)
    data = base64.b64decode((array.text or "")[24:])
    return np.frombuffer(zlib.decompress(data), dtype={"Float64": "<f8", "Int64": "<i8"}[array.attrib["type"]])


def test_the_time_series_goes_from_flat_to_popped(out: Path) -> None:
    dome = archive("dome")
    root = ET.parse(out / "model/pop_up.pvd").getroot()
    entries = [(float(one.attrib["timestep"]), one.attrib["file"]) for one in root.iter("DataSet")]
    np.testing.assert_allclose([time for time, _ in entries], dome.states["history_share"], atol=1e-6)
    nodes = dome.states["rod_nodes"]
    for k, (_, file) in enumerate(entries):
        points = vtk_array(out / "model" / file, "Points").reshape(-1, 3)
        stage = dome.states["history"][k]
        np.testing.assert_allclose(points, stage[nodes], atol=1e-7)  # the flat grid where it is laid out, too
        if k > 0:
            stress = vtk_array(out / "model" / file, "stress")
            np.testing.assert_allclose(stress, dome.states["history_stress"][k], rtol=1e-5)


def test_compas_json_has_every_rod_and_joint(out: Path) -> None:
    dome = archive("dome")
    tree = json.loads((out / "model/popped_clamped.json").read_text())
    rods = rods_of(dome)
    for rod, line in zip(rods, tree["rods"], strict=True):
        assert (line["dtype"], line["name"]) == ("compas.geometry/Polyline", rod.id)
        np.testing.assert_array_equal(line["data"]["points"], dome.states["popped_clamped"][rod.nodes])
    graph = tree["grid"]["data"]
    joints = joints_of(rods)
    assert set(graph["node"]) == {repr(joint.id) for joint in joints} == set(graph["edge"])
    for joint in joints:
        at = [graph["node"][repr(joint.id)][axis] for axis in "xyz"]
        (shared,) = np.intersect1d(*(rods[k].nodes for k in joint.rods))
        np.testing.assert_array_equal(at, dome.states["popped_clamped"][shared])
    edges = sum(map(len, graph["edge"].values()))
    assert edges == sum(len(rod.joints) - 1 for rod in rods)


def test_compas_loads_it(out: Path) -> None:
    compas = pytest.importorskip("compas", reason="no compas: pip install compas")
    loaded = compas.json_load(out / "model/popped_clamped.json")
    assert len(loaded["rods"]) == len(rods_of(archive("dome")))
    assert loaded["rods"][0].name == "U01"
    graph = loaded["grid"]
    joints = joints_of(rods_of(archive("dome")))
    assert graph.number_of_nodes() == len(joints)
    assert graph.node_attributes(joints[0].id, "xyz") == pytest.approx(
        list(graph.node_attributes(joints[0].id, ["x", "y", "z"]))
    )


def test_rhino_model_has_layers_names_and_user_text(tmp_path: Path) -> None:
    r = pytest.importorskip("rhino3dm", reason="no rhino3dm: pip install rhino3dm")
    export(wished(), tmp_path, ["3dm"])
    model = r.File3dm.Read(str(tmp_path / "model/rodshell.3dm"))
    assert model.Settings.ModelUnitSystem == r.UnitSystem.Millimeters
    names = [layer.Name for layer in model.Layers]
    plan = flat_plan(wished())
    by_layer: dict[str, list[Any]] = {name: [] for name in names}
    for item in model.Objects:
        by_layer[names[item.Attributes.LayerIndex]].append(item)
    for layer in ("CUT", "FINAL"):
        assert [item.Attributes.Name for item in by_layer[layer]] == [rod.id for rod in plan.rods]
    for item, rod in zip(by_layer["CUT"], plan.rods, strict=True):
        length = float(item.Attributes.GetUserString("cut_length_mm"))
        ends = item.Geometry.PointAtStart, item.Geometry.PointAtEnd
        assert ends[0].DistanceTo(ends[1]) == pytest.approx(1e3 * rod.cut_length, abs=1e-6)
        assert length == pytest.approx(1e3 * rod.cut_length, abs=0.501 * plan.rounding.step)
    assert len(by_layer["MARK"]) == 2 * len(plan.joints)


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "rhino3dm", None)
    with pytest.raises(InputError, match=r"pip install \"rodshell\[rhino\]\""):
        export(archive("dome"), tmp_path, ["3dm"])


def test_a_lath_lies_flat_on_the_shell() -> None:
    """A rectangle's width is along the grid's normal, its height within the grid."""
    outline = section_outline(Section(kind="rectangle", width=1e-3, height=4e-3), 1.0)
    np.testing.assert_allclose(np.ptp(outline, axis=0), [4e-3, 1e-3])  # across, up
    outline = section_outline(Section(kind="ellipse", a=1e-3, b=3e-3), 1.0)
    np.testing.assert_allclose(np.ptp(outline, axis=0), [6e-3, 2e-3])
    points, _, _ = swept(np.column_stack([np.arange(4.0), np.zeros(4), np.zeros(4)]), outline)
    np.testing.assert_allclose(np.ptp(points, axis=0)[1:], [6e-3, 2e-3])  # level rod: across is y, up is z


@pytest.mark.parametrize(
    ("section", "varies"),
    [
        (Section(kind="rectangle", width=1e-3, height=4e-3), "size"),
        (Section(kind="rectangle", width=1e-3, height=4e-3), "width"),
        (Section(kind="rectangle", width=1e-3, height=4e-3), "height"),
        (Section(kind="ellipse", a=1e-3, b=3e-3), "a"),
        (Section(kind="ellipse", a=1e-3, b=3e-3), "b"),
    ],
)
def test_a_tapered_rod_is_drawn_as_stiff_as_it_is(section: Section, varies: Any) -> None:
    """The second moment of the drawn section, of its polygon, follows the stiffness, linear between stations."""
    along = Stiffness(at=[0.0, 1.0, 2.0], factors=[1.0, 8.0, 0.5], varies=varies, sizes=[])
    widths = widths_along(along, np.linspace(0, 2, 5))
    outline = section_outline(section, 1.0)
    drawn = [second_moment(outline * pair) / second_moment(outline) for pair in widths]
    np.testing.assert_allclose(drawn, [1.0, 4.5, 8.0, 4.25, 0.5])


def test_double_laths_are_drawn_twice_as_thick_along_the_normal() -> None:
    """Two laths that slide on each other are twice as stiff, and twice as thick."""
    along = Stiffness(at=[0.0, 0.5, 0.5, 3.0], factors=[1.0, 1.0, 2.0, 2.0], varies="laths", sizes=[])
    np.testing.assert_allclose(widths_along(along, np.linspace(0, 3, 4)), [[1, 1], [1, 2], [1, 2], [1, 2]])


def second_moment(polygon: np.ndarray) -> float:
    """Of an area that is its own mirror image, about the axis across."""
    (x, y), (x1, y1) = polygon.T, np.roll(polygon, -1, axis=0).T
    return float(np.sum((x * y1 - x1 * y) * (y * y + y * y1 + y1 * y1)) / 12)
