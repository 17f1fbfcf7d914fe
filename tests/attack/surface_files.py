"""Small sound files of every format that is read, and what random damage makes of them."""

import io
import json
import re
from collections.abc import Callable
from pathlib import Path

import ezdxf
import numpy as np
from PIL import Image

from tests.acceptance.targets_broken import WRITERS, dome
from tests.targets.stepfile import StepFile

EXTREMES = ("1e300", "-1e300", "nan", "inf", "-1", "0", "4294967295", "1e-300", "99999999999999999999", "")
NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")
WORDS = tuple(
    np.array([value], dtype=kind).tobytes()
    for kind, values in (
        ("<f4", (np.nan, np.inf, -1.0, 3e38)),
        ("<f8", (np.nan, np.inf, 1e300, -1.0, 0.0)),
        ("<u4", (0, 1, 2**31, 2**32 - 1)),
        ("<u8", (0, 2**63, 2**64 - 1)),
    )
    for value in values
)
OPERATIONS = ("bits", "bytes", "delete", "insert", "cut", "repeat", "number", "word")


def damaged(data: bytes, rng: np.random.Generator) -> bytes:
    """The file with one to three changes of any kind."""
    for _ in range(int(rng.integers(1, 4))):
        data = _changed(data, str(rng.choice(OPERATIONS)), rng)
    return data


def _changed(data: bytes, what: str, rng: np.random.Generator) -> bytes:
    if not data:
        return data
    at = int(rng.integers(len(data)))
    some = int(rng.choice((1, 2, 4, 13, 100, len(data) // 3 + 1)))
    if what == "bits":
        return data[:at] + bytes([data[at] ^ 1 << int(rng.integers(8))]) + data[at + 1 :]
    if what == "bytes":
        return data[:at] + rng.bytes(min(some, len(data) - at)) + data[at + some :]
    if what == "delete":
        return data[:at] + data[at + some :]
    if what == "insert":
        return data[:at] + rng.bytes(some) + data[at:]
    if what == "cut":
        return data[:at]
    if what == "repeat":
        return data[: at + some] + data[at:]
    if what == "word":
        word = WORDS[int(rng.integers(len(WORDS)))]
        at -= at % 4
        return data[:at] + word + data[at + len(word) :]
    numbers = list(NUMBER.finditer(data))
    if not numbers:
        return data
    number = numbers[int(rng.integers(len(numbers)))]
    return data[: number.start()] + str(rng.choice(EXTREMES)).encode() + data[number.end() :]


def stl_text() -> bytes:
    x, faces = dome(5)
    lines = ["solid roof"]
    for corners in x[faces].tolist():
        lines += ["facet normal 0 0 1", "outer loop", *("vertex {:.6g} {:.6g} {:.6g}".format(*p) for p in corners)]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid roof", ""]).encode()


def ply_binary() -> bytes:
    x, faces = dome(5)
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(x)}\nproperty float x\nproperty float y\n"
    head += f"property float z\nelement face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = np.zeros(len(faces), dtype=[("count", "u1"), ("index", "<i4", 3)])
    rows["count"], rows["index"] = 3, faces
    return head.encode() + x.astype("<f4").tobytes() + rows.tobytes()


def gltf_tree(uri: str | None) -> tuple[dict[str, object], bytes]:
    """The JSON of a glTF file, and its buffer."""
    x, faces = dome(5)
    x = x[:, [0, 2, 1]] * [1.0, 1.0, -1.0]  # y points upwards
    index, position = faces.astype("<u4").tobytes(), x.astype("<f4").tobytes()
    buffer: dict[str, object] = {"byteLength": len(index) + len(position)}
    tree = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "name": "roof"}],
        "meshes": [{"name": "roof", "primitives": [{"attributes": {"POSITION": 1}, "indices": 0, "mode": 4}]}],
        "buffers": [buffer if uri is None else {"uri": uri, **buffer}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(index)},
            {"buffer": 0, "byteOffset": len(index), "byteLength": len(position)},
        ],
        "accessors": [
            {"componentType": 5125, "type": "SCALAR", "bufferView": 0, "count": faces.size},
            {"componentType": 5126, "type": "VEC3", "bufferView": 1, "count": len(x)},
        ],
    }  # fmt: skip
    return tree, index + position


