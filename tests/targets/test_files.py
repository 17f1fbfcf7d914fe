"""Targets from files: every format gives the same surface, and the command line takes the file alone."""

import json
import re
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import rodshell as rs
from rodshell.arrays import Floats
from rodshell.case import load_case
from rodshell.cli import main
from rodshell.targets import Freeform
from rodshell.targets.curve_files import read_curves
from tests.acceptance.targets_broken import WRITERS, broken_files, called
from tests.targets.meshes import PARTS, Mesh

MM = 1e-3


@pytest.fixture(scope="module")
def bowl() -> Mesh:
    x, faces = PARTS["bowl"]()
    return 1e3 * x, faces


def y_up(x: Floats) -> Floats:
    """Points whose z pointed upwards, as programs write them in which y does, and as glTF has them."""
    return x[:, [0, 2, 1]] * [1.0, 1.0, -1.0]


def write_glb(path: Path, mesh: Mesh) -> None:
    import trimesh

    trimesh.Trimesh(*mesh, process=False).export(path)


@pytest.mark.parametrize("kind", [*WRITERS, "glb"])
def test_every_format_gives_the_same_surface(kind, bowl, tmp_path):
    path = tmp_path / f"bowl.{kind}"
    if kind == "glb":
        write_glb(path, (y_up(bowl[0]), bowl[1]))
    else:
        path.write_bytes(WRITERS[kind](*bowl))
    target = rs.surface_from(path, unit=MM)
    assert target.size == pytest.approx(0.2, rel=1e-5)
    points = bowl[0][::7] * MM
    assert np.abs(target.implicit(points).value).max() < 5e-6
    assert target.parameters() == {"kind": "mesh", "unit": MM, "file": str(path)}


def test_gltf_is_in_metres_and_others_must_say_their_unit(bowl, tmp_path):
    write_glb(tmp_path / "bowl.glb", (y_up(MM * bowl[0]), bowl[1]))
    assert rs.surface_from(tmp_path / "bowl.glb").size == pytest.approx(0.2, rel=1e-5)
    (tmp_path / "bowl.obj").write_bytes(WRITERS["obj"](*bowl))
    with pytest.raises(
        rs.InputError, match=r"its unit \(it is 400 x 400 x [0-9.]+ units wide\).* --unit mm \(in Python unit=0.001\)"
    ):
        rs.surface_from(tmp_path / "bowl.obj")
    (tmp_path / "wide.obj").write_bytes(WRITERS["obj"](30 * bowl[0], bowl[1]))
    with pytest.raises(rs.InputError, match=r"its unit \(it is 12000 x 12000 x [0-9.]+ units wide\)"):
        rs.surface_from(tmp_path / "wide.obj")


@pytest.mark.parametrize(("kind", "usual", "other"), [("obj", "z", "y"), ("glb", "y", "z")])
def test_a_surface_that_stands_on_its_edge_asks_which_axis_points_upwards(kind, usual, other, bowl, tmp_path):
    """Of an OBJ z is taken to point upwards, of a glTF y; the boundary is turned with its surface."""
    path, x, edge = tmp_path / f"bowl.{kind}", MM * bowl[0], tmp_path / "edge.obj"
    angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    circle = np.column_stack([0.1 * np.cos(angle), 0.1 * np.sin(angle), np.zeros(60)])
    given, drawn = (y_up(x), y_up(circle)) if kind == "obj" else (x, circle)
    if kind == "obj":
        path.write_bytes(WRITERS["obj"](given, bowl[1]))
    else:
        write_glb(path, (given, bowl[1]))
    edge.write_text("".join(f"v {x} {y} {z}\n" for x, y, z in drawn) + f"l {' '.join(map(str, range(1, 61)))} 1\n")
    read = partial(rs.surface_from, path, unit=1.0)
    with pytest.raises(
        rs.InputError, match=rf"steeper than 60 degrees .*: does {other} .*--up {other};.* otherwise .{usual}"
    ):
        read()
    turned = read(boundary=edge, placement=rs.Placement(up=other))
    np.testing.assert_allclose(turned.surface.vertices, x, atol=1e-6)
    np.testing.assert_allclose(turned.curves[0][:60], circle, atol=1e-12)
    assert turned.parameters()["up"] == other
    assert read(placement=rs.Placement(up=usual)).parameters()["up"] == usual  # it is to stand so


