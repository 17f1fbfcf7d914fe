"""Surfaces, drawings and tables that were made to do harm: each is one sentence, and costs next to nothing."""

import json
import os
import random
import resource
import struct
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
from PIL import Image

import rodshell as rs
from rodshell import untrusted
from rodshell.case.rod_ends import read_table
from rodshell.sweeps.identity import content_digest
from rodshell.targets import apart
from rodshell.targets.curve_files import read_curves
from rodshell.targets.field_fitting import cubic_spacing
from rodshell.targets.mesh_files import read_mesh
from rodshell.targets.nurbs import Nurbs
from rodshell.targets.samples import mesh_samples
from rodshell.targets.trianglemesh import sound_mesh
from tests.acceptance.targets_broken import WRITERS, dome
from tests.attack import surface_files
from tests.targets.test_polygons import MIXED, mixed

pytestmark = pytest.mark.attack
TRIES = 40 * int(os.environ.get("RODSHELL_ATTACK", "1"))


def refused(said: str, call: Callable[..., object], *arguments: Any, **named: Any) -> None:
    """It is refused in one sentence, within seconds and a few hundred megabytes."""
    started, before = time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(rs.InputError, match=said) as caught:
        call(*arguments, **named)
    assert "\n" not in str(caught.value)
    assert time.process_time() - started < 10
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 600_000  # kB


# glTF, and what it names


@pytest.fixture
def gltf(tmp_path: Path) -> Path:
    """A sound file with its buffer, in a folder of its own."""
    (tmp_path / "model" / "parts").mkdir(parents=True)
    tree, buffer = surface_files.gltf_tree("parts/the%20roof.bin")
    (tmp_path / "model" / "parts" / "the roof.bin").write_bytes(buffer)
    (tmp_path / "model" / "roof.gltf").write_text(json.dumps(tree))
    (tmp_path / "secret.bin").write_bytes(buffer)
    return tmp_path / "model" / "roof.gltf"


def named(path: Path, uri: object) -> Path:
    tree = json.loads(path.read_text())
    tree["buffers"][0]["uri"] = uri
    path.write_text(json.dumps(tree))
    return path


def test_gltf_takes_a_file_below_its_own_folder(gltf: Path) -> None:
    assert rs.surface_from(gltf).size == pytest.approx(5.0, rel=1e-3)
    assert content_digest(gltf) != content_digest(named(gltf, another_buffer(gltf)))


def another_buffer(gltf: Path) -> str:
    """Another buffer beside the file, of which a sweep must know."""
    buffer = np.frombuffer((gltf.parent / "parts" / "the roof.bin").read_bytes(), "<f4").copy()
    buffer[-1] += 0.1
    (gltf.parent / "other.bin").write_bytes(buffer.tobytes())
    return "other.bin"


@pytest.mark.parametrize(
    "uri",
    ["../secret.bin", "%2e%2e/secret.bin", "parts/../../secret.bin", "..\\secret.bin", "C:secret.bin", "link.bin",
     "folder/secret.bin", "file:///etc/hostname", "http://127.0.0.1:9/roof.bin", "/etc/hostname", "a\0b",
     "", "x" * 5000],
)  # fmt: skip
def test_gltf_takes_no_file_outside_of_its_folder(uri: str, gltf: Path) -> None:
    (gltf.parent / "link.bin").symlink_to(gltf.parents[1] / "secret.bin")
    (gltf.parent / "folder").symlink_to(gltf.parents[1])
    for read in (rs.surface_from, content_digest):
        refused("only files in its own folder are read|cannot be read: File name too long", read, named(gltf, uri))


@pytest.mark.parametrize("uri", [5, None, ["roof.bin"], {}])
def test_gltf_with_a_name_that_is_none_is_refused(uri: object, gltf: Path) -> None:
    refused("there is no file named", rs.surface_from, named(gltf, uri))


def test_gltf_takes_no_device_as_its_buffer(gltf: Path) -> None:
    (gltf.parent / "zero.bin").symlink_to("/dev/zero")
    refused("only files in its own folder are read", rs.surface_from, named(gltf, "zero.bin"))


def test_damaged_gltf_beside_model_gltf_does_not_read_that_one(gltf: Path) -> None:
    named(gltf, another_buffer(gltf))
    (gltf.parent / "model.gltf").write_bytes(gltf.read_bytes())
    gltf.write_bytes(gltf.read_bytes()[:-9])
    refused("cannot be read as GLTF: it is damaged", rs.surface_from, gltf)


