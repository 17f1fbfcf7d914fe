"""What a command says and writes: progress while a job runs, its result when it is there, and the exit code."""

import json
import os
import shutil
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from glob import escape
from itertools import count
from pathlib import Path
from shlex import quote
from time import monotonic
from typing import TYPE_CHECKING, Any, Self

import click

from rodshell.case import Case
from rodshell.cli.interruption import Interruption
from rodshell.cli.options import RunOptions
from rodshell.errors import InputError
from rodshell.kernels import COMPILED
from rodshell.kernels.cache import kernels_are_kept
from rodshell.printed import say
from rodshell.progress import Bar, limited, where

if TYPE_CHECKING:
    from rodshell.form import Form
    from rodshell.results.folder import ResultFolder

UNKEPT = "no folder to keep them in can be written; NUMBA_CACHE_DIR may name one"
SILENCE = 10.0  # s: the longest without a word, away from a terminal
TICK = 0.5  # s, on a terminal
BAR = 24  # characters
SEARCH = "search.svg"
FOUND, BAD_INPUT, NOT_CONVERGED, UNBUILDABLE = 0, 2, 3, 4


class Progress(Bar):
    """Says where a job is: stage, iteration, share, residual, elapsed time.

    On a terminal that is one live line; else one short line for each stage, and a long one after each `SILENCE`.
    Called as progress(stage, detail, residual) at each iteration; use it in a `with`, or in several in turn.

    Raises:
        KeyboardInterrupt: the job was interrupted, and the interrupt was lost.
    """

    def __init__(self, *, quiet: bool = False) -> None:
        super().__init__()
        self._quiet = quiet
        self._begun = self._spoken = monotonic()
        self._said = self._where = "preparing"
        self._over = threading.Event()
        self._voice: threading.Thread | None = None

    def __enter__(self) -> Self:
        if self._quiet:
            return self
        super().__enter__()
        self._over.clear()
        self._voice = threading.Thread(target=self._speak, args=(TICK if self._live else SILENCE / 10,), daemon=True)
        self._voice.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._over.set()
        if self._voice is not None:
            self._voice.join()
            self._voice = None
        super().__exit__(*error)

    def __call__(self, stage: str, detail: str, residual: float) -> None:
        Interruption.check()
        self._where = where(stage, detail, residual)
        if stage != self._said and not self._quiet and self._live is None:
            self._say(stage)
        self._said = stage

    def _speak(self, every: float) -> None:
        """Say where the job is, however long it has not called."""
        while not self._over.wait(every):
            line = f"{self._where}, {monotonic() - self._begun:.0f} s"
            if self._live is not None:
                self._live.live(line)
            elif monotonic() - self._spoken >= SILENCE:
                self._say(line)

    def _say(self, words: str) -> None:
        self._spoken = monotonic()
        say(words)