def test_deep_domes_on_level_ground_do_not_ask(tmp_path):
    """Nine tenths of it are steeper than 60 degrees."""
    radius, angle = np.linspace(0.1, 1.0, 40), np.linspace(0.0, 2 * np.pi, 64, endpoint=False)
    x = np.array([(r * np.cos(a), r * np.sin(a), 4.0 * (1 - r**2)) for r in radius for a in angle])
    k = np.arange(39)[:, None] * 64 + np.arange(64)
    right = np.arange(39)[:, None] * 64 + (np.arange(64) + 1) % 64
    corners = (k, k + 64, right), (right, k + 64, right + 64)
    faces = np.concatenate([np.stack(three, axis=-1).reshape(-1, 3) for three in corners])
    (tmp_path / "dome.obj").write_bytes(WRITERS["obj"](x, faces))
    assert rs.surface_from(tmp_path / "dome.obj", unit=1.0).size == pytest.approx(2.0, rel=0.05)


def test_of_several_objects_one_is_chosen_by_its_name(bowl, tmp_path):
    import trimesh

    scene = trimesh.Scene()
    scene.add_geometry(trimesh.Trimesh(y_up(MM * bowl[0]), bowl[1], process=False), geom_name="roof")
    scene.add_geometry(trimesh.Trimesh(y_up(MM * bowl[0] + 2), bowl[1], process=False), geom_name="wall")
    scene.export(tmp_path / "house.glb")
    with pytest.raises(rs.InputError, match="2 separate pieces"):
        rs.surface_from(tmp_path / "house.glb")
    with pytest.raises(rs.InputError, match=r'no object named "door": it has "(roof|wall)", "(roof|wall)"'):
        rs.surface_from(tmp_path / "house.glb", name="door")
    assert rs.surface_from(tmp_path / "house.glb", name="wall").summit == pytest.approx((2.0, 2.0), abs=1e-3)


def test_a_table_of_heights_is_its_surface(tmp_path):
    """The first row is that of the largest y; an empty cell is a hole at the corner of four others."""

    def height(x, y):
        return 0.1 - x**2 - 0.6 * y**2 + 0.3 * x * y + 0.05 * x

    x, y = np.linspace(-0.2, 0.2, 41), np.linspace(0.15, -0.15, 31)
    table = height(x[None], y[:, None])
    np.savetxt(tmp_path / "roof.csv", 1e3 * table, delimiter=";")
    target = rs.heights_from(tmp_path / "roof.csv", size=(0.4, 0.3), height=MM)
    px, py = np.random.default_rng(0).uniform(-0.14, 0.14, (2, 200))
    assert target.height_at(np.column_stack([px, py])) == pytest.approx(height(px, py), abs=1e-6)
    rows = [",".join(f"{z:.6f}" for z in row) for row in table]
    rows[15] = ",".join("" if k == 20 else cell for k, cell in enumerate(rows[15].split(",")))
    (tmp_path / "holed.csv").write_text("\n".join(rows))
    holed = rs.heights_from(tmp_path / "holed.csv", size=(0.4, 0.3))
    assert len(holed.surface.loops) == 2
    assert np.sign(holed.margin(np.array([[0.0, 0.0, 0.1], [0.05, 0.0, 0.1]]))).tolist() == [-1.0, 1.0]