def test_glb_reads_no_other_file(tmp_path: Path) -> None:
    tree, buffer = surface_files.gltf_tree("roof.bin")
    (tmp_path / "roof.bin").write_bytes(buffer)
    (tmp_path / "roof.glb").write_bytes(surface_files.glb(tree))
    refused("names further files: save it as one file", rs.surface_from, tmp_path / "roof.glb")


def test_gltf_that_announces_more_than_it_holds_is_refused(tmp_path: Path) -> None:
    tree, _ = surface_files.gltf_tree(None)
    for accessor in tree["accessors"]:  # type: ignore[attr-defined]
        accessor["count"] = 10**9
        del accessor["bufferView"]  # which is then filled with zeros
    (tmp_path / "roof.glb").write_bytes(surface_files.glb(tree))
    refused(r"announces 1\.6e\+04 MB of numbers.* RODSHELL_LIMITS=54", rs.surface_from, tmp_path / "roof.glb")
    tree["nodes"] = [{"mesh": 0, "children": [k + 1]} for k in range(5000)]
    tree["accessors"] = []
    (tmp_path / "roof.glb").write_bytes(surface_files.glb(tree))
    refused("has 5000 nodes, and at most 500 are read", rs.surface_from, tmp_path / "roof.glb")


@pytest.mark.parametrize(
    "text", [b"[" * 100_000, b'{"buffers": %s}' % (b"9" * 100_000), b'{"buffers": 7}', b"[]", b"7"]
)
def test_gltf_of_any_other_json_is_refused(text: bytes, tmp_path: Path) -> None:
    (tmp_path / "roof.gltf").write_bytes(text)
    refused("cannot be read as GLTF", rs.surface_from, tmp_path / "roof.gltf")


# other meshes


@pytest.mark.parametrize(
    ("kind", "line"),
    [("obj", b"mtllib /etc/hostname\nmtllib ../secret.mtl\nusemtl a"), ("ply", b"comment TextureFile /etc/hostname")],
)
def test_materials_and_textures_are_not_opened(
    kind: str, line: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = WRITERS[kind](*dome())
    path = tmp_path / f"roof.{kind}"
    path.write_bytes(text.replace(b"element", line + b"\nelement", 1) if kind == "ply" else line + b"\n" + text)
    import trimesh  # noqa: F401  (it opens files of its own)

    opened = list[str]()
    monkeypatch.setattr(
        "builtins.open", lambda file, *_, **__: opened.append(str(file)) or (_ for _ in ()).throw(OSError)
    )
    read_mesh(path)
    assert not opened


@pytest.mark.parametrize("kind", ["obj", "off", "ply", "glb"])
@pytest.mark.parametrize("index", [343, -1])
def test_a_wrong_index_of_a_face_is_one_sentence(kind: str, index: int, tmp_path: Path) -> None:
    x, faces = dome()
    faces[7, 1] = index
    path = tmp_path / f"roof.{kind}"
    if kind == "obj" and index < 0:
        path.write_bytes(WRITERS["obj"](*dome()).replace(b"f 1 25 26", b"f 1 0 26"))
    elif kind == "glb":
        data = bytearray(surface_files.glb())
        struct.pack_into("<i", data, data.index(b"BIN\0") + 4 + 20, index)
        path.write_bytes(data)
    else:
        path.write_bytes(WRITERS[kind](x, faces))
    refused("is damaged: a face refers to vertex|cannot be read as O", rs.surface_from, path, unit=1.0)


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("vertices.ply", b"ply\nformat binary_little_endian 1.0\nelement vertex 1000000000000\nproperty float x\n"
         b"property float y\nproperty float z\nend_header\n" + bytes(1000), "it has 83 of 1000000000000 entries"),
        ("list.ply", b"ply\nformat binary_little_endian 1.0\nelement face 9\nproperty list uint int vertex_indices\n"
         b"end_header\n" + b"\x7f" * 400, "it has 0 of 9 entries for face"),
        ("header.ply", b"ply\nformat binary_little_endian 1.0\nelement vertex 1\n"
         + b"property list uchar int a\n" * 3000 + b"end_header\n" + bytes(9000),
         "has 3000 properties, and at most 500 are read"),
        ("count.off", b"OFF\n1000000000000 1000000000000 0\n0 0 0\n", "seems to be truncated"),
        ("count.stl", bytes(80) + b"\xff" * 4 + bytes(500), "cannot be read as STL|has no faces"),
        ("solids.stl", b"solid a\nendsolid a\n" * 3000, "has 3000 solids, and at most 500 are read"),
    ],
)  # fmt: skip
def test_counts_that_a_file_does_not_hold_are_refused(name: str, data: bytes, said: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(data)
    refused(said, rs.surface_from, tmp_path / name, unit=1.0)


def test_materials_do_not_split_a_mesh(tmp_path: Path) -> None:
    """Each was searched through all vertices: 50,000 of them took minutes."""
    x, faces = dome(200)
    lines = WRITERS["obj"](x, faces).decode().splitlines()
    text = "\n".join(f"usemtl m{k}\n{line}" if line[0] == "f" else line for k, line in enumerate(lines))
    (tmp_path / "roof.obj").write_text(text)
    started = time.process_time()
    assert len(read_mesh(tmp_path / "roof.obj")[1]) == len(faces)
    assert time.process_time() - started < 2


def test_memory_for_a_polygon_grows_with_its_corners(tmp_path: Path) -> None:
    """A fan of 20,000 slivers was sampled at 1,225 points each."""
    angle = np.linspace(0, 2 * np.pi, 20_000, endpoint=False)
    x = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    k = np.arange(1, len(x) - 1)
    mesh, *_ = sound_mesh(x, np.column_stack([0 * k, k, k + 1]), "fan")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    samples = mesh_samples(mesh, cubic_spacing(float(mesh.areas.sum()), len(x)))
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 600_000
    assert samples.areas.sum() == pytest.approx(np.pi, rel=0.01)


def test_sheet_with_thousands_of_openings_is_refused(tmp_path: Path) -> None:
    n = 60
    corner = np.arange(n * n).reshape(n, n)
    quads = np.stack([corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]], axis=-1)
    keep = np.ones((n - 1, n - 1), dtype=bool)
    keep[1:-1:3, 1:-1:3] = False
    x, y = np.meshgrid(np.linspace(-5, 5, n), np.linspace(-5, 5, n), indexing="ij")
    faces = np.vstack([quads[keep][:, :3], quads[keep][:, [0, 2, 3]]])
    vertices = np.column_stack([x.ravel(), y.ravel(), 2 - 0.02 * (x**2 + y**2).ravel()])
    refused("ends at 362 closed curves, and at most 200", rs.Freeform.of, vertices, faces)