def compile_before_first(*, quiet: bool = False, every: bool = False) -> int:
    """Compile the kernels that were not compiled with the wheel or by an earlier run; how many they were.

    Args:
        every: those of joints, meshes and dynamics too, which otherwise are compiled when a job calls them.

    Raises:
        KeyboardInterrupt: interrupted; what was compiled until then is kept.
    """
    if COMPILED is not None or os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        return 0
    if not kernels_are_kept():
        if not quiet:
            say(f"kernels are compiled again in this run, a minute or two: {UNKEPT}")
        return 0
    from rodshell.kernels.ahead import compile_kernels

    progress = Progress(quiet=quiet)

    def tell(done: int, count: int) -> None:
        bar = "#" * (BAR * done // count)
        progress("compiling kernels, once, a minute or two", f"[{bar:{BAR}}] {done} of {count}", 0.0)

    with progress:
        return compile_kernels(tell, every=every)


@dataclass(frozen=True)
class Outcome:
    """What a job has come to.

    Args:
        status: "converged", or why not.
        summary: six lines of text, or all that was found.
        content: what result.json holds.
        save: writes it into a folder.
        refused: why its loads could not be checked.
    """

    status: str
    summary: str
    content: dict[str, Any]
    save: Callable[["ResultFolder"], object]
    refused: str = ""


def run_and_deliver(case: Case, name: str, output: RunOptions, *, formed_before: bool = False) -> int:
    """Run the job of a case and write its form; the exit code.

    Args:
        name: of the case, by which its folder is called.
        formed_before: the form is on disk already; where its loads cannot be checked it is not written again.
    """
    from rodshell.output.files import reserved, save, wanted_kinds
    from rodshell.results.folder import open_folder
    from rodshell.results.offers import offered

    kinds = wanted_kinds(output.only, case.drawings.files)
    names = ["result.json", "states.npz", *_names_of(case), *reserved(kinds)]
    with open_folder(output.out or default_folder(name), reserved=names, force=output.force) as place:
        compile_before_first(quiet=output.quiet)
        from rodshell.job import Job

        progress = Progress(quiet=output.quiet)
        in_time = limited(progress, output.limit)
        with progress:
            form = Job.of_case(case).run(progress=in_time, announce=None if output.quiet else say, frames_in=place.new)
        refused = "" if form.known_loaded is None else form.known_loaded.refused
        if refused and formed_before:
            raise InputError(refused)
        archive = form.archive()
        summary = archive.summary(verbose=output.verbose)
        if output.verbose:
            searched = form.search.table() if form.search is not None else ""
            summary = "\n".join(filter(None, [searched, summary]))
        outcome = Outcome(
            archive.results.status,
            summary,
            archive.results.plain(),
            lambda folder: save(archive, folder, kinds, more=_pictures(form), progress=in_time),
            refused,
        )
        code = deliver(outcome, place, progress=progress, as_json=output.as_json, quiet=output.quiet)
        if place.committed and not output.quiet and offered(archive.verdict):
            say(f"rodshell advise {quote(str(place.path))} tries what may help")
        return code


def default_folder(name: str) -> Path:
    """Where the result of a case, or a figure of the paper, is written unless a folder is given."""
    return Path("out") / Path(name).stem


def _names_of(case: Case) -> list[str]:
    """Patterns of the files that are written of a case: itself with its files, a picture, what a fall streams."""
    if case.of_table:
        return []
    from rodshell.results.archive import kept_case, read_inputs
    from rodshell.solve.simulate import NAMES

    copies = kept_case(case.to_toml(), read_inputs(case.to_toml()), Path())[1]
    frames = [f"{escape(case.drape.frames)}/{name}.npy" for name in NAMES] if case.drape.frames else []
    return ["case.toml", *copies, *([SEARCH] if case.undecided else []), *frames]


def _pictures(form: "Form") -> dict[str, str]:
    """The picture of the search, if there was one."""
    if form.search is None:
        return {}
    from rodshell.output.colour_scale import search_svg

    title = f"{form.search.title} by anchor and heading"
    return {SEARCH: search_svg(title, form.search.trials, form.search.best)}


def deliver(outcome: Outcome, place: "ResultFolder", *, progress: Progress, as_json: bool, quiet: bool) -> int:
    """Save an outcome, print its summary, and return the exit code; not converged wins over not buildable."""
    from rodshell.results.results import LEVELS
    from rodshell.results.wording import CASE, FORM, FORM_AGAIN

    Interruption.check()
    with progress:
        folder = _saved(outcome, place)
    again = f"{FORM} {quote(str(folder / CASE))}"
    if as_json:
        click.echo(json.dumps({"out": str(folder), **outcome.content}))
    elif not quiet:
        click.echo(outcome.summary.replace(FORM_AGAIN, again))
        say(f"written to {folder}{_in_words(folder)}")
    if outcome.refused:
        say(f"error: {outcome.refused}; the form is in {folder}, without its loads")
        return BAD_INPUT
    if outcome.status != "converged":
        late = outcome.status.startswith("out of time")
        said = outcome.status if late else f"NOT CONVERGED: {outcome.status}"
        say(f"{said}; partial results are in {folder}")
        return NOT_CONVERGED
    verdict = outcome.content.get("verdict")
    codes = {"unbuildable": UNBUILDABLE} | ({"unknown": NOT_CONVERGED} if outcome.content.get("pop_up") else {})
    if verdict and (level := verdict["level"]) in codes:
        named = LEVELS[level].upper()
        say(f"{named}: {verdict['reasons'][0].replace(FORM_AGAIN, again)}; results are in {folder}")
        return codes[level]
    return FOUND


def _in_words(folder: Path) -> str:
    """Which files a result has, and how the others are got."""
    from rodshell.output.files import in_words

    written, left = in_words(folder)
    shown = folder
    with suppress(OSError, ValueError):  # the current folder is gone, or not above it
        shown = folder.relative_to(Path.cwd())
    later = f"; rodshell export {quote(str(shown))} writes {', '.join(left)}" if left else ""
    return f": {', '.join(written)}{later}" if written else later


def _saved(outcome: Outcome, place: "ResultFolder") -> Path:
    """Where a result was saved: next to its place, if somebody put files there while the job ran."""
    from rodshell.results.folder import ForeignFileError, open_folder

    try:
        outcome.save(place)
        for name in place.kept:
            say(f"kept {place.path / name}: it was changed since an earlier run wrote it")
        return place.path
    except KeyboardInterrupt:
        if not place.committed:
            raise
        raise KeyboardInterrupt(f"the new result in {place.path} is complete") from None
    except ForeignFileError as error:
        free = free_name(place.path)
        with open_folder(free) as other:
            shutil.copytree(place.new, other.new, dirs_exist_ok=True)
            other.commit()
        say(f"written to {free} instead: {error}")
        return free


def free_name(path: Path) -> Path:
    """A folder next to `path` that does not exist yet."""
    names = (path.with_name(f"{path.name}-{k}") for k in count(2))
    return next(name for name in names if not name.exists())
