"""Writing into a result folder: only files that rodshell wrote are replaced, and all of them or none.

New files are staged in a hidden folder inside the result folder (so that it may be a mount point). `commit` writes
down what is to be moved, and from then on the new result counts: should the process be killed while files are moved,
readers take what was not moved from the stage, and the next writer moves it. What a killed process left before its
commit is removed by the next writer.

manifest.json lists the files that rodshell wrote with size and SHA-256. A file that is not listed, or whose content is
no longer the listed one, belongs to the user.
"""

import hashlib
import json
import os
import shutil
import signal
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import field
from pathlib import Path, PurePosixPath
from typing import Any

from rodshell.dataclass import dataclass
from rodshell.errors import InputError, OutputError
from rodshell.validation import instance

try:
    import fcntl
except ImportError:  # Windows: two runs into one folder at the same time are not kept apart there
    fcntl = None  # type: ignore[assignment]

MANIFEST, MANIFEST_FORMAT, MANIFEST_VERSION = "manifest.json", "rodshell-manifest", 1
STAGE, NEW, RECORD = ".rodshell-stage-", "new", "commit.json"
FORGOTTEN = 3600.0  # s: age of a stage that has lost its process, where locks are not available

Mark = dict[str, object]
"""What stands at a name: {"size", "sha256"} of a file, {"link"} of a symbolic link, {"folder"} or {"other"}; {"behind"}
of a name whose folder is in fact a link, a file or another mount."""


class ForeignFileError(OutputError):
    """Files that rodshell did not write stand where it has to write."""


@dataclass
class ResultFolder:
    """A folder that is written into; nothing in it changes before `commit`.

    Parameters
    ----------
    path : of the folder, absolute; stage : the hidden folder inside it, which is removed in the end.
    force : whether files that rodshell did not write may be replaced where it has to write.
    kept : after `commit`, files of an earlier result that somebody has changed since: they stay.
    committed : whether the new result is in its place, also if the process was interrupted meanwhile.
    """

    path: Path
    stage: Path
    force: bool = False
    kept: tuple[str, ...] = field(default=(), init=False)
    committed: bool = field(default=False, init=False)

    @property
    def new(self) -> Path:
        """The staged files, in their tree."""
        return self.stage / NEW

    def put(self, name: str, content: str | bytes) -> None:
        """Stage a file.

        Parameters
        ----------
        name : path of the file within the folder.
        content : text, written as UTF-8, or bytes.

        Raises
        ------
        OutputError : it cannot be written.
        """
        file = self.new / name
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(content if isinstance(content, bytes) else content.encode())
        except OSError as error:
            raise OutputError(f"cannot write {self.path / name}: {error.strerror}; choose another folder") from error

    def check(self, names: Iterable[str]) -> dict[str, Mark | None]:
        """What stands at `names` now, and at what they need.

        Raises
        ------
        ForeignFileError : something that rodshell did not write, and that `force` does not allow to replace.
        """
        marks = {name: mark(self.path, name) for name in names}
        strange = foreign(self.path, marks)
        marks |= {name: mark(self.path, name) for name in strange}
        stuck = [name for name in strange if not {"size", "link"} & (marks[name] or {"size": 0}).keys()]
        if stuck:
            raise ForeignFileError(
                f"{self.path / stuck[0]} is in the way of a file that has to be written there: move it, or choose "
                "another folder"
            )
        if strange and not self.force:
            raise ForeignFileError(_refusal(self.path, strange))
        return marks

    def commit(self, *, keep_others: bool = False) -> None:
        """Put all staged files in their places, and remove those of an earlier result that are not among them.

        keep_others : leave files of an earlier result that are not staged, as parts of it.

        Raises
        ------
        ForeignFileError : as of `check`; nothing was changed. OutputError : files cannot be moved.
        """
        try:
            staged = (file.relative_to(self.new).as_posix() for file in self.new.rglob("*") if file.is_file())
            written = {name: found for name in sorted(staged) if (found := mark(self.new, name)) is not None}
            with _locked(self.path):
                _recover(self.path, but=self.stage)
                there = self.check([*written, MANIFEST])
                old = {name: found for name, found in read_manifest(self.path).items() if name not in written}
                now = {} if keep_others else {name: mark(self.path, name) for name in old}
                removed = {name: found for name, found in now.items() if found == old[name]}
                self.kept = tuple(name for name, found in now.items() if found is not None and name not in removed)
                self.put(MANIFEST, manifest_text({**(old if keep_others else {}), **written}))
                record = {"files": [*written, MANIFEST], "replaces": there | removed, "removes": list(removed)}
                (self.stage / "record").write_text(json.dumps(record), encoding="utf-8")
                with _uninterrupted():
                    (self.stage / "record").replace(self.stage / RECORD)  # from here on the new result counts
                    _apply(self.path, self.stage)
                    self.committed = True
        except OSError as error:
            if isinstance(error, OutputError):
                raise
            state = "the next run completes it" if (self.stage / RECORD).exists() else "nothing was changed"
            raise OutputError(f"cannot write {self.path}: {error.strerror or error}; {state}") from error