@pytest.mark.parametrize("name", ["off", "ply"])
def test_surface_far_away_is_refused(name: str, tmp_path: Path) -> None:
    x, faces = dome()
    (tmp_path / f"roof.{name}").write_bytes(WRITERS[name](x + [1e12, 0, 0], faces))
    refused(
        "has no extent|coordinates up to 1e\\+12 m|truncated|wide",
        rs.surface_from,
        tmp_path / f"roof.{name}",
        unit=1.0,
    )


# drawings


def drawn(path: Path, *, version: str = "R2000", **curves: Any) -> Path:
    drawing = ezdxf.new(version)
    for kind, arguments in curves.items():
        getattr(drawing.modelspace(), kind)(**arguments)
    drawing.saveas(path)
    return path


@pytest.mark.parametrize(
    "curve",
    [{"add_circle": {"center": (1e300, 0), "radius": 1.0}}, {"add_circle": {"center": (0, 0), "radius": 1e300}},
     {"add_circle": {"center": (0, 0), "radius": float("nan")}},
     {"add_arc": {"center": (0, 0), "radius": 1.0, "start_angle": 0.0, "end_angle": float("nan")}},
     {"add_lwpolyline": {"points": [(0, 0, 0, 0, 1e300), (1, 0, 0, 0, float("nan")), (1, 1, 0, 0, 0)], "close": True}}],
    ids=["far", "large", "nan", "angle", "bulge"],
)  # fmt: skip
def test_drawing_with_an_absurd_curve_is_refused(curve: dict[str, Any], tmp_path: Path) -> None:
    """The first three crash ezdxf, or never end."""
    said = r"has curves with coordinates up to|cannot be read as a drawing of curves|has no closed curve"
    refused(said, read_curves, drawn(tmp_path / "edge.dxf", **curve), 1.0)


def test_drawing_of_too_many_curves_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rodshell.targets.curve_files.MOST_STROKES", 2)
    drawing = ezdxf.new()
    for k in range(3):
        drawing.modelspace().add_circle((3 * k, 0), 1)
    drawing.saveas(tmp_path / "edge.dxf")
    refused("has 3 curves, and at most 2 are read: .* RODSHELL_LIMITS=2", read_curves, tmp_path / "edge.dxf", 1.0)
    (tmp_path / "edge.obj").write_text("v 0 0 0\nv 1 0 0\n" + "l 1 2\n" * 3)
    refused("has 3 curves, and at most 2 are read", read_curves, tmp_path / "edge.obj", 1.0)


