"""Archives of a stranger: bombs, damaged arrays, and archives mutated byte by byte.

Each ends in a result whose figures are finite, or in one sentence; never in another error, a hang, or much memory.
"""

import json
import os
import random
import re
import shutil
import struct
import subprocess
import sys
import warnings
import zipfile
from collections.abc import Callable
from contextlib import suppress
from copy import deepcopy
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rodshell.errors import OutputError, RodshellError
from rodshell.figures.records import FARTHEST, LARGEST, MOST, SHORTEST
from rodshell.output.files import files_of, save
from rodshell.results import read
from rodshell.results.folder import RECORD, open_folder
from tests.output.sample_archive import with_everything

pytestmark = pytest.mark.attack
TRIES = int(os.environ.get("RODSHELL_ATTACK", "1"))
SEED = 20261128
NOT_FINITE = re.compile(rb"(?<![\w.\-])-?(nan|inf|infinity)(?!\w)", re.IGNORECASE)
Edit = Callable[[Any], Any]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small result that has every table and every array."""
    return save(with_everything(), tmp_path_factory.mktemp("results") / "dome", ["csv"])


@pytest.fixture
def dome(made: Path, tmp_path: Path) -> Path:
    return shutil.copytree(made, tmp_path / "dome")


def refusal(folder: Path) -> str:
    """The sentence with which a result is refused."""
    with pytest.raises(OutputError) as error:
        read(folder)
    assert str(error.value).isprintable()
    return str(error.value)


def outcome(folder: Path, kinds: list[str]) -> str:
    """What comes of reading a result and of making files from it: the fault, or nothing."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            archive = read(folder)
            texts = {
                "the summary": archive.summary(verbose=True),
                "its line": repr(archive),
                **dict(files_of(archive, kinds)),
            }
    except RodshellError as error:
        return "" if str(error).isprintable() else f"not one printable sentence: {error!r}"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    for name, text in texts.items():
        found = NOT_FINITE.search(text if isinstance(text, bytes) else text.encode())
        if found and not name.endswith((".html", ".glb")):
            return f"{found[0]!r} in {name}"
    return ""


# states.npz