def glb(tree: dict[str, object] | None = None) -> bytes:
    given, buffer = gltf_tree(None)
    text = json.dumps(tree or given).encode()
    text += b" " * (-len(text) % 4)
    chunks = [(text, b"JSON"), (buffer, b"BIN\0")]
    body = b"".join(len(data).to_bytes(4, "little") + kind + data for data, kind in chunks)
    return b"glTF" + (2).to_bytes(4, "little") + (12 + len(body)).to_bytes(4, "little") + body


def step() -> bytes:
    file = StepFile("m")
    x = np.stack([*np.meshgrid([-5.0, 0.0, 5.0], [-5.0, 0.0, 5.0], indexing="ij"), np.zeros((3, 3))], axis=2)
    x[1, 1, 2] = 4.0
    file.patch(x, 2, [0.0, 1.0], "roof")
    return file.text()


def rhino(folder: Path, change: Callable[..., None] = lambda surface: None) -> bytes:
    """A 3dm file with a surface of degree 2, 10 m wide."""
    import rhino3dm

    surface = rhino3dm.NurbsSurface.Create(3, False, 3, 3, 4, 4)
    for side in (surface.KnotsU, surface.KnotsV):
        for k in range(len(side)):
            side[k] = float(min(max(k - 1, 0), 2))
    for i in range(4):
        for j in range(4):
            surface.Points[i, j] = rhino3dm.Point4d(3.0 * i - 4.5, 3.0 * j - 4.5, 2.0 * (0 < i < 3) * (0 < j < 3), 1.0)
    change(surface)
    model = rhino3dm.File3dm()
    model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Meters
    model.Objects.AddSurface(surface, rhino3dm.ObjectAttributes())
    model.Write(str(folder / "sound.3dm"), 7)
    return (folder / "sound.3dm").read_bytes()


def dxf() -> bytes:
    """A drawing of one curve of each kind, in the oldest format, which is short, and a spline in a newer one."""
    drawing = ezdxf.new("R2000", setup=False)
    space = drawing.modelspace()
    space.add_circle((0, 0), 4)
    space.add_arc((9, 0), 2, 10, 200)
    space.add_line((11, 1), (12, 5))
    space.add_ellipse((0, 9), (3, 0), 0.5)
    space.add_lwpolyline([(0, 0, 0, 0, 0.5), (1, 0, 0, 0, -1), (1, 1, 0, 0, 0)], close=True)
    space.add_polyline3d([(0, 0, 1), (3, 0, 1), (3, 2, 1)], close=True)
    space.add_rational_spline([(0, 0, 0), (1, 2, 0), (3, 2, 0), (4, 0, 0)], [1, 2, 1, 1])
    text = io.StringIO()
    drawing.write(text)
    return text.getvalue().encode()


def dxf_curves(data: bytes) -> slice:
    """Where the curves are in the text of `dxf`, most of which is tables."""
    return slice(data.index(b"ENTITIES"), data.index(b"OBJECTS"))


def heights() -> bytes:
    x, y = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 7))
    return "\n".join(",".join(f"{z:.4f}" for z in row) for row in 1.5 - 0.3 * x**2 - 0.2 * y**2).encode()


def png() -> bytes:
    x, y = np.meshgrid(np.linspace(-1, 1, 24), np.linspace(-1, 1, 18))
    data = io.BytesIO()
    Image.fromarray(np.rint(65535 * (0.9 - 0.3 * x**2 - 0.2 * y**2)).astype(np.uint16)).save(data, "PNG")
    return data.getvalue()


def rods() -> bytes:
    lines = ["id,flat_x0,flat_y0,flat_x1,flat_y1,final_x0,final_y0,final_z0,final_x1,final_y1,final_z1"]
    lines += [f"u{k},{k},0,{k},4,{k},0,0,{k},3.9,0" for k in range(4)] + [
        f"v{k},0,{k},4,{k},0,{k},0,3.9,{k},0" for k in range(4)
    ]
    return "\n".join(lines).encode()


MESHES: dict[str, Callable[[], bytes]] = {
    "obj": lambda: WRITERS["obj"](*dome(5)), "off": lambda: WRITERS["off"](*dome(5)),
    "ply": lambda: WRITERS["ply"](*dome(5)), "stl": lambda: WRITERS["stl"](*dome(5)),
    "text.stl": stl_text, "binary.ply": ply_binary, "glb": glb,
}  # fmt: skip
