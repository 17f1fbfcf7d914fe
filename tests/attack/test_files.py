"""Files of every format with random damage: a surface of a plausible size, or one sentence."""

import faulthandler
import json
import os
import resource
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import rodshell as rs
from rodshell.case.rod_ends import read_table
from rodshell.targets.curve_files import read_curves, read_lines
from tests.attack import surface_files
from tests.attack.surface_files import MESHES, damaged

pytestmark = pytest.mark.attack
TIMES = int(os.environ.get("RODSHELL_ATTACK", "1"))
SECONDS, BYTES = 60.0, 3e9
SEED = 3  # of whose first damaged 3dm files none keeps OpenNURBS busy for long


@pytest.fixture(autouse=True)
def bounds() -> Iterator[None]:
    """A file that asks for 3 GB more, or for ever, ends the test."""
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    pages = int(Path("/proc/self/statm").read_text().split()[0]) if sys.platform == "linux" else 0
    if pages:
        resource.setrlimit(resource.RLIMIT_AS, (int(pages * resource.getpagesize() + BYTES), hard))
    faulthandler.dump_traceback_later(120.0 * TIMES + SECONDS, exit=True)
    yield
    faulthandler.cancel_dump_traceback_later()
    resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def attack(whole: bytes, tries: int, read: Callable[[bytes], None], *, part: slice = slice(None)) -> None:
    """Damage a `part` of a file `tries` times: `read` takes it, or says one sentence."""
    if tries > 1:
        read(whole)
    rng = np.random.default_rng(SEED)
    first, stop, _ = part.indices(len(whole))
    before, after = whole[:first], whole[stop:]
    for k in range(tries * TIMES):
        data = before + damaged(whole[part], rng) + after
        started = time.process_time()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", RuntimeWarning)  # numbers that overflow on their way
                read(data)
        except rs.RodshellError as reason:
            said = str(reason)
            assert 20 < len(said) < 700, said
            assert "\n" not in said
        except Exception as reason:
            raise AssertionError(f"try {k} of {len(whole)} bytes: {reason!r}\n{data[:2000]!r}") from reason
        assert time.process_time() - started < SECONDS, k


def require_plausible(target: rs.Freeform) -> None:
    x = target.surface.vertices
    assert np.isfinite(x).all()
    assert 1e-3 <= np.ptp(x, axis=0).max() <= 1e3
    assert 0 < target.size <= 1e3


def reads(path: Path, **arguments: object) -> Callable[[bytes], None]:
    """How a surface is read from these bytes."""

    def read(data: bytes) -> None:
        path.write_bytes(data)
        make = rs.heights_from if "size" in arguments else rs.surface_from
        require_plausible(make(path, **arguments))  # type: ignore[arg-type]

    return read


@pytest.mark.parametrize("kind", MESHES)
def test_damaged_mesh_is_a_surface_or_one_sentence(kind: str, tmp_path: Path) -> None:
    attack(MESHES[kind](), 12, reads(tmp_path / f"roof.{kind}", unit=None if kind == "glb" else 1.0))


def test_damaged_gltf_or_buffer_is_a_surface_or_one_sentence(tmp_path: Path) -> None:
    tree, buffer = surface_files.gltf_tree("roof.bin")
    text = json.dumps(tree).encode()
    (tmp_path / "model.gltf").write_bytes(text)  # of which nothing may be read
    (tmp_path / "roof.bin").write_bytes(buffer)
    attack(text, 12, reads(tmp_path / "roof.gltf"))

    def read(data: bytes) -> None:
        (tmp_path / "roof.bin").write_bytes(data)
        reads(tmp_path / "roof.gltf")(text)

    attack(buffer, 6, read)


def test_damaged_3dm_is_a_surface_or_one_sentence(tmp_path: Path) -> None:
    pytest.importorskip("rhino3dm", reason="no rhino3dm: pip install rhino3dm")
    attack(surface_files.rhino(tmp_path), 3, reads(tmp_path / "roof.3dm"))


def test_damaged_step_is_a_surface_or_one_sentence(tmp_path: Path) -> None:
    pytest.importorskip("OCP", reason="no OpenCASCADE: pip install cadquery-ocp-novtk")
    whole = surface_files.step()
    attack(whole, 1, reads(tmp_path / "roof.step"), part=slice(whole.index(b"DATA;"), len(whole) - 40))


@pytest.mark.parametrize("kind", ["csv", "png"])
def test_damaged_heights_are_a_surface_or_one_sentence(kind: str, tmp_path: Path) -> None:
    whole = surface_files.heights() if kind == "csv" else surface_files.png()
    attack(whole, 12, reads(tmp_path / f"roof.{kind}", size=(12.0, 8.0)))


@pytest.mark.parametrize("kind", ["dxf", "obj"])
def test_damaged_drawing_is_finite_curves_or_one_sentence(kind: str, tmp_path: Path) -> None:
    path = tmp_path / f"edge.{kind}"

    def read(data: bytes) -> None:
        path.write_bytes(data)
        for curve in (*read_curves(path, 1.0), *read_lines(path, 1.0)):
            assert np.isfinite(curve).all()
            assert np.abs(curve).max() <= 1e9

    drawing = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 2 0\nl 1 2 3 4 1\nl 4 5\n"
    whole, tries = (surface_files.dxf(), 3) if kind == "dxf" else (drawing, 100)
    attack(whole, tries, read, part=surface_files.dxf_curves(whole) if kind == "dxf" else slice(None))


def test_damaged_table_of_rods_is_rods_or_one_sentence(tmp_path: Path) -> None:
    def read(data: bytes) -> None:
        path = tmp_path / "rods.csv"
        path.write_bytes(data)
        rods = read_table(path, "m")
        assert np.isfinite(rods.final).all()
        assert 0 < rods.lengths.min() <= rods.lengths.max() <= 2e3

    attack(surface_files.rods(), 150, read)