@contextmanager
def open_folder(
    folder: "str | os.PathLike[str] | ResultFolder", *, reserved: Iterable[str] = (), force: bool = False
) -> Iterator[ResultFolder]:
    """A folder to write into, made if need be, and as it was if nothing is committed.

    Parameters
    ----------
    reserved : patterns (of `Path.glob`) of the names that will be written, to be asked for before a long computation.

    Raises
    ------
    InputError : `folder` is empty, or no path. OutputError : it cannot be written. ForeignFileError : as of
        `ResultFolder.check`, of `reserved`.
    """
    if isinstance(folder, ResultFolder):
        yield folder
        return
    instance("folder", folder, str | os.PathLike, "the path of a folder")
    if isinstance(folder, str) and not folder.strip():
        raise InputError('folder must be the path of a folder, not "": "." is the current one')
    path = Path(folder).expanduser().resolve()
    made = list[Path]()
    stage, lock = None, None
    try:
        try:
            made = _make(path)
            with _locked(path):
                _recover(path)
                stage = Path(tempfile.mkdtemp(prefix=STAGE, dir=path))
                lock = _lock(stage)
            (stage / NEW).mkdir()
            place = ResultFolder(path, stage, force)
            place.check(_standing(path, [*reserved, MANIFEST]))
        except OSError as error:
            if isinstance(error, OutputError):
                raise
            raise OutputError(f"cannot write {path}: {error.strerror or error}; choose another folder") from error
        yield place
    finally:
        if stage is not None and not (stage / RECORD).exists():
            shutil.rmtree(stage, ignore_errors=True)
        if lock is not None:
            os.close(lock)
        for new in reversed(made):
            with suppress(OSError):
                new.rmdir()


@contextmanager
def reading(folder: str | os.PathLike[str]) -> Iterator[Callable[[str], Path]]:
    """Where each file of a result is, by name: in its folder, or still in the stage of a commit that was killed.

    Parameters
    ----------
    folder : with a result, or one that a killed process was writing.
    """
    path = Path(folder).expanduser()
    with _locked(path, shared=True):
        stage = next((stage for stage in _stages(path) if (stage / RECORD).exists()), None)
        record = _record(stage) if stage else {"files": (), "removes": ()}

        def where(name: str) -> Path:
            if stage is None or name not in (*record["files"], *record["removes"]):
                return path / name
            staged = stage / NEW / name
            return staged if staged.exists() or name in record["removes"] else path / name

        yield where


def _refusal(path: Path, names: list[str]) -> str:
    shown = ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
    if not read_manifest(path) and "result.json" in names:
        why = f"there is no {MANIFEST}: the result was copied, or written by an earlier version"
    else:
        why = "not written by rodshell, or changed since"
    return (
        f"will not replace {shown} in {path} ({why}): choose another folder, move what you want to keep, or use "
        "--force (in Python force=True)"
    )


def _standing(path: Path, patterns: Iterable[str]) -> list[str]:
    """What there is of the names that match; and a pattern itself, where no folder is but something else."""
    found = dict[str, None]()
    for pattern in patterns:
        found |= {file.relative_to(path).as_posix(): None for file in path.glob(pattern)}
        if any((path / part).exists() and not (path / part).is_dir() for part in above(pattern)):
            found[pattern] = None
    return list(found)


def _make(path: Path) -> list[Path]:
    """Make `path` and the folders above it that are missing; returns those made, the outermost first."""
    if path.exists() and not path.is_dir():
        raise OutputError(f"cannot write {path}: it is a file; choose a folder")
    missing = [folder for folder in (path, *path.parents) if not folder.exists()]
    there = missing[-1].parent if missing else path
    if not there.is_dir():
        raise OutputError(f"cannot write {path}: {there} is a file; choose another folder")
    made = list[Path]()
    try:
        for folder in reversed(missing):
            folder.mkdir()
            made.append(folder)
    except OSError as error:
        for folder in reversed(made):
            with suppress(OSError):
                folder.rmdir()
        raise OutputError(f"cannot write {path}: {error.strerror} in {there}; choose another folder") from error
    return made


def _stages(path: Path) -> list[Path]:
    return [stage for stage in path.glob(f"{STAGE}*") if stage.is_dir() and not stage.is_symlink()]


def _recover(path: Path, but: Path | None = None) -> None:
    """Complete a commit that was killed, and remove the stages of processes that are gone."""
    for stage in _stages(path):
        if stage == but:
            continue
        try:
            lock = _lock(stage, wait=False)
        except BlockingIOError:
            continue
        try:
            if (stage / RECORD).exists():
                _apply(path, stage)
            elif lock is None and time.time() - stage.stat().st_mtime < FORGOTTEN:
                continue
            shutil.rmtree(stage, ignore_errors=True)
        finally:
            if lock is not None:
                os.close(lock)