def npz(*entries: tuple[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    stream = BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a name that is given twice
        with zipfile.ZipFile(stream, "w", method) as stored:
            for name, content in entries:
                stored.writestr(name, content)
    return stream.getvalue()


def npy(shape: str, kind: str, data: bytes = b"") -> bytes:
    """An array's file with any header."""
    head = f"{{'descr': {kind}, 'fortran_order': False, 'shape': {shape}}}\n".encode()
    return b"\x93NUMPY\x02\x00" + struct.pack("<I", len(head)) + head + data


def encrypted(content: bytes) -> bytes:
    """With the flag that says so, in the list and at the entry."""
    content = bytearray(content)
    for mark, at in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        content[content.index(mark) + at] |= 1
    return bytes(content)


def wrong_sum(content: bytes) -> bytes:
    """With another CRC in the list than that of the content."""
    content = bytearray(content)
    content[content.index(b"PK\x01\x02") + 16] ^= 1
    return bytes(content)


def claimed_size(content: bytes, size: int) -> bytes:
    content = bytearray(content)
    at = content.index(b"PK\x01\x02") + 24
    content[at : at + 4] = struct.pack("<I", size)
    return bytes(content)


FLAT = npy("(1, 3)", "'<f8'", bytes(24))
FILES: dict[str, bytes] = {
    "nothing": b"",
    "no zip": b"PK\x05\x06",
    "a pickle": npz(("flat.npy", npy("(1,)", "'|O'", b"cos\nsystem\n(S'true'\ntR."))),
    "a shape without data": npz(("flat.npy", npy("(1000000000000, 3)", "'<f8'"))),
    "a shape without end": npz(("flat.npy", npy("(" + "9" * 400 + ", 3)", "'<f8'"))),
    "a negative shape": npz(("flat.npy", npy("(-1, 3)", "'<f8'", bytes(24)))),
    "a shape of nothing": npz(("flat.npy", npy("(0, 10000000000000000000000)", "'<f8'"))),
    "more data than its shape": npz(("flat.npy", FLAT + bytes(8))),
    "a deep header": npz(("flat.npy", npy("(" * 900, "'<f8'"))),
    "a long header": npz(("flat.npy", npy("(1, 3)" + " " * 100_000, "'<f8'", bytes(24)))),
    "a header that runs": npz(("flat.npy", npy("__import__('os').abort()", "'<f8'", bytes(24)))),
    "two arrays of one name": npz(("flat.npy", FLAT), ("flat.npy", FLAT)),
    "another compression": npz(("flat.npy", FLAT), method=zipfile.ZIP_LZMA),
    "encrypted": encrypted(npz(("flat.npy", FLAT))),
    "a wrong sum": wrong_sum(npz(("flat.npy", FLAT))),
    "a larger claim": claimed_size(npz(("flat.npy", FLAT)), 100_000),
    "a smaller claim": claimed_size(npz(("flat.npy", FLAT)), 10),
    "many names": npz(*((f"{k}.npy", b"") for k in range(30_000)), method=zipfile.ZIP_STORED),
}


@pytest.mark.parametrize("name", FILES)
def test_damaged_states_are_a_sentence(name: str, dome: Path) -> None:
    (dome / "states.npz").write_bytes(FILES[name])
    assert "states.npz cannot be read: it is damaged or not written by rodshell" in refusal(dome)


def test_states_that_unpack_to_gigabytes_are_refused_before_they_are_unpacked(dome: Path) -> None:
    """4.8 GB in 4.7 MB, in one array and in sixteen."""
    for arrays in (1, 16):
        with zipfile.ZipFile(dome / "states.npz", "w", zipfile.ZIP_DEFLATED, compresslevel=1) as stored:
            for k in range(arrays):
                rows = 4_800_000_000 // arrays // 24
                with stored.open(f"loaded_pinned_{k}.npy", "w", force_zip64=True) as entry:
                    entry.write(npy(f"({rows}, 3)", "'<f8'"))
                    for _ in range(2):  # what it says counts: to pack all of it takes half a minute
                        entry.write(bytes(10**6))
        content = bytearray((dome / "states.npz").read_bytes())
        at = -1
        while (at := content.find(b"PK\x01\x02", at + 1)) >= 0:
            struct.pack_into("<I", content, at + 24, min(2**32 - 2, 4_800_000_000 // arrays))
        (dome / "states.npz").write_bytes(content)
        code, said, used = exported(dome)
        assert code == 2
        assert re.search(r"holds arrays of \d+ MB; at most 500 MB are read: .* RODSHELL_LIMITS=\d+", said)
        assert used < 1.0


MEASURED = """
import resource, subprocess, sys
command = [sys.executable, "-m", "rodshell", "export", sys.argv[1], "--only", "csv"]
done = subprocess.run(command, stdout=subprocess.DEVNULL)
print(done.returncode, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1e6)
"""  # a process that is forked off a large one counts that one's memory as its own


def exported(folder: Path) -> tuple[int, str, float]:
    """Exit code, stderr and memory [GB] of a process of the command line."""
    done = subprocess.run([sys.executable, "-c", MEASURED, folder], capture_output=True, text=True, check=True)
    code, used = done.stdout.split()
    return int(code), done.stderr, float(used)


def test_states_whose_list_takes_gigabytes_are_damaged(dome: Path) -> None:
    """Each of five million entries of 51 bytes is an object of 700."""
    entry = struct.pack("<4s6H3L5H2L", b"PK\x01\x02", *6 * [0], *3 * [0], 5, *4 * [0], 0, 0) + b"a.npy"
    count = 5_000_000
    end = struct.pack("<4s4H2LH", b"PK\x05\x06", 0, 0, 0xFFFF, 0xFFFF, count * len(entry), 0, 0)
    (dome / "states.npz").write_bytes(entry * count + end)
    code, said, used = exported(dome)
    assert code == 2
    assert "states.npz cannot be read: it is damaged" in said
    assert used < 1.0


def _at(index: int, value: float) -> Edit:
    def edit(values: Any) -> Any:
        values = values.copy()
        values.flat[index] = value
        return values

    return edit


ARRAYS: dict[str, tuple[str, Edit, str]] = {
    "a far node": ("draped", _at(0, 1e300), "draped holds a point more than 1e+09 m from the origin"),
    "a node apart": ("popped_pinned", _at(4, 2e6), "popped_pinned holds points more than 1e+06 m apart"),
    "a node that is nowhere": ("history", _at(7, np.nan), "history holds a number that is not finite"),
    "a far target": ("target_points", _at(0, 1e30), "target_points holds a point more than 1e+09 m"),
    "a face of no point": ("target_faces", _at(0, 10**6), "target_faces holds 1 to 1000000, but there are"),
    "a face before the first": ("target_faces", lambda faces: faces.astype(int) - 1, "target_faces holds -1"),
    "quadrangles": ("target_faces", lambda faces: np.zeros((1, 4), int), "target_faces has the shape (1, 4)"),
    "a stress": ("stress_pinned", _at(0, np.inf), "stress_pinned holds a number that is not finite"),
    "a large force": ("force_clamped", _at(0, 1e31), "force_clamped holds"),
    "forces of others": ("force_clamped", lambda forces: forces[1:], "force_clamped has the shape"),
    "a far gap": ("gap_pinned", _at(0, 1e7), "gap_pinned holds"),
    "a share": ("history_share", _at(0, 7.0), "history_share holds"),
    "loads of others": ("loaded_pinned_snow", lambda points: points[1:], "loaded_pinned_snow has the shape"),
    "complex": ("flat", lambda points: points * 1j, "flat must be an array of numbers"),
    "records": ("flat", lambda points: np.zeros(len(points), [("x", "f8")]), "flat must be an array of numbers"),
    "quadruple": ("flat", lambda points: points.astype(np.longdouble), "flat must be an array of numbers"),
    "no node": ("rod_nodes", lambda nodes: nodes[:0], "history_stress has the shape (4, 54), not (4, 0)"),
}


@pytest.mark.parametrize("name", ARRAYS)
def test_array_out_of_range_is_a_sentence_that_names_it(name: str, dome: Path) -> None:
    array, edit, words = ARRAYS[name]
    change_arrays(dome, {array: edit})
    assert words in refusal(dome)


@pytest.mark.parametrize("name", ["rod_start", "rod_nodes", "history", "history_share", "target_faces"])
def test_array_without_which_another_means_nothing_is_missed(name: str, dome: Path) -> None:
    change_arrays(dome, {name: None})
    assert name in refusal(dome)


def change_arrays(folder: Path, edits: dict[str, Edit | None]) -> None:
    with np.load(folder / "states.npz") as stored:
        states = {name: stored[name] for name in stored.files}
    for name, edit in edits.items():
        if edit is None:
            del states[name]
        else:
            states[name] = edit(states[name])
    np.savez(folder / "states.npz", **states)


# result.json


TEXTS: dict[str, str] = {
    "too large": " " * 25_000_001,
    "deep": '{"rods": ' + "[" * 100_000,
    "deep where all is allowed": '{"later": ' + "[" * 900 + "]" * 900 + "}",
    "a long number": '{"version": ' + "9" * 5000 + "}",
    "a long number where all is allowed": '{"target": {"later": ' + "9" * 400 + "}}",
    "a number without end": '{"target": {"later": 1e400}}',
    "NaN where all is allowed": '{"target": {"later": [NaN]}}',
    "escapes in the version": '{"version": "\\u001b[31m"}',
    "escapes in a key": '{"rods": [{"id": "A", "family": "u", "start": 0, "end": 1, "stiffness": {"\\u001b": NaN}}]}',
}


@pytest.mark.parametrize("name", TEXTS)
def test_result_that_is_too_much_is_a_sentence(name: str, dome: Path) -> None:
    (dome / "result.json").write_text(TEXTS[name])
    assert "result.json" in refusal(dome)


def _set(*path: str | int, to: object) -> Edit:
    def edit(content: Any) -> None:
        for part in path[:-1]:
            content = content[part]
        content[path[-1]] = to

    return edit


KEYS: dict[str, tuple[Edit, str]] = {
    "a number out of range": (_set("bending", "strength", to=1e300), f"a number up to {LARGEST:g}"),
    "a count out of range": (_set("drape", "dofs", to=10**400), f"a number up to {MOST:g}"),
    "a rod too long": (_set("rods", 0, "cut_length", to=1e7), f"from {SHORTEST:g} to {FARTHEST:g} m"),
    "a rod without length": (_set("rods", 0, "end", to=-1e3), f"from {SHORTEST:g} to {FARTHEST:g} m"),
    "a far end": (_set("footprint", 0, 0, to=1e20), "footprint holds a point more than 1e+09 m from the origin"),
    "an unknown end in space": (_set("boundary", 0, 1, to=None), "boundary holds a point that is not known"),
    "an unknown end": (_set("footprint", 0, 0, to=None), "footprint holds a point that is not known"),
    "no forces": (_set("reactions", "pinned", "moments", to=[]), "reactions.pinned.moments has 0 points for 6 rods"),
    "no forces under loads": (_set("loads", "snow", "pinned", "support_forces", to=[]), "support_forces has 0 points"),
    "no ends under loads": (_set("boundary", to=[]), "there are loads, but no boundary"),
    "a far gap": (_set("agreement", "pinned", "where", to=[0.0, 0.0, 1e20]), "agreement.pinned.where holds a point"),
    "a far seam": (_set("seams", 0, "meetings", 0, "point", to=[0.0, -1e29, 0.0]), "seams[0].meetings holds a point"),
    "another paper": (_set("drawings", "paper", to="x"), "drawings.paper cannot be 'x'"),
}


@pytest.mark.parametrize("name", KEYS)
def test_key_out_of_range_is_a_sentence_that_names_it(name: str, dome: Path) -> None:
    edit, words = KEYS[name]
    content = json.loads((dome / "result.json").read_text())
    edit(content)
    (dome / "result.json").write_text(json.dumps(content))
    assert words in refusal(dome)


def test_many_faults_take_no_more_memory_than_one(dome: Path) -> None:
    """Each fault of a list was kept: ten million of them took more than twelve gigabytes."""
    (dome / "result.json").write_text('{"rods": [' + "0," * 2_000_000 + "0]}")
    assert "rods[0] cannot be 0: it must be a table of keys" in refusal(dome)


# case.toml


CASES = {
    "other bytes": b"\xff\xfe",
    "a path that is no text": b'[target]\nfile = "\\x"\n',
    "a path with NUL": b'[target]\nfile = "inputs/\\u0000"\n',
    "a path that no system has": b'[target]\nfile = "inputs/\\ud800"\n',
    "a long path": b'[target]\nfile = "inputs/' + b"x" * 5000 + b'"\n',
}


@pytest.mark.parametrize("name", CASES)
def test_damaged_case_is_a_sentence_or_names_no_input(name: str, dome: Path) -> None:
    (dome / "case.toml").write_bytes(CASES[name])
    assert outcome(dome, ["csv"]) == ""


# mutations


CHEAP = ["csv", "obj", "gltf", "vtp", "compas"]
KINDS = [["svg", "dxf", "report"], *4 * [CHEAP], ["png", "pdf"], *4 * [CHEAP]]
VALUES: list[object] = [
    1e300, -1e300, 1e30, -1e30, 1e20, 1e6, -1e6, 1e5, 1.0, 0, -1, 1e-9, 1e-300, 10**400, 10**15, float("nan"), None,
    True, "", "x", "\x1b[31m", "9" * 30, "../../etc/passwd", [], {}, [1],
]  # fmt: skip


def places(content: Any, path: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    """Every key and entry of a result."""
    items = content.items() if isinstance(content, dict) else enumerate(content) if isinstance(content, list) else ()
    return [where for name, item in items for where in ((*path, name), *places(item, (*path, name)))]


def test_result_with_any_other_value_gives_finite_files_or_a_sentence(dome: Path) -> None:
    chance = random.Random(SEED)
    content = json.loads((dome / "result.json").read_text())
    where = places(content)
    for number in range(60 * TRIES):
        changed = deepcopy(content)
        path, value = chance.choice(where), chance.choice(VALUES)
        _set(*path, to=value)(changed)
        (dome / "result.json").write_text(json.dumps(changed))
        assert outcome(dome, KINDS[number % len(KINDS)]) == "", (number, path, value)


def test_states_with_any_other_value_give_finite_files_or_a_sentence(dome: Path) -> None:
    chance = random.Random(SEED)
    with np.load(dome / "states.npz") as stored:
        states = {name: stored[name] for name in stored.files}
    for number in range(40 * TRIES):
        name = chance.choice(list(states))
        values, number_or_index = states[name].copy(), chance.choice([1e300, np.nan, -9e5, 1e5, 1e29, 0, -1, 5, 10**9])
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if chance.random() < 0.2:
                values = values.astype(chance.choice(["f2", ">f8", "i4", "u8", "c16", "U5", "i1"]))
            elif values.dtype.kind == "f" or abs(number_or_index) <= 10**9:
                values.flat[chance.randrange(values.size)] = np.array(number_or_index).astype(values.dtype)
        np.savez(dome / "states.npz", **{**states, name: values})
        assert outcome(dome, KINDS[number % len(KINDS)]) == "", (number, name, number_or_index)


def mutated(content: bytes, chance: random.Random) -> bytes:
    """Some bytes of a file changed, cut out, doubled or added."""
    content = bytearray(content)
    for _ in range(chance.choice([1, 1, 2, 5])):
        at, length = chance.randrange(len(content) + 1), chance.choice([1, 1, 2, 8, 300])
        part = content[at : at + length]
        other = bytes(chance.randrange(256) for _ in part)
        content[at : at + length] = chance.choice([other, b"", part * 2, b"9", b"e9", b'"', b"\0", b"-", b"]"])
    return bytes(content)


@pytest.mark.parametrize("name", ["result.json", "states.npz", "case.toml", "manifest.json", RECORD])
def test_file_mutated_by_bytes_gives_finite_files_or_a_sentence(name: str, dome: Path, tmp_path: Path) -> None:
    chance = random.Random(f"{SEED} {name}")
    stage = dome / ".rodshell-stage-killed"
    file = stage / RECORD if name == RECORD else dome / name
    if name == RECORD:
        (stage / "new/drawings").mkdir(parents=True)
        (stage / "new/drawings/plan.svg").write_text("<svg/>")
        marks = json.loads((dome / "manifest.json").read_text())["files"]
        names = ["schedule/rods.csv", "drawings"]
        record = {"files": ["drawings/plan.svg"], "removes": names[:1], "replaces": {names[0]: marks[names[0]]}}
        file.write_text(json.dumps(record))
    content, kept = file.read_bytes(), tmp_path / "kept"
    shutil.copytree(dome, kept)
    for number in range(30 * TRIES):
        file.parent.mkdir(exist_ok=True)
        file.write_bytes(mutated(content, chance))
        assert outcome(dome, ["csv"]) == "", number
        with suppress(RodshellError), open_folder(dome):
            pass
        assert sorted(one.name for one in tmp_path.iterdir()) == ["dome", "kept"]
        if name == RECORD:
            shutil.rmtree(dome)
            shutil.copytree(kept, dome)


def test_point_that_no_picture_can_show_is_a_sentence(dome: Path) -> None:
    """An image was made that is higher by as much as the point is farther."""
    content = json.loads((dome / "result.json").read_text())
    content["agreement"]["clamped"]["where"] = [0.0, 0.0, 1e5]
    (dome / "result.json").write_text(json.dumps(content))
    with pytest.raises(OutputError, match="a point lies so far from the others that no picture can show both"):
        dict(files_of(read(dome), ["png"]))


def test_line_as_long_as_a_million_labels_takes_no_time(dome: Path) -> None:
    """Each square of the plane that it covers was visited."""
    content = json.loads((dome / "result.json").read_text())
    content["rods"][0]["end"] = 1e5
    (dome / "result.json").write_text(json.dumps(content))
    assert outcome(dome, ["svg"]) == ""


def test_archive_without_rods_is_refused_on_reading(dome: Path) -> None:
    content = json.loads((dome / "result.json").read_text())
    kept = (
        "format",
        "version",
        "units",
        "version_rodshell",
        "name",
        "status",
        "target",
        "layout",
        "rod",
        "joint",
    )
    bare = {key: content[key] for key in kept} | {key: [] for key in ("rods", "footprint", "boundary", "end_tangents")}
    (dome / "result.json").write_text(json.dumps(bare | {"dropped": [], "warnings": []}))
    (dome / "states.npz").write_bytes(npz())
    with pytest.raises(RodshellError, match=r"there are no rods in result\.json"):
        read(dome)
