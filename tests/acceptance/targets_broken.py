"""Two hundred files that are no targets, each given to the command line in a process of its own."""

import multiprocessing
import resource
import time
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.targets.stepfile import StepFile

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

SECONDS, GIGABYTES = 10.0, 2.0


@dataclass(frozen=True)
class Broken:
    """What was wrong with a file, how the command line was called, and what came of it."""

    what: str
    code: int
    said: str
    seconds: float
    gigabytes: float

    @property
    def wrong(self) -> str:
        """What is not as it must be; empty if all is."""
        lines = self.said.strip().splitlines()
        if self.code != 2:
            return f"exit code {self.code}"
        if len(lines) != 1 or not 20 < len(lines[0]) < 500 or "Traceback" in self.said:
            return f"{len(lines)} lines"
        if self.seconds > SECONDS:
            return f"{self.seconds:.1f} s"
        if self.gigabytes > GIGABYTES:
            return f"{self.gigabytes:.1f} GB"
        return ""


def dome(rows: int = 14) -> tuple[Floats, Ints]:
    """A cap of radius 5, some 4 high, in triangles; sound."""
    radius = np.repeat(np.linspace(0, 1, rows), 24)
    angle = np.tile(np.arange(24) * 2 * np.pi / 24, rows)
    x = np.column_stack([5 * radius * np.cos(angle), 5 * radius * np.sin(angle), 4 * (1 - radius**2)])
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(24), indexing="ij")
    a, b = (i * 24 + j).ravel(), (i * 24 + (j + 1) % 24).ravel()
    return x, np.vstack([np.column_stack([a, a + 24, b + 24]), np.column_stack([a, b + 24, b])])


def as_obj(x: Floats, faces: Ints) -> bytes:
    lines = [f"v {p[0]:.9g} {p[1]:.9g} {p[2]:.9g}" for p in x.tolist()]
    return "\n".join([*lines, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces.tolist()), ""]).encode()


def as_off(x: Floats, faces: Ints) -> bytes:
    lines = [f"{p[0]:.9g} {p[1]:.9g} {p[2]:.9g}" for p in x.tolist()]
    return "\n".join(
        ["OFF", f"{len(x)} {len(faces)} 0", *lines, *(f"3 {a} {b} {c}" for a, b, c in faces.tolist()), ""]
    ).encode()


def as_ply(x: Floats, faces: Ints) -> bytes:
    head = f"ply\nformat ascii 1.0\nelement vertex {len(x)}\nproperty float x\nproperty float y\nproperty float z\n"
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    return head.encode() + as_off(x, faces).split(b"\n", 2)[2]


def as_stl(x: Floats, faces: Ints) -> bytes:
    records = np.zeros(len(faces), dtype=[("n", "<f4", 3), ("p", "<f4", (3, 3)), ("a", "<u2")])
    with np.errstate(over="ignore"):
        records["p"] = x[faces]
    return bytes(80) + np.uint32(len(faces)).tobytes() + records.tobytes()


WRITERS: dict[str, Callable[[Floats, Ints], bytes]] = {"obj": as_obj, "off": as_off, "ply": as_ply, "stl": as_stl}