def _record(stage: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((stage / RECORD).read_text(encoding="utf-8"))
    return content


def _apply(path: Path, stage: Path) -> None:
    """Move and remove what the stage's record says; what somebody has changed since it was written stays."""
    record = _record(stage)
    replaces: dict[str, Mark | None] = record["replaces"]
    for name in record["removes"]:
        if mark(path, name) == replaces[name]:
            (path / name).unlink(missing_ok=True)
    for name in record["files"]:
        source, target = stage / NEW / name, path / name
        if not source.exists():
            continue  # it was moved before the kill
        for part in above(name):  # a file or a link in a folder's place, which --force gave away
            if part in replaces and mark(path, part) == replaces[part]:
                (path / part).unlink(missing_ok=True)
        if mark(path, name) in (None, replaces.get(name)):
            target.parent.mkdir(parents=True, exist_ok=True)
            source.replace(target)
    for folder in {path / part for name in record["removes"] for part in above(name)}:
        with suppress(OSError):
            folder.rmdir()
    (stage / RECORD).unlink()


@contextmanager
def _locked(path: Path, *, shared: bool = False) -> Iterator[None]:
    """Wait until no other process writes into `path`."""
    lock = _lock(path, shared=shared)
    try:
        yield
    finally:
        if lock is not None:
            os.close(lock)


def _lock(path: Path, *, shared: bool = False, wait: bool = True) -> int | None:
    """A descriptor that holds the folder's lock until it is closed; None on a file system without locks.

    Raises
    ------
    BlockingIOError : another process holds it, and `wait` is False.
    """
    if fcntl is None or not path.is_dir():
        return None
    try:
        descriptor = os.open(path, os.O_RDONLY)
    except OSError:  # a folder that cannot be listed is reported where its files are needed
        return None
    try:
        fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | (0 if wait else fcntl.LOCK_NB))
    except BaseException as error:
        os.close(descriptor)
        if isinstance(error, OSError) and not isinstance(error, BlockingIOError):
            return None
        raise
    return descriptor


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Ctrl-C and SIGTERM wait until the block is over."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    late = list[int]()
    before = {
        kind: signal.signal(kind, lambda number, _: late.append(number)) for kind in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        yield
    finally:
        for kind, handler in before.items():
            signal.signal(kind, signal.SIG_DFL if handler is None else handler)
        for number in late:
            signal.raise_signal(number)


def mark(folder: Path, name: str) -> Mark | None:
    """What stands at a name in a folder, links not followed; None where nothing does.

    Parameters
    ----------
    folder : of the result; name : of a file in it, with slashes.
    """
    path = folder / name
    behind = next((part for part in above(name) if _is_no_folder(folder / part)), None)
    if behind is not None:
        return {"behind": behind}
    if path.is_symlink():
        return {"link": str(path.readlink())}
    if path.is_file():
        with path.open("rb") as stream:
            return {"size": path.stat().st_size, "sha256": hashlib.file_digest(stream, "sha256").hexdigest()}
    if path.is_dir():
        return {"folder": True}
    return {"other": True} if path.exists() else None


def read_manifest(folder: Path) -> dict[str, Mark]:
    """What was written to `folder`, by name; empty where there is no manifest of ours."""
    try:
        content = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
        if content["format"] != MANIFEST_FORMAT:
            return {}
        return {name: found for name, found in content["files"].items() if _inside(name) and isinstance(found, dict)}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}


def manifest_text(files: Mapping[str, Mark]) -> str:
    """The content of manifest.json, a line for each file.

    Parameters
    ----------
    files : marks of the files, by name.
    """
    lines = ",\n".join(f"  {json.dumps(name)}: {json.dumps(files[name])}" for name in sorted(files))
    head = f' "format": {json.dumps(MANIFEST_FORMAT)},\n "version": {MANIFEST_VERSION},\n "files": {{\n'
    return "{\n" + head + lines + "\n }\n}\n"


def above(name: str) -> list[str]:
    """The folders that a name stands in, the outermost first."""
    return [str(folder) for folder in reversed(PurePosixPath(name).parents)][1:]


def foreign(folder: Path, marks: Mapping[str, Mark | None]) -> list[str]:
    """Of names and what stands there, those that rodshell did not write, or that conflict with such a name.

    Parameters
    ----------
    folder : of the result; marks : what stands at each name, see `mark`.
    """
    listed = read_manifest(folder)
    found = list[str]()
    for name, here in marks.items():
        if here is None or (bool(listed) if name == MANIFEST else here == listed.get(name)):
            continue
        found.append(str(here.get("behind", name)))
    return list(dict.fromkeys(found))


def _is_no_folder(path: Path) -> bool:
    """Whether something else stands there; another mount too, into which files cannot be moved in one step."""
    if path.is_dir() and not path.is_symlink():
        return path.stat().st_dev != path.parent.stat().st_dev
    return path.is_symlink() or path.exists()


def _inside(name: object) -> bool:
    """Whether a name cannot lead out of the folder."""
    path = PurePosixPath(str(name))
    return isinstance(name, str) and not path.is_absolute() and ".." not in path.parts and "\\" not in name