def test_a_grey_image_is_heights_between_black_and_white(tmp_path):
    x, y = np.meshgrid(np.linspace(-1, 1, 60), np.linspace(1, -1, 40))
    share = 0.9 - 0.4 * x**2 - 0.3 * y**2 + 0.1 * x
    Image.fromarray(np.rint(65535 * share).astype(np.uint16)).save(tmp_path / "roof.png")
    target = rs.heights_from(tmp_path / "roof.png", size=(0.6, 0.4), height=0.2)
    assert target.height_at(np.array([[0.15, 0.1], [-0.15, -0.1]])) == pytest.approx(
        0.2 * (0.9 - 0.1 - 0.075 + 0.05 * np.array([1, -1])), abs=2e-5
    )


def test_a_nurbs_patch_is_met_and_its_trim_bounds_it(tmp_path):
    """A plane trimmed to a circle, and the same plane whole: the surface of both goes on past the trim."""
    rhino3dm = pytest.importorskip("rhino3dm", reason="no rhino3dm: pip install rhino3dm")
    circle = rhino3dm.Circle(rhino3dm.Point3d(0, 0, 0), 150.0).ToNurbsCurve()
    model = rhino3dm.File3dm()
    model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Millimeters
    named = rhino3dm.ObjectAttributes()
    named.Name = "round"
    model.Objects.AddBrep(rhino3dm.Brep.CreateTrimmedPlane(rhino3dm.Plane.WorldXY(), circle), named)
    model.Objects.AddBrep(rhino3dm.Sphere(rhino3dm.Point3d(0, 0, 0), 200.0).ToBrep(), rhino3dm.ObjectAttributes())
    model.Write(str(tmp_path / "two.3dm"), 7)
    with pytest.raises(rs.InputError, match="2 surfaces: choose one"):
        rs.surface_from(tmp_path / "two.3dm")
    target = rs.surface_from(tmp_path / "two.3dm", name="round")
    angle = np.linspace(0, 6, 40)
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    assert target.margin(0.1 * ring) == pytest.approx(0.05, rel=1e-3)
    assert target.margin(0.17 * ring) == pytest.approx(-0.02, rel=1e-3)


def test_arcs_and_splines_of_a_dxf_are_curves_and_its_lines_are_straight(tmp_path):
    """Cubics that stand for a quarter of a circle, as ezdxf makes them, are 3e-4 of the radius off."""
    import ezdxf

    drawing = ezdxf.new()
    model, half = drawing.modelspace(), 0.5**0.5
    model.add_circle((0, 0), 4.0)
    model.add_lwpolyline([(3, 0, 1), (-3, 0, 1)], format="xyb", close=True)
    square = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)])
    knots = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]
    model.add_rational_spline(2.0 * np.pad(square, ((0, 0), (0, 1))), [1, half] * 4 + [1], degree=2, knots=knots)
    corners = np.array([(0.9, 0.0), (0.3, 0.4), (-0.5, 0.2), (-0.2, -0.6)])
    for one, other in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        model.add_line(one, other)
    drawing.saveas(tmp_path / "edge.dxf")
    *curves, drawn = read_curves(tmp_path / "edge.dxf", 1.0)
    for curve, radius in zip(curves, (4.0, 3.0, 2.0), strict=True):
        assert np.hypot(*curve[:, :2].T) == pytest.approx(radius, rel=3e-5)
        assert len(curve) > 300
    assert sorted(map(tuple, drawn[:, :2])) == sorted(map(tuple, corners))