def broken_files(folder: Path) -> Iterator[tuple[str, list[str]]]:
    """What is wrong, and the arguments of `rodshell form`."""
    rng = np.random.default_rng(7)
    x, faces = dome()

    def case(what: str, name: str, data: bytes, *options: str) -> tuple[str, list[str]]:
        path = folder / name
        path.write_bytes(data)
        return what, [str(path), *(options or ("--unit", "m"))]

    for kind, write in WRITERS.items():
        whole = write(x, faces)
        for k, share in enumerate((0.0, 0.02, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95)):
            yield case(f"cut short at {share:.0%}", f"cut{k}.{kind}", whole[: int(share * len(whole))])
        for k, length in enumerate((1, 77, 3000, 30_000, 3_000_000)):
            yield case("binary garbage", f"noise{k}.{kind}", rng.bytes(length))
        yield case("text that is no mesh", f"text.{kind}", b"The roof is to be as light as a leaf.\n" * 50)
        yield case("zeros", f"zeros.{kind}", bytes(10_000))
        for k, bad in enumerate((np.nan, np.inf, -np.inf, 1e300)):
            y = x.copy()
            y[rng.integers(48, len(x)), k % 3] = bad
            yield case(f"a vertex with {bad}", f"number{k}.{kind}", write(y, faces))
        yield case("no faces", f"points.{kind}", write(x, faces[:0]))
        yield case("one triangle of no area", f"sliver.{kind}", write(x, np.array([[3, 3, 4]])))
        yield case("flat as a line", f"line.{kind}", write(x * [1, 0, 0], faces))
        yield case("a single point", f"point.{kind}", write(x * 0, faces))
        two = np.vstack([x, x + [20, 0, 0]])
        yield case("two solids", f"two.{kind}", write(two, np.vstack([faces, faces + len(x)])))
        yield case(
            "two solids, one in the other",
            f"inner.{kind}",
            write(np.vstack([x, 0.5 * x]), np.vstack([faces, faces + len(x)])),
        )
        fin = np.vstack([x, [[0, 0, 9]]]), np.vstack([faces, [[100, 124, len(x)]]])
        yield case("a fin on an edge", f"fin.{kind}", write(*fin))
        touching = np.vstack([x, [[0, 9, 0], [4, 9, 0]]]), np.vstack([faces, [[len(x) - 18, len(x), len(x) + 1]]])
        yield case("two parts that touch in a point", f"touching.{kind}", write(*touching))
        yield case("wrong unit: too large", f"large.{kind}", write(1e4 * x, faces))
        yield case("wrong unit: too small", f"small.{kind}", write(x, faces), "--unit", "um")
        yield case("no unit", f"unitless.{kind}", write(x, faces), "--spacing", "500mm")
        yield case("no such unit", f"unit.{kind}", write(x, faces), "--unit", "furlong")
        yield case("crossing itself", f"crossing.{kind}", write(*_crossing()))
        yield case("folded over itself", f"folded.{kind}", write(*_folded()))
        yield case("one-sided", f"moebius.{kind}", write(*_moebius()))
        yield case("creased", f"creased.{kind}", write(*_creased()))
        yield case("rough", f"rough.{kind}", write(x + rng.normal(0, 0.25, x.shape), faces))
        yield case("closed without a base", f"closed.{kind}", write(*_ball()))
        yield case("a base above it", f"base.{kind}", write(*_ball()), "--unit", "m", "--base", "7 m")
        yield case("a spacing larger than it", f"coarse.{kind}", write(x, faces), "--unit", "m", "--spacing", "30 m")
        yield case("an anchor beside it", f"anchor.{kind}", write(x, faces), "--unit", "m", "--anchor", "9 m, 0 m")
        yield case(
            "a boundary that is not there", f"edge.{kind}", write(x, faces), "--unit", "m", "--boundary", "none.dxf"
        )
    index = as_obj(x, faces).replace(b"f 1 25 26", b"f 1 2500 26")
    yield case("a face with no such vertex", "index.obj", index)
    yield case("words for numbers", "words.obj", as_obj(x, faces).replace(b"v 0 0 4", b"v zero 0 4"))
    yield case("a count that is absurd", "count.stl", bytes(80) + np.uint32(4_000_000_000).tobytes() + bytes(5000))
    yield case("a count that is absurd", "count.ply", as_ply(x, faces).replace(b"vertex 336", b"vertex 99999999999"))
    yield case("a count that is absurd", "count.off", as_off(x, faces).replace(b"336 624", b"99999999999 624"))
    yield case("no glTF", "noise.glb", rng.bytes(5000))
    yield case("glTF with nothing in it", "empty.gltf", b'{"asset": {"version": "2.0"}}')
    yield case("no 3dm", "noise.3dm", rng.bytes(5000))
    yield case("empty", "empty.3dm", b"")
    yield case("no numbers", "words.csv", b"a,b,c\nd,e,f\n", "--target.size", "4 m, 4 m")
    yield case("uneven rows", "uneven.csv", b"1,2,3,4\n1,2,3\n1,2,3,4\n1,2,3,4\n", "--target.size", "4 m, 4 m")
    yield case("too few heights", "few.csv", b"1,2\n3,4\n", "--target.size", "4 m, 4 m")
    yield case("no heights", "none.csv", b",,,\n,,,\n,,,\n,,,\n", "--target.size", "4 m, 4 m")
    yield case("no size", "size.csv", b"1,2,3,4\n" * 4, "--spacing", "500mm")
    yield case("no image", "noise.png", rng.bytes(2000), "--target.size", "4 m, 4 m", "--target.height", "1 m")
    for what, name, text, *options in _step_files():
        yield case(what, f"{name}.step", text, *(options or ("--spacing", "500mm")))
    huge = folder / "huge.obj"
    with huge.open("wb") as file:
        file.truncate(400_000_000)
    yield "a huge file", [str(huge), "--unit", "m"]
    yield case("a case without its file", "bare.toml", b'[target]\nkind = "mesh"\n', "--spacing", "1 m")
    yield case("a case with a scale of 0", "scale.toml", b'[target]\nkind = "mesh"\nfile = "x.obj"\nscale = 0\n')
    yield "no such file", [str(folder / "nowhere.obj"), "--unit", "m"]
    yield "a folder", [str(folder), "--unit", "m"]


