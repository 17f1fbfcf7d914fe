"""Writing into a result folder: only files that rodshell wrote are replaced, and all of them or none.

New files are staged in a hidden folder inside the result folder (so that it may be a mount point). `commit` writes
down what is to be moved, and from then on the new result counts: should the process be killed while files are moved,
readers take what was not moved from the stage, and the next writer moves it. What a killed process left before its
commit is removed by the next writer.

A folder may be a stranger's: a commit is completed only if no name in it leads out of the folder, nor through a link,
and not if it is another user's.
"""

import json
import os
import shutil
import signal
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from warnings import warn

from rodshell.errors import InputError, OutputError, OutputWarning
from rodshell.results.manifest import (
    MANIFEST,
    Mark,
    above,
    foreign,
    inside,
    is_mark,
    is_no_folder,
    is_own_file,
    manifest_text,
    mark,
    own_table,
    read_manifest,
)
from rodshell.validation import file_path, instance

try:
    import fcntl
except ImportError:  # Windows: two runs into one folder at the same time are not kept apart there
    fcntl = None  # type: ignore[assignment]

STAGE, NEW, RECORD = ".rodshell-stage-", "new", "commit.json"
FORGOTTEN = 3600.0  # s: age of a stage that has lost its process, where locks are not available


class ForeignFileError(OutputError):
    """Files that rodshell did not write stand where it has to write."""


@dataclass
class ResultFolder:
    """A folder that is written into; nothing in it changes before `commit`.

    Args:
        path: of the folder, absolute; stage : the hidden folder inside it, which is removed in the end.
        force: whether files that rodshell did not write may be replaced where it has to write.
        kept: after `commit`, files of an earlier result that somebody has changed since: they stay.
        committed: whether the new result is in its place, also if the process was interrupted meanwhile.
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
        """Stage a file by its path within the folder; text is written as UTF-8.

        Raises:
            OutputError: it cannot be written.
        """
        file = self.new / name
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(content if isinstance(content, bytes) else content.encode())
        except OSError as error:
            raise OutputError(f"cannot write {self.path / name}: {error.strerror}; choose another folder") from error

    def check(self, names: Iterable[str]) -> dict[str, Mark | None]:
        """What stands at `names` now, and at what they need.

        Raises:
            ForeignFileError: something that rodshell did not write, and that `force` does not allow to replace.
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

        Raises:
            ForeignFileError: as of `check`; nothing was changed. OutputError : files cannot be moved.
        """
        try:
            staged = (file.relative_to(self.new).as_posix() for file in self.new.rglob("*") if file.is_file())
            written = {name: found for name in sorted(staged) if (found := mark(self.new, name)) is not None}
            if strange := next((name for name in written if not inside(name)), None):
                raise OutputError(f"cannot write a file of the name {strange!r:.80}: choose another name")
            with _locked(self.path):
                _recover(self.path, but=self.stage)
                there = self.check([*written, MANIFEST])
                old = {name: found for name, found in read_manifest(self.path).items() if name not in written}
                now = {} if keep_others else {name: mark(self.path, name) for name in old}
                removed = {name: found for name, found in now.items() if found == old[name]}
                self.kept = tuple(name for name, found in now.items() if found is not None and name not in removed)
                self.put(MANIFEST, manifest_text({**(old if keep_others else {}), **written}))
                replaced = {name: found for name, found in (there | removed).items() if is_mark(found)}
                record = {"files": [*written, MANIFEST], "replaces": replaced, "removes": list(removed)}
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

    Args:
        reserved: patterns (of `Path.glob`) of the names that will be written, to be asked for before a long
            computation.

    Raises:
        InputError: `folder` is empty, or no path. OutputError : it cannot be written. ForeignFileError : as of
            `ResultFolder.check`, of `reserved`.
    """
    if isinstance(folder, ResultFolder):
        yield folder
        return
    instance("folder", folder, str | os.PathLike, "the path of a folder")
    if isinstance(folder, str) and not folder.strip():
        raise InputError('folder must be the path of a folder, not "": "." is the current one')
    path = file_path("folder", folder).resolve()
    made = list[Path]()
    stage, lock = None, None
    try:
        try:
            _make(path, made)
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

    What `reading` gives raises an OutputError for a name where something stands that is not a file, or leads outside.
    """
    path = Path(folder).expanduser()
    with _locked(path, shared=True):
        left, record = path, _Commit((), (), {})
        for stage in _stages(path):
            if os.path.lexists(stage / RECORD):
                try:
                    left, record = stage / NEW, _record(stage)
                except OutputError as fault:  # what stands in the folder is checked whole
                    warn(str(fault), OutputWarning, stacklevel=4)

        def where(name: str) -> Path:
            file, staged = path / name, left / name
            if name in record.removes or (name in record.files and staged.exists()):
                file = staged
            try:
                file.lstat()
            except (FileNotFoundError, NotADirectoryError):
                return file
            except OSError as reason:
                raise OutputError(f"{file} cannot be read: {reason.strerror}") from None
            if not Path(os.path.realpath(file)).is_relative_to(os.path.realpath(path)):
                raise OutputError(f"{file} leads out of the folder of the result: copy the file there")
            if not file.is_file():
                raise OutputError(f"{file} is not a file: run the case again in another folder")
            return file

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


def _make(path: Path, made: list[Path]) -> None:
    """Make `path` and the folders above it that are missing, and list those that were `made`, the outermost first."""
    if path.exists() and not path.is_dir():
        raise OutputError(f"cannot write {path}: it is a file; choose a folder")
    missing = [folder for folder in (path, *path.parents) if not folder.exists()]
    there = missing[-1].parent if missing else path
    if not there.is_dir():
        raise OutputError(f"cannot write {path}: {there} is a file; choose another folder")
    try:
        for folder in reversed(missing):
            folder.mkdir()
            made.append(folder)
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror} in {there}; choose another folder") from error


def _stages(path: Path) -> list[Path]:
    """Those of this user, and of the owner of the folder."""
    found = (stage for stage in path.glob(f"{STAGE}*") if not is_no_folder(stage) and stage.name.isprintable())
    return [stage for stage in found if _is_mine(stage) or stage.stat().st_uid == path.stat().st_uid]


def _is_mine(path: Path) -> bool:
    return not hasattr(os, "geteuid") or path.stat().st_uid == os.geteuid()


def _recover(path: Path, but: Path | None = None) -> None:
    """Complete a commit that was killed, and remove the stages of processes that are gone; an OutputError says that the
    record of a commit is damaged, or another user's."""
    for stage in _stages(path):
        if stage == but:
            continue
        with suppress(BlockingIOError), _locked(stage, wait=False) as lock:  # which another process may hold
            if os.path.lexists(stage / RECORD):
                if not _is_mine(stage):
                    raise OutputError(
                        f"{stage} was left by an interrupted write of another user, whose next run completes it: "
                        "choose another folder, or remove that one"
                    )
                _apply(path, stage)
            elif not _is_mine(stage) or (lock is None and time.time() - stage.stat().st_mtime < FORGOTTEN):
                continue
            shutil.rmtree(stage, ignore_errors=True)