def test_curves_of_a_3dm_are_divided_its_polylines_are_not_and_its_unit_holds(tmp_path):
    """A circle; two lines and two arcs in one curve; a polyline; and a surface, which is no curve."""
    rhino3dm = pytest.importorskip("rhino3dm")
    model, at = rhino3dm.File3dm(), rhino3dm.Point3d
    model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Millimeters
    model.Objects.AddCircle(rhino3dm.Circle(4000.0))
    slot = rhino3dm.PolyCurve()
    ends = [at(x, y, 0) for x, y in ((-1e3, -3e3), (1e3, -3e3), (1e3, 3e3), (-1e3, 3e3))]
    for k, middle in enumerate((None, at(4e3, 0, 0), None, at(-4e3, 0, 0))):
        a, b = ends[k], ends[(k + 1) % 4]
        piece = rhino3dm.LineCurve(a, b) if middle is None else rhino3dm.Arc(a, middle, b).ToNurbsCurve()
        slot.AppendSegment(piece)
    model.Objects.AddCurve(slot)
    corners = np.array([(0.9, 0.0, 1.0), (0.3, 0.4, 1.0), (-0.5, 0.2, 1.0), (-0.2, -0.6, 1.0)])
    line = rhino3dm.Polyline(5)
    for corner in (*corners, corners[0]):
        line.Add(*(1e3 * corner).tolist())
    model.Objects.AddPolyline(line)
    model.Objects.AddBrep(rhino3dm.Sphere(at(0, 0, 0), 9e3).ToBrep())
    assert model.Write(str(tmp_path / "edge.3dm"), 7)
    circle, rounded, drawn = read_curves(tmp_path / "edge.3dm", 1.0)
    assert np.hypot(*circle[:, :2].T) == pytest.approx(4.0, rel=1e-12)
    assert len(circle) == 400
    x, y = np.abs(rounded[:, :2]).T
    assert np.where(x > 1, np.hypot(x - 1, y), y) == pytest.approx(3.0, rel=1e-9)
    assert np.abs(np.sort(drawn, axis=0) - np.sort(corners, axis=0)).max() < 1e-12


def test_surfaces_of_a_3dm_with_one_name_are_chosen_by_number(tmp_path):
    rhino3dm = pytest.importorskip("rhino3dm")
    model = rhino3dm.File3dm()
    model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Millimeters
    named = rhino3dm.ObjectAttributes()
    named.Name = "roof"
    for x in (0.0, 500.0):
        circle = rhino3dm.Circle(rhino3dm.Point3d(x, 0, 0), 150.0).ToNurbsCurve()
        model.Objects.AddBrep(rhino3dm.Brep.CreateTrimmedPlane(rhino3dm.Plane.WorldXY(), circle), named)
    model.Write(str(tmp_path / "two.3dm"), 7)
    for name in (None, "roof", "3"):
        with pytest.raises(rs.InputError, match=r'number.*available: 1, "roof"; 2, "roof"'):
            rs.surface_from(tmp_path / "two.3dm", name=name)
    assert rs.surface_from(tmp_path / "two.3dm", name="2").summit[0] == pytest.approx(0.5, abs=0.15)


def test_a_3dm_without_a_surface_says_what_it_has(tmp_path):
    rhino3dm = pytest.importorskip("rhino3dm")
    model, mesh = rhino3dm.File3dm(), rhino3dm.Mesh()
    for x, y in ((0, 0), (1, 0), (0, 1)):
        mesh.Vertices.Add(x, y, 0)
    mesh.Faces.AddFace(0, 1, 2)
    model.Objects.AddMesh(mesh)
    for radius in (1.0, 2.0):
        model.Objects.AddCircle(rhino3dm.Circle(radius))
    model.Write(str(tmp_path / "mesh.3dm"), 7)
    with pytest.raises(rs.InputError, match="has 1 mesh, 2 curves, and no surface: export the mesh as OBJ"):
        rs.surface_from(tmp_path / "mesh.3dm")


def test_a_3dm_without_curves_has_no_boundary(tmp_path):
    rhino3dm = pytest.importorskip("rhino3dm")
    model = rhino3dm.File3dm()
    model.Objects.AddBrep(rhino3dm.Sphere(rhino3dm.Point3d(0, 0, 0), 9e3).ToBrep())
    model.Write(str(tmp_path / "ball.3dm"), 7)
    with pytest.raises(rs.InputError, match="has no closed curve"):
        read_curves(tmp_path / "ball.3dm", 1.0)


