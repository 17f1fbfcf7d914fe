"""Every command with its standard streams closed, full or gone, in odd surroundings: it does its work, or says why not.

What a form finder stands for is in tests/cli; here processes are started as a shell starts them.
"""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from rodshell.output.files import save
from tests.output.sample_archive import sample_archive

pytestmark = [pytest.mark.attack, pytest.mark.skipif(sys.platform == "win32", reason="needs file descriptors")]
FORM = [
    "form",
    "hemisphere",
    "--layout.rods",
    "5x5",
    "--layout.spacing",
    "80 mm",
    "--layout.edge",
    "40 mm",
    "--only",
    "csv",
]
FULL = "/dev/full"
needs_full = pytest.mark.skipif(not Path(FULL).exists(), reason=f"needs {FULL}")


def closed(*numbers: int) -> Callable[[], None]:
    """Standard streams to be closed before the program starts."""

    def close() -> None:
        for number in numbers:
            os.close(number)

    return close


def run(arguments: list[str], folder: Path, **options: object) -> subprocess.CompletedProcess[str]:
    options = {"capture_output": True, "text": True, "timeout": 120, "check": False, "cwd": folder} | options
    return subprocess.run([sys.executable, "-m", "rodshell", *arguments], **options)  # type: ignore[call-overload, no-any-return]


@pytest.fixture(scope="module")
def dome(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("streams") / "dome"
    save(sample_archive(), folder, [])
    return folder


STREAMS = {
    "stdout closed": {"preexec_fn": closed(1)},
    "stderr closed": {"preexec_fn": closed(2)},
    "all closed": {"preexec_fn": closed(0, 1, 2)},
}


@pytest.mark.parametrize("streams", [*STREAMS, pytest.param("full", marks=needs_full)])
def test_what_was_computed_is_saved_with_its_exit_code(streams: str, tmp_path: Path) -> None:
    if streams == "full":
        with Path(FULL).open("w") as full:
            ended = run(FORM, tmp_path, capture_output=False, stdout=full, stderr=full)
    else:
        ended = run(FORM, tmp_path, **STREAMS[streams])
    assert ended.returncode == 4  # its rubber rods do not carry their own weight
    assert (tmp_path / "out" / "hemisphere" / "result.json").read_bytes().startswith(b"{")
    assert (tmp_path / "out" / "hemisphere" / "schedule" / "rods.csv").is_file()


COMMANDS = [
    (["form", "--help"], 0), (["--version"], 0), ([], 0), (["form", "nowhere"], 2),
    (["export", "DOME", "--only", "csv"], 0), (["export", "--schema"], 0),
    (["refine", "nowhere"], 2), (["check", "DOME"], 2), (["popup", "nowhere"], 2),
    (["sweep", "nowhere"], 2), (["optimise", "nowhere"], 2), (["paper", "nothing"], 2), (["studio", "nowhere"], 2),
]  # fmt: skip


@needs_full
@pytest.mark.parametrize(
    ("arguments", "code"), COMMANDS, ids=lambda value: "-".join(value) if isinstance(value, list) else ""
)
def test_commands_end_with_their_own_code_whatever_takes_their_words(
    arguments: list[str], code: int, dome: Path, tmp_path: Path
) -> None:
    """Stdout that is full, with stderr closed: both at once, so that a process is enough for each command."""
    given = [str(dome) if argument == "DOME" else argument for argument in arguments]
    given += ["--out", str(tmp_path / "out")] if "DOME" in arguments else []
    with Path(FULL).open("w") as full:
        ended = run(given, tmp_path, capture_output=False, stdout=full, preexec_fn=closed(2))
    assert ended.returncode == code


def test_reader_that_goes_away_ends_nothing(dome: Path, tmp_path: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    given = ["export", str(dome), "--only", "csv,svg", "--out", "out"]
    ended = run(given, tmp_path, capture_output=False, stdout=writing, stderr=subprocess.PIPE)
    os.close(writing)
    assert ended.returncode == 0
    assert ended.stderr == "rodshell: files\n"
    assert (tmp_path / "out" / "drawings").is_dir()


@needs_full
def test_loss_of_words_is_said_where_they_can_be_said(tmp_path: Path) -> None:
    with Path(FULL).open("w") as full:
        ended = run(["export", "--schema"], tmp_path, capture_output=False, stdout=full, stderr=subprocess.PIPE)
    assert ended.returncode == 0
    assert ended.stderr == "rodshell: not all could be printed: No space left on device\n"


ODD = {
    "SOURCE_DATE_EPOCH": "abc", "COLUMNS": "abc", "LINES": "-1", "TERM": "dumb", "HOME": "/nowhere",
    "TMPDIR": "/nowhere",
    "PYTHONIOENCODING": "latin-1", "LC_ALL": "C", "XDG_CACHE_HOME": "/proc/nowhere", "NO_COLOR": "x",
}  # fmt: skip


def test_odd_surroundings_stop_nothing(dome: Path, tmp_path: Path) -> None:
    kinds = "csv,dxf,svg,pdf,obj,gltf,vtp,compas,png,report"
    for odd in (ODD, {**ODD, "SOURCE_DATE_EPOCH": "9" * 30, "COLUMNS": "0", "PYTHONIOENCODING": "ascii"}):
        ended = run(["export", str(dome), "--only", kinds, "--out", "out"], tmp_path, env={**os.environ, **odd})
        assert ended.returncode == 0, ended.stderr
        assert "Traceback" not in ended.stderr
        assert len(list((tmp_path / "out").rglob("*.*"))) > 20


@pytest.mark.parametrize(
    "arguments", [["form", "hemisphere"], ["export", "dome"], ["sweep", "a.toml"], ["paper", "fig1"]]
)
def test_folder_that_was_deleted_is_one_sentence(arguments: list[str], tmp_path: Path) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    ended = run(arguments, gone, preexec_fn=gone.rmdir)
    assert ended.returncode == 2
    assert ended.stderr == "rodshell: error: the current folder does not exist any more: change to another one\n"


def test_lack_of_memory_is_one_sentence(tmp_path: Path) -> None:
    resource = pytest.importorskip("resource")

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (3_000_000_000, 3_000_000_000))

    code = (
        "import numpy, rodshell.cli.options as options; options.load_case = lambda *_: numpy.empty(10**10); "
        "from rodshell.cli import main; raise SystemExit(main(['form', 'hemisphere']))"
    )
    ended = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, preexec_fn=limited, check=False
    )
    assert ended.returncode == 2
    assert ended.stderr.startswith("rodshell: error: out of memory (Unable to allocate 74.5 GiB")
    assert ended.stderr.count("\n") == 1


def test_settings_of_numba_in_the_current_folder_are_not_obeyed(tmp_path: Path) -> None:
    """One of them names a folder of kernels, which are kept as pickles."""
    pytest.importorskip("yaml")
    pytest.importorskip("numba")
    (tmp_path / ".numba_config.yaml").write_text(f"cache_dir: {tmp_path}\n")
    code = "import rodshell.kernels.jit, numba; print([numba.config.CACHE_DIR])"
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    ended = subprocess.run(
        [sys.executable, "-P", "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True,
        env=environment | {"RODSHELL_KERNELS": "jit"},
    )  # fmt: skip
    assert ended.stdout == "['']\n"