@dataclass(frozen=True)
class _Commit:
    """What is to be done so that a new result stands in its folder, as commit.json of its stage says it: which files go
    into the folder and which out of it, and what stood there, or where a folder has to be, and may go."""

    files: tuple[str, ...]
    removes: tuple[str, ...]
    replaces: Mapping[str, Mark]


def _record(stage: Path) -> _Commit:
    """What is left to be done for a stage; an OutputError names a stage that is not as a writer left it."""
    try:
        content = own_table(stage, RECORD)
        files, removes, replaces = (content.get(name) for name in ("files", "removes", "replaces"))
        if not (isinstance(files, list) and isinstance(removes, list) and isinstance(replaces, dict)):
            raise OutputError("it lacks its names")
        if names := [name for name in (*files, *removes, *replaces) if not inside(name)]:
            raise OutputError(f"{names[0]!r:.80} cannot be the name of a file of a result")
        if not all(map(is_mark, replaces.values())):
            raise OutputError("it does not say what stood in the folder")
        for name in files:
            if os.path.lexists(stage / NEW / name) and not is_own_file(stage, f"{NEW}/{name}"):
                raise OutputError(f"{NEW}/{name} is not a file")
    except OutputError as fault:
        raise OutputError(f"{stage} was left by an interrupted write and is damaged ({fault}): remove it") from None
    return _Commit(tuple(files), tuple(removes), replaces)


def _apply(path: Path, stage: Path) -> None:
    """Move and remove what the stage's record says; what somebody has changed since it was written stays."""
    record = _record(stage)
    for name in record.removes:
        if mark(path, name) == record.replaces.get(name, {}):
            (path / name).unlink(missing_ok=True)
    for name in record.files:
        source, target = stage / NEW / name, path / name
        if not source.exists():
            continue  # it was moved before the kill
        for part in above(name):  # a file or a link in a folder's place, which --force gave away
            if part in record.replaces and mark(path, part) == record.replaces[part]:
                (path / part).unlink(missing_ok=True)
        if mark(path, name) in (None, record.replaces.get(name)):
            target.parent.mkdir(parents=True, exist_ok=True)
            source.replace(target)
    for part in sorted({part for name in record.removes for part in above(name)}, reverse=True):
        if mark(path, part) == {"folder": True}:
            with suppress(OSError):
                (path / part).rmdir()
    (stage / RECORD).unlink()


@contextmanager
def _locked(path: Path, *, shared: bool = False, wait: bool = True) -> Iterator[int | None]:
    """Wait until no other process writes into `path`; see `_lock`."""
    lock = _lock(path, shared=shared, wait=wait)
    try:
        yield lock
    finally:
        if lock is not None:
            os.close(lock)


def _lock(path: Path, *, shared: bool = False, wait: bool = True) -> int | None:
    """A descriptor that holds the folder's lock until it is closed; None on a file system without locks. A
    BlockingIOError says that another process holds it, if `wait` is False."""
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