def _step_files() -> Iterator[tuple[Any, ...]]:
    """What is wrong, a name, the file, and options."""
    x = np.stack([*np.meshgrid([-5.0, 0.0, 5.0], [-5.0, 0.0, 5.0], indexing="ij"), np.zeros((3, 3))], axis=2)
    x[1, 1, 2] = 4.0
    roof, many, line, dot, far = (StepFile("m") for _ in range(5))
    roof.patch(x, 2, [0.0, 1.0], "roof")
    for k in range(20):
        many.cap(4.0 + k, 1.0, f"cap {k}")
    line.patch(x * [1, 0, 0], 2, [0.0, 1.0])
    dot.patch(0 * x, 2, [0.0, 1.0])
    far.patch(1e4 * x, 2, [0.0, 1.0])
    whole, rng = roof.text(), np.random.default_rng(3)
    end = b"ENDSEC;\nEND-ISO-10303-21;\n"
    for k, share in enumerate((0.0, 0.1, 0.3, 0.5, 0.8, 0.99)):
        yield f"cut short at {share:.0%}", f"cut{k}", whole[: int(share * len(whole))]
    for k, share in enumerate((0.2, 0.4, 0.6, 0.8)):
        yield f"cut short at {share:.0%}, and ended", f"ended{k}", whole[: int(share * len(whole))] + b"\n" + end
    yield "binary garbage", "noise", rng.bytes(30_000)
    yield "binary garbage, ended", "noise_ended", rng.bytes(30_000) + end
    yield "a unit that it has already", "unit", whole, "--unit", "mm"
    yield "no such face", "face", whole, "--target.object", "wall"
    yield "twenty faces", "many", many.text()
    yield "flat as a line", "line", line.text()
    yield "a single point", "dot", dot.text()
    yield "absurdly large", "far", far.text()
    yield "no face", "bare", StepFile().text()
    yield "a face on nothing", "nothing", whole.replace(b"B_SPLINE_SURFACE_WITH_KNOTS", b"NO_SURFACE")
    yield "a knot that is none", "knot", whole.replace(b"(3,3),(3,3),(0.0", b"(3,9),(3,3),(0.0")
    yield "numbers that are none", "number", whole.replace(b"E+00", b"E+999")
    yield "points that are words", "words", whole.replace(b"5.000000000000E+00", b"five")
    for k in range(6):
        spoilt = bytearray(whole)
        for place in rng.integers(400, len(whole) - 40, 200).tolist():
            spoilt[place] = int(rng.integers(32, 126))
        yield "spoilt in 200 places", f"spoilt{k}", bytes(spoilt)


def _crossing() -> tuple[Floats, Ints]:
    """A sheet whose two halves pass through each other."""
    s, y = np.meshgrid(np.linspace(-3.3, 3.3, 60), np.linspace(-2, 2, 30), indexing="ij")
    return _sheet(np.sin(2 * s) * 3, 2 * y, np.sin(s) * 6)


def _folded() -> tuple[Floats, Ints]:
    """A sheet that turns round smoothly and lies on itself, a hair apart."""
    turn, far = np.linspace(0, np.pi, 12), np.linspace(4, 0.1, 40)
    x = np.concatenate([far, -0.03 * np.sin(turn), far[::-1]])
    z = np.concatenate([0 * far - 0.03, -0.03 * np.cos(turn), 0 * far + 0.03])
    y = np.linspace(-4, 4, 60)
    return _sheet(x[:, None] + 0 * y, y + 0 * x[:, None], z[:, None] + 0 * y)


def _moebius() -> tuple[Floats, Ints]:
    t, w = np.meshgrid(np.linspace(0, 2 * np.pi, 81), np.linspace(-1, 1, 9), indexing="ij")
    r = 4 + w * np.cos(t / 2)
    return _sheet(r * np.cos(t), r * np.sin(t), w * np.sin(t / 2))


def _creased() -> tuple[Floats, Ints]:
    """A fold that runs out in the middle of a roof."""
    x, y = np.meshgrid(np.linspace(-4, 4, 60), np.linspace(-4, 4, 60), indexing="ij")
    return _sheet(x, y, 1.5 - np.abs(x) * np.maximum(y, 0) / 2)


def _ball() -> tuple[Floats, Ints]:
    t, p = np.meshgrid(np.linspace(0, np.pi, 24), np.linspace(0, 2 * np.pi, 48), indexing="ij")
    return _sheet(5 * np.sin(t) * np.cos(p), 5 * np.sin(t) * np.sin(p), 5 * np.cos(t))


def _sheet(x: Floats, y: Floats, z: Floats) -> tuple[Floats, Ints]:
    rows, columns = x.shape
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    a, b, c, d = corner, corner + columns, corner + columns + 1, corner + 1
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    return points, np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def called(what: str, arguments: list[str], out: Path) -> Broken:
    """Call `rodshell form` in a forked process."""
    context = multiprocessing.get_context("fork")
    answer = context.Queue()
    started = time.perf_counter()
    process = context.Process(target=_call, args=(arguments, out, answer))
    process.start()
    try:
        code, said, gigabytes = answer.get(timeout=2 * SECONDS)
    except Exception:
        code, said, gigabytes = -1, "no answer", 0.0
        process.kill()
    process.join()
    return Broken(what, code, said, time.perf_counter() - started, gigabytes)


def _call(arguments: list[str], out: Path, answer: "multiprocessing.Queue[tuple[int, str, float]]") -> None:
    import traceback

    from rodshell.cli import main

    said, printed = StringIO(), StringIO()
    with redirect_stderr(said), redirect_stdout(printed):
        try:
            code = main(["form", *arguments, "--out", str(out), "--quiet"])
        except BaseException:
            code = -2
            traceback.print_exc()
    answer.put((code, said.getvalue(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6))
