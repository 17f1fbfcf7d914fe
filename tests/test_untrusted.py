"""Files of a stranger: what is read, what is refused, and that nothing is waited for without end."""

import os
import sys
import threading
from pathlib import Path

import pytest

import rodshell as rs
from rodshell import untrusted
from rodshell.untrusted import limit, read_bytes, read_text
from rodshell.validation import file_path

needs_pipes = pytest.mark.skipif(sys.platform == "win32", reason="needs named pipes")


def test_file_is_read_up_to_its_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "ten"
    file.write_bytes(b"0123456789")
    assert read_bytes(file, 10) == b"0123456789"
    with pytest.raises(rs.InputError, match=r"at most 9e-06 MB are read: .* RODSHELL_LIMITS=2 to allow it"):
        read_bytes(file, 9)
    monkeypatch.setenv("RODSHELL_LIMITS", "2")
    assert read_bytes(file, 9) == b"0123456789"


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "many", ""])
def test_factor_of_the_limits_is_a_number_above_zero(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RODSHELL_LIMITS", text)
    with pytest.raises(rs.InputError, match="RODSHELL_LIMITS must be a number above 0"):
        limit(1.0)


@pytest.mark.parametrize("path", ["/dev/zero", "/dev/null"])
def test_device_and_a_link_to_one_are_refused(path: str, tmp_path: Path) -> None:
    if not Path(path).exists():
        pytest.skip(f"needs {path}")
    link = tmp_path / "model.obj"
    link.symlink_to(path)
    for place in (Path(path), link):
        with pytest.raises(rs.InputError, match="is a device"):
            read_bytes(place, 1e6)


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="needs /proc")
def test_file_that_does_not_tell_its_size_is_bounded_too() -> None:
    assert b"Name:" in read_bytes(Path("/proc/self/status"), 1e6)
    with pytest.raises(rs.InputError, match="are read"):
        read_bytes(Path("/proc/self/status"), 10)


@needs_pipes
def test_pipe_is_read_to_its_end(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    writer = threading.Thread(target=pipe.write_bytes, args=(b"v 0 0 0\n" * 100_000,))
    writer.start()
    assert len(read_bytes(pipe, 1e6)) == 800_000
    writer.join()


@needs_pipes
def test_pipe_that_nobody_writes_into_is_not_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(untrusted, "PATIENCE", 0.1)
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(rs.InputError, match=r"not written to its end within 0\.1 s"):
        read_bytes(pipe, 1e6)
    with (
        pipe.open("r+b", buffering=0),
        pytest.raises(rs.InputError, match="not written to its end"),
    ):  # a writer that gives nothing
        read_bytes(pipe, 1e6)


def test_folder_missing_file_and_other_text_are_one_sentence_each(tmp_path: Path) -> None:
    with pytest.raises(rs.InputError, match="is a folder: give a file"):
        read_bytes(tmp_path, 10)
    with pytest.raises(rs.InputError, match="there is no file named"):
        read_bytes(tmp_path / "none", 10)
    (tmp_path / "latin").write_bytes("Höhe".encode("latin-1"))
    with pytest.raises(rs.InputError, match="is not text in UTF-8"):
        read_text(tmp_path / "latin")


@pytest.mark.parametrize("path", ["a\0b", "~nobody-of-this-name/x.obj", "x" * 5000, "\ud800"])
def test_text_that_is_no_path_is_refused_in_a_sentence(path: str) -> None:
    with pytest.raises(rs.InputError, match="file = "):
        file_path("file", path)
