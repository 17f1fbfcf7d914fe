"""Two pieces of work at once: the same files as one after the other, whatever goes wrong."""

import os
import threading
from pathlib import Path

import pytest
from forms import archive

from rodshell.output import beside as module
from rodshell.output.archive import write
from rodshell.output.beside import beside

forked = pytest.mark.skipif(not hasattr(os, "fork"), reason="no os.fork: run on Linux or macOS")


@pytest.fixture
def always(monkeypatch: pytest.MonkeyPatch) -> None:
    """A child, also where there is one core."""
    monkeypatch.setattr(module, "_may_fork", lambda: True)


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@forked
def test_a_result_written_by_two_processes_is_that_of_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """But for the archive of states, whose entries carry the time."""
    results = []
    for may in (True, False):
        monkeypatch.setattr(module, "_may_fork", lambda may=may: may)
        write(archive("dome"), tmp_path / str(may))
        results.append({name: data for name, data in contents(tmp_path / str(may)).items() if name != "states.npz"})
    assert "pictures/flat.png" in results[0]
    assert results[0] == results[1]


@forked
@pytest.mark.usefixtures("always")
def test_the_work_is_done_by_a_child_while_the_block_runs(tmp_path: Path) -> None:
    with beside(lambda: (tmp_path / "child").write_text(str(os.getpid()))):
        pass
    assert (tmp_path / "child").read_text() != str(os.getpid())


@forked
@pytest.mark.usefixtures("always")
def test_what_fails_in_the_child_is_done_and_told_here() -> None:
    here = os.getpid()

    def work() -> None:
        if os.getpid() == here:
            raise OSError("the disk is full")
        raise RuntimeError("in the child")

    with pytest.raises(OSError, match="the disk is full"), beside(work):
        pass


@forked
@pytest.mark.usefixtures("always")
def test_an_error_in_the_block_ends_the_child_too(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    fork, children = os.fork, []

    def noted() -> int:
        children.append(fork())
        return children[-1]

    def work() -> None:
        threading.Event().wait(5.0)
        (tmp_path / "done").touch()

    monkeypatch.setattr(os, "fork", noted)
    with pytest.raises(KeyboardInterrupt), beside(work):
        raise KeyboardInterrupt
    assert not (tmp_path / "done").exists()
    with pytest.raises(ChildProcessError):
        os.waitpid(children[0], os.WNOHANG)  # it is gone


def test_there_is_no_child_where_threads_run(monkeypatch: pytest.MonkeyPatch) -> None:
    def fork() -> int:
        raise AssertionError

    monkeypatch.setattr(os, "fork", fork, raising=False)
    stop, done = threading.Event(), []
    thread = threading.Thread(target=stop.wait)
    thread.start()
    try:
        with beside(lambda: done.append(1)):
            assert not done
    finally:
        stop.set()
        thread.join()
    assert done == [1]