@pytest.mark.parametrize(
    "text", [*(f"v 0 0{z}\nv 1 0 0\nl 1 2\n" for z in (" nan", " 1e300", "")), "v 0 0 0\nv 1 0 0\nl 0 1\n"]
)
def test_curve_of_an_obj_without_coordinates_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "edge.obj").write_text(text)
    refused("coordinates up to|cannot be read as a drawing", read_curves, tmp_path / "edge.obj", 1.0)


# NURBS


def plane(**changed: Any) -> Nurbs:
    knots = np.array([0.0, 0, 0, 1, 1, 1])
    controls = np.dstack([*np.meshgrid([0.0, 1, 2], [0.0, 1, 2], indexing="ij"), np.zeros((3, 3)), np.ones((3, 3))])
    return Nurbs(**{"degrees": (2, 2), "knots": (knots, knots), "controls": controls} | changed)


@pytest.mark.parametrize(
    ("changed", "said"),
    [({"degrees": (0, 2)}, "degree is 0"), ({"degrees": (1000, 2)}, "degree is 1000"),
     ({"knots": (np.zeros(6), np.zeros(6))}, "knots do not ascend"),
     ({"knots": (np.arange(6.0), np.arange(6.0)[::-1])}, "knots do not ascend"),
     ({"knots": (np.full(6, np.nan), np.arange(6.0))}, "knots do not ascend"),
     ({"knots": (np.arange(3.0), np.arange(6.0))}, "3 knots for 3 control points"),
     ({"controls": plane().controls * [1, 1, 1, 0]}, "no positive weight"),
     ({"controls": plane().controls * [1, 1, 1, -1]}, "no positive weight"),
     ({"controls": plane().controls * 1e300}, "beyond 1e[+]15"),
     ({"controls": plane().controls * np.nan}, "not finite")],
)  # fmt: skip
def test_nurbs_that_is_none_says_why(changed: dict[str, Any], said: str) -> None:
    assert not plane().fault
    with pytest.raises(AssertionError, match=said):
        assert not plane(**changed).fault, plane(**changed).fault


def test_3dm_with_knots_that_are_all_zero_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("rhino3dm", reason="no rhino3dm: pip install rhino3dm")

    def zeros(surface: Any) -> None:
        for k in range(len(surface.KnotsU)):
            surface.KnotsU[k] = 0.0

    (tmp_path / "roof.3dm").write_bytes(surface_files.rhino(tmp_path, zeros))
    refused("is damaged: its knots do not ascend|cannot be read as 3DM", rs.surface_from, tmp_path / "roof.3dm")


def test_reader_apart_has_bounded_memory_and_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(apart, "LONGEST", 1.0)
    (tmp_path / "bomb.py").write_text("def main(request): return {'x': bytearray(4 * 10**9)[:1]}")
    refused("cannot be read as X: it is damaged", apart.read_apart, tmp_path / "bomb.py", tmp_path / "a.x", b"", "X")
    (tmp_path / "sleep.py").write_text("import time\ndef main(request): time.sleep(60)")
    said = r"cannot be read within 1 s: .* RODSHELL_LIMITS=2"
    refused(said, apart.read_apart, tmp_path / "sleep.py", tmp_path / "a.x", b"", "X")


# tables and images


@pytest.mark.parametrize(
    ("text", "said"),
    [("1,2,3,4\n" + "," * 3_000_000 + "\n1,2,3,4\n1,2,3,4\n", "rows have 4 to 5 heights"),
     ("," * 3_000_000, "scale it down"), ("1e200,2,3,4\n" * 5, "m wide|no extent|not finite"),
     ("1,2,3\n", "1 with 1 different x and 1 different y, which is not a complete lattice"),
     ("1,2,3,1e50\n" * 5, r"is 1e\+50 m wide in this unit .* give another size or height")],
    ids=["row", "first row", "far", "point", "high"],
)  # fmt: skip
def test_table_of_absurd_heights_is_refused(text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "roof.csv").write_text(text)
    refused(said, rs.heights_from, tmp_path / "roof.csv", size=(4.0, 4.0))


def test_image_of_another_format_is_not_opened(tmp_path: Path) -> None:
    """Pillow gives EPS to Ghostscript, whatever the file is called; a GIF here."""
    Image.linear_gradient("L").save(tmp_path / "roof.png", "GIF")
    refused("cannot be read as an image", rs.heights_from, tmp_path / "roof.png", size=(4.0, 4.0))