@pytest.mark.slow
def test_the_command_line_takes_a_mesh_and_writes_a_case_that_gives_it_again(bowl, tmp_path, capsys):
    (tmp_path / "roof.obj").write_bytes(WRITERS["obj"](20 * bowl[0], bowl[1]))
    out = tmp_path / "out"
    arguments = ["form", str(tmp_path / "roof.obj"), "--unit", "mm", "--spacing", "1000mm", "--out", str(out)]
    assert main([*arguments, "--json", "--quiet"]) == 0
    assert json.loads(capsys.readouterr().out)["status"] == "converged"
    first = json.loads((out / "result.json").read_text())
    assert first["target"]["kind"] == "mesh"
    assert first["layout"]["edge"] == pytest.approx(1 / 6)
    case = load_case(out / "case.toml")
    assert case.target.kind == "mesh"
    assert case.rod.section.radius == first["rod"]["section"]["radius"] > 0  # chosen then, given now
    assert main(["form", str(out / "case.toml"), "--out", str(tmp_path / "again"), "--quiet"]) == 0
    again = json.loads((tmp_path / "again" / "result.json").read_text())
    assert again["footprint"] == first["footprint"]


def test_a_tube_too_takes_its_radius_from_the_size_of_a_surface(bowl, tmp_path):
    (tmp_path / "roof.obj").write_bytes(WRITERS["obj"](*bowl))
    tube = {"target.unit": "mm", "rod.section.kind": "tube", "rod.section.thickness": "0.1 mm"}
    case = load_case(tmp_path / "roof.obj", tube)
    section = case.build().rod.section
    assert isinstance(section, rs.Tube)
    assert (section.radius, section.thickness) == (pytest.approx(0.001, rel=1e-4), 0.0001)
    with pytest.raises(rs.InputError, match="there is no target"):
        case.rod.build()


def test_a_case_names_files_from_its_own_folder(bowl, tmp_path, monkeypatch):
    (tmp_path / "roof.off").write_bytes(WRITERS["off"](*bowl))
    (tmp_path / "case.toml").write_text(
        '[target]\nkind = "mesh"\nfile = "roof.off"\nunit = "mm"\nmove = [0, 0, "1 m"]\n'
    )
    monkeypatch.chdir("/")
    target = load_case(tmp_path / "case.toml").build().target
    assert isinstance(target, Freeform)
    assert target.height_at(np.zeros((1, 2)))[0] == pytest.approx(1.1, abs=1e-4)


def test_of_a_box_of_two_triangles_a_face_the_top_is_taken_and_what_leaves_nothing_is_refused(bowl, tmp_path):
    import trimesh

    trimesh.creation.box((12, 8, 3)).export(tmp_path / "box.stl")
    for base in (None, 1.0):
        top = rs.surface_from(tmp_path / "box.stl", unit=1.0, base=base)
        assert len(top.surface.faces) == 2
        assert top.height_at(np.array([[5.0, -3.0], [0.0, 0.0]])) == pytest.approx([1.5, 1.5], abs=1e-9)
    with pytest.raises(rs.InputError, match=r'no part of "box\.stl" is inside its boundary: choose a lower base'):
        rs.surface_from(tmp_path / "box.stl", unit=1.0, base=2.0)
    (tmp_path / "bowl.obj").write_bytes(WRITERS["obj"](*bowl))
    with pytest.raises(rs.InputError, match=r'no part of "bowl\.obj" is inside its boundary: choose a lower base'):
        rs.surface_from(tmp_path / "bowl.obj", unit=MM, base=100.0)