@pytest.mark.parametrize(
    ("line", "said"),
    [("x" * 200_000, "not a row of a CSV table: field larger than"),
     ("a" + ",b" * 500_000, "the column flat_x0 is missing"),
     ("0,0,1,0,0,0,0,1,0,0\n" * 10_001, "has 10002 lines, and at most 10000")],
    ids=["cell", "header", "rods"],
)  # fmt: skip
def test_table_of_rods_that_is_none_is_refused(line: str, said: str, tmp_path: Path) -> None:
    head = "flat_x0,flat_y0,flat_x1,flat_y1,final_x0,final_y0,final_z0,final_x1,final_y1,final_z1\n"
    (tmp_path / "rods.csv").write_text(line if line[0] == "a" else head + line)
    refused(said, read_table, tmp_path / "rods.csv", "m")


# devices, pipes and sizes, whatever is read

READERS: dict[str, Callable[[Path], object]] = {
    **{f"roof{suffix}": lambda path: rs.surface_from(path, unit=1.0)
       for suffix in (".obj", ".off", ".ply", ".stl", ".glb", ".gltf", ".3dm")},
    "roof.step": rs.surface_from, "edge.dxf": lambda path: read_curves(path, 1.0),
    "edge.obj": lambda path: read_curves(path, 1.0), "rods.csv": lambda path: read_table(path, "m"),
    "roof.csv": lambda path: rs.heights_from(path, size=(4.0, 4.0)),
    "roof.png": lambda path: rs.heights_from(path, size=(4.0, 4.0)),
}  # fmt: skip


@pytest.mark.parametrize("name", READERS)
def test_devices_large_files_and_dumb_pipes_are_refused(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(untrusted, "PATIENCE", 0.05)
    path = tmp_path / name
    with path.open("wb") as file:
        file.truncate(2 * 10**12)
    refused("has 2e\\+06 MB or more; at most", READERS[name], path)
    path.unlink()
    path.symlink_to("/dev/zero")
    refused("is a device, not a file", READERS[name], path)
    path.unlink()
    if sys.platform != "win32":
        os.mkfifo(path)
        refused("is empty|is a pipe that was not written|has no rods|have 0 to 0|is missing", READERS[name], path)


@pytest.mark.skipif(sys.platform == "win32", reason="needs named pipes")
def test_mesh_is_read_from_a_pipe(tmp_path: Path) -> None:
    pipe = tmp_path / "roof.obj"
    os.mkfifo(pipe)
    writer = threading.Thread(target=pipe.write_bytes, args=(WRITERS["obj"](*dome()),))
    writer.start()
    assert rs.surface_from(pipe, unit=1.0).size == pytest.approx(5.0, rel=1e-3)
    writer.join()


@pytest.mark.parametrize("name", ["\ud800.obj", "a\0b.obj", "~nobody-of-this-name/a.obj", "x" * 5000 + ".obj"])
def test_name_that_no_file_can_have_is_refused(name: str) -> None:
    refused("file = ", rs.surface_from, name, unit=1.0)


def test_what_is_said_of_an_object_with_a_name_that_is_no_text_can_be_printed(tmp_path: Path) -> None:
    tree, _ = surface_files.gltf_tree(None)
    tree["meshes"][0]["name"] = "\ud800"  # type: ignore[index]
    (tmp_path / "roof.glb").write_bytes(surface_files.glb(tree))
    with pytest.raises(rs.InputError, match=r"has no object named|cannot be read as GLB") as caught:
        rs.surface_from(tmp_path / "roof.glb", name="door")
    assert str(caught.value).encode()


# meshes mutated byte by byte

WORDS = (
    b"nan", b"-1", b"0", b"99999999999", b"1e400", b"\n", b" ", b"f ", b"o \n", b"\\\n", b"/", b"\0", b"2147483647",
    b"element face 1000000000\n", b"property list uchar int vertex_indices\n", b"end_header\n",
)  # fmt: skip


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("kind", MIXED)
def test_mutated_mesh_of_polygons_is_read_or_refused(kind: str, tmp_path: Path) -> None:
    chance, whole, path = random.Random(kind), MIXED[kind](*mixed()), tmp_path / f"dome.{kind}"
    for _ in range(TRIES):
        data = bytearray(whole)
        for _ in range(chance.choice((1, 1, 2, 20))):
            at = chance.randrange(len(data) if chance.random() < 0.5 else 400)
            data[at : at + chance.choice((0, 1, 4, 30))] = chance.choice((bytes([chance.randrange(256)]), *WORDS))
        path.write_bytes(data)
        with suppress(rs.InputError):
            vertices, faces, *_ = read_mesh(path)
            sound_mesh(vertices, faces, "it")