@pytest.mark.slow
def test_broken_files_are_refused_in_one_sentence(tmp_path):
    """A tenth of those that `make accept-targets` tries, every kind of fault among them in some format."""
    for what, arguments in list(broken_files(tmp_path))[3::10]:
        result = called(what, arguments, tmp_path / "out")
        assert not result.wrong, (what, result)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("word.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 x\n"),
        ("short.ply", b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                      b"element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0\n1\n"),
        ("noise.off", b"OFF\n3 1 0\n0 0 0\n1 0 x\n"),
        ("noise.glb", b"glTF" + bytes(range(200))),
    ],
)  # fmt: skip
def test_a_file_that_cannot_be_read_is_refused_with_the_readers_own_words_in_one_line(name, content, tmp_path):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(rs.InputError) as caught:
        rs.surface_from(path, unit=1.0)
    words = f"cannot be read as {path.suffix[1:].upper()}: it is damaged or of another format; export it again "
    assert re.search(re.escape(words) + r"\(the reader says: \w+(: .+)?\)$", str(caught.value))


def test_noise_in_an_stl_is_refused(tmp_path):
    """trimesh 4 raises an error for it, trimesh 5 finds no faces."""
    (tmp_path / "noise.stl").write_bytes(bytes(range(255, 0, -1)) * 9)
    with pytest.raises(rs.InputError, match=r"cannot be read as STL: it is damaged|has no faces, or is damaged"):
        rs.surface_from(tmp_path / "noise.stl", unit=1.0)


def test_a_fault_of_the_reader_itself_is_not_hidden_behind_the_file(bowl, tmp_path, monkeypatch):
    (tmp_path / "bowl.stl").write_bytes(WRITERS["stl"](*bowl))
    monkeypatch.delattr("trimesh.load_scene")  # as in its versions before 4.6
    with pytest.raises(rs.InputError, match="module 'trimesh' has no attribute 'load_scene'"):
        rs.surface_from(tmp_path / "bowl.stl", unit=1.0)


@pytest.mark.parametrize("code", ["utf-8", "utf-8-sig", "cp1252", "utf-16"])
def test_names_and_comments_may_be_written_in_any_usual_code(code, bowl, tmp_path):
    text = WRITERS["obj"](*bowl).decode()
    (tmp_path / "bowl.obj").write_bytes(f"# gro\xdf\no K\xfcppel\n{text}".encode(code))
    assert rs.surface_from(tmp_path / "bowl.obj", unit=1.0, name="K\xfcppel").size > 0
    comments = {"off": ("OFF\n", "OFF\n# gro\xdf\n"), "ply": ("ascii 1.0\n", "ascii 1.0\ncomment gro\xdf\n")}
    for kind, (line, longer) in comments.items() if code != "utf-16" else ():
        written = WRITERS[kind](*bowl).decode().replace(line, longer)
        (tmp_path / f"bowl.{kind}").write_bytes(written.encode(code.removesuffix("-sig")))
        assert rs.surface_from(tmp_path / f"bowl.{kind}", unit=1.0).size > 0


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [("noise.dxf", b"\x00\xff noise", "drawing of curves: it is damaged or of another format; export it again"),
     ("beyond.obj", b"v 0 0 0\nl 1 2 99999\n", "drawing of curves: it is damaged or of another format; export it"),
     ("no.dxf", None, "there is no file named .*: check the path")],
)  # fmt: skip
def test_curves_that_cannot_be_read_are_refused_in_plain_words(name, content, said, tmp_path):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(rs.InputError, match=said):
        read_curves(tmp_path / name, 1.0)


def test_saved_case_of_a_relative_file_runs_again_from_elsewhere(tmp_path, monkeypatch):
    source = Path(__file__).parents[2] / "examples" / "data" / "freeform.obj"
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "roof.obj").write_bytes(source.read_bytes())
    monkeypatch.chdir(tmp_path)
    saved = load_case("in/roof.obj", {"target.unit": "m"}).to_toml()
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "case.toml").write_text(saved)
    monkeypatch.chdir(tmp_path / "out")
    assert load_case("case.toml").to_toml() == saved
    assert Path(load_case("case.toml").target.file).samefile(tmp_path / "in" / "roof.obj")
