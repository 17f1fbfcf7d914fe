"""Every file that is made from an archive, by kind: what `rodshell export --only` may ask for.

A job writes the kinds of `DEFAULT`, with which a workshop begins; `rodshell export` writes the others when they are
wanted.

Modules that need a library of one kind of file alone are imported when such a file is written.
"""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from fnmatch import fnmatch
from functools import partial
from pathlib import Path
from shlex import quote
from warnings import warn

from rodshell.errors import InputError, OutOfTimeError, OutputWarning
from rodshell.output.drawings import drawing_set, drawing_svgs, sheet_set
from rodshell.output.grid import shape_names, shape_of
from rodshell.output.models import compas_json, glb_bytes, obj_text, rhino_bytes, time_series, vtp_text
from rodshell.output.opensees import opensees_files
from rodshell.output.pictures import deployment_picture, picture
from rodshell.output.schedules import SCHEDULES, table_csv
from rodshell.progress import Progress, require_progress, silent
from rodshell.results.archive import Archive, archive_names, put_archive
from rodshell.results.folder import ResultFolder, open_folder
from rodshell.results.manifest import read_manifest
from rodshell.results.states import DRAPED, POPPED, shells_among
from rodshell.units import shown
from rodshell.validation import described, flag, instance, mapping

Files = Iterator[tuple[str, str | bytes]]


def save(
    archive: Archive,
    folder: str | os.PathLike[str] | ResultFolder,
    kinds: str | Iterable[str] | None = None,
    *,
    force: bool = False,
    more: Mapping[str, str] | None = None,
    progress: Progress = silent,
) -> Path:
    """Write the whole result folder, replacing an older result's files and no others; returns its absolute path.

    Args:
        kinds: of files in addition to the archive (see `KINDS`), or one text such as "dxf, csv", or "all"; default:
            `DEFAULT`.
        force: also replace files that rodshell did not write, or that were changed since, where it has to write.
        progress: called for each kind of files; where it raises OutOfTimeError the archive is written and the kinds
            that are left are not, with a warning that names them.

    Raises:
        InputError: an unknown kind, or a form in place of its archive. ForeignFileError : such files are there, and
            `force` is False. OutputError : the folder cannot be written.
    """
    _require(archive, force, progress)
    more = mapping("more", {} if more is None else more, "texts by the names of their files")
    for name, text in more.items():
        instance("the name of each file", name, str, "text")
        instance(f"the content of {name}", text, str, "text")
    wanted = wanted_kinds(kinds)
    names = [*archive_names(archive), *reserved(wanted), *more]
    with open_folder(folder, reserved=names, force=force) as place:
        put_archive(archive, place)
        for name, text in more.items():
            place.put(name, text)
        left = list(wanted)
        with suppress(OutOfTimeError):
            while left:
                progress("files", left[0], 0.0)
                for name, made in KINDS[left[0]](archive):
                    place.put(name, made)
                del left[0]
        if left:
            again = f"rodshell export {quote(str(place.path))}"
            warn(f"out of time before the files of {', '.join(left)}: {again} writes them", OutputWarning, 2)
        place.commit()
        return place.path


def export(
    archive: Archive,
    folder: str | os.PathLike[str],
    kinds: str | Iterable[str] = "all",
    *,
    keep: bool = False,
    force: bool = False,
    progress: Progress = silent,
) -> list[str]:
    """Write files of some kinds into `folder`, all of them or none; returns their names.

    Args:
        kinds: as of `save`, without the archive.
        keep: leave files that are there as they are, and write the others.
        force, progress: as of `save`.

    Raises:
        InputError: as of `save`, or a kind needs a package that is not installed. OutputError : as of `save`.
    """
    _require(archive, force, progress)
    flag("keep", keep)
    names = list[str]()
    wanted = wanted_kinds(kinds)
    with open_folder(folder, reserved=() if keep else reserved(wanted), force=force) as place:
        for name, content in files_of(archive, wanted):
            if keep and os.path.lexists(place.path / name):
                continue
            progress("files", f"{len(names) + 1} written, {name}", 0.0)
            place.put(name, content)
            names.append(name)
        place.commit(keep_others=True)
    return names


def files_of(archive: Archive, kinds: str | Iterable[str] | None = None) -> Files:
    """Names in the result's folder and contents of the files of some kinds, as of `save`.

    Raises:
        InputError: an unknown kind, or one that needs a package that is not installed.
    """
    for kind in wanted_kinds(kinds):
        yield from KINDS[kind](archive)


def reserved(kinds: str | Iterable[str] | None = None) -> list[str]:
    """Patterns (of `Path.glob`) of every name that `files_of` may give for some kinds, whatever the archive."""
    return [name for kind in wanted_kinds(kinds) for name in NAMES[kind]]


def in_words(folder: Path) -> tuple[list[str], list[str]]:
    """Of what `rodshell export` writes: what rodshell has written into a folder, and what it has not."""
    there = list(read_manifest(folder))
    patterns = {word: [name for kind in kinds for name in NAMES[kind]] for word, kinds in WORDS.items()}
    found = {word: any(fnmatch(name, each) for each in names for name in there) for word, names in patterns.items()}
    return [word for word in WORDS if found[word]], [word for word in WORDS if not found[word]]


def wanted_kinds(kinds: object, more: str = "") -> list[str]:
    """The kinds of files that are wanted.

    Args:
        kinds: one text such as "dxf, csv", in any case, or several kinds, maybe none; None: the default ones.
        more: the case's `drawings.files`: one text, of kinds in addition to the default ones.

    Raises:
        InputError: an unknown kind.
    """
    if kinds is None:
        try:
            kinds = [*DEFAULT, *(wanted_kinds(more) if more else ())]
        except InputError as fault:
            raise InputError(f"drawings.files = {shown(more)}: {fault}") from None
    if isinstance(kinds, str):
        kinds = [word.strip().lower() for word in kinds.split(",") if word.strip()] or [kinds]
    if not isinstance(kinds, Iterable) or getattr(kinds, "ndim", 1) == 0:
        raise InputError(f"kinds must be kinds of files, such as {', '.join(KINDS)}, not {described(kinds)}")
    return list(dict.fromkeys(each for kind in kinds for each in _known(kind)))


def _known(kind: object) -> tuple[str, ...]:
    """The kinds that a word names, of which no file belongs to two."""
    if not isinstance(kind, str) or kind not in (*KINDS, "all"):
        raise InputError(f"unknown kind of file {described(kind)}: use {', '.join(KINDS)}, or all")
    return {"all": ALL, "dxf": ("strips", "dxf")}.get(kind, (kind,))


def _require(archive: object, force: object, progress: object) -> None:
    if not isinstance(archive, Archive):
        raise InputError(
            f"archive must be a rodshell Archive, not {described(archive)}: a form is written with form.save, or give "
            "form.archive()"
        )
    flag("force", force)
    require_progress(progress)


def _dxf(archive: Archive, *, strips: bool = False) -> Files:
    """The drawing of the strips, or all the others."""
    from rodshell.output.dxf import drawing_dxf

    style = archive.results.drawings
    names = style.layers if style else None
    for name, drawing in drawing_set(archive).items():
        if (name == "strips") == strips:
            yield f"drawings/{name}.dxf", drawing_dxf(drawing, names)


def _svg(archive: Archive) -> Files:
    for name, svg in drawing_svgs(archive).items():
        yield f"drawings/{name}.svg", svg


def _pdf(archive: Archive) -> Files:
    from rodshell.output.pdf import drawings_pdf

    sheets, paper = sheet_set(archive)
    yield "drawings/drawings.pdf", drawings_pdf(sheets, paper, archive.name)


def _csv(archive: Archive) -> Files:
    for name, schedule in SCHEDULES.items():
        if schedule.known(archive):
            yield f"schedule/{name}.csv", table_csv(schedule.table(archive))


def _models(archive: Archive, suffix: str, make: Callable[[Archive, str], str | bytes], states: Iterable[str]) -> Files:
    for state in states:
        yield f"model/{state}.{suffix}", make(archive, state)


def _vtp(archive: Archive) -> Files:
    yield from _models(archive, "vtp", vtp_text, _meshed(archive, *shells_among(archive.states)))
    for name, text in time_series(archive):
        yield f"model/{name}", text


def _rhino(archive: Archive) -> Files:
    yield "model/rodshell.3dm", rhino_bytes(archive)


def _png(archive: Archive) -> Files:
    from rodshell.output.png import drawing_png

    for name in _meshed(archive, *(name for name in shape_names(archive) if name in ("flat", archive.final))):
        shape = shape_of(archive, name)
        if shape.gap is not None or "stress" not in shape.known:
            yield f"pictures/{name}.png", drawing_png(picture(archive, name, "gap"))
        if "stress" in shape.known:
            yield f"pictures/{name}-stress.png", drawing_png(picture(archive, name, "stress"))
    if {"history", "rod_nodes"} <= archive.states.keys():
        yield "pictures/pop_up.png", drawing_png(deployment_picture(archive))


def _meshed(archive: Archive, *states: str | None) -> list[str]:
    """Those of some states that are known; none where the nodes of each rod are not."""
    return [*filter(None, states)] if "rod_nodes" in archive.states else []


def _report(archive: Archive) -> Files:
    from rodshell.output.report import report_html

    yield "report.html", report_html(archive)


KINDS: dict[str, Callable[[Archive], Files]] = {
    "report": _report, "csv": _csv, "strips": partial(_dxf, strips=True), "dxf": _dxf, "svg": _svg, "pdf": _pdf,
    "obj": lambda archive: _models(archive, "obj", obj_text, shells_among(archive.states)),
    "gltf": lambda archive: _models(archive, "glb", glb_bytes, _meshed(archive, archive.final)),
    "vtp": _vtp,
    "compas": lambda archive: _models(archive, "json", compas_json, _meshed(archive, archive.final)),
    "png": _png, "3dm": _rhino, "opensees": opensees_files,
}  # fmt: skip
DEFAULT = ("report", "csv", "strips")
ALL = tuple(kind for kind in KINDS if kind not in ("3dm", "opensees"))  # one needs a package, both are for few
WORDS = {
    "report": ["report"], "schedules": ["csv"], "strips": ["strips"], "drawings": ["dxf", "svg"], "PDF": ["pdf"],
    "models": ["obj", "gltf", "vtp", "compas"], "pictures": ["png"],
}  # fmt: skip
"""What the kinds of `ALL` are called where a command says what it has written."""

_DRAWINGS = ("plan", "supports", "elevations", "bracing", "erection")
_STAGES = ("flat", "stage_[0-9]*", f"{POPPED}*")

_SHELLS = (DRAPED, f"{POPPED}*")

NAMES: dict[str, list[str]] = {
    "strips": ["drawings/strips.dxf"],
    "dxf": [f"drawings/{name}.dxf" for name in _DRAWINGS],
    "svg": [f"drawings/{name}.svg" for name in (*_DRAWINGS, "strips")],
    "pdf": ["drawings/drawings.pdf"],
    "csv": [f"schedule/{name}.csv" for name in SCHEDULES],
    "obj": [f"model/{state}.obj" for state in _SHELLS],
    "gltf": [f"model/{state}.glb" for state in _SHELLS],
    "vtp": [
        *(f"model/{state}.vtp" for state in _SHELLS), "model/pop_up.pvd",
        *(f"model/pop_up/{state}.vtp" for state in _STAGES),
    ],
    "compas": [f"model/{state}.json" for state in _SHELLS],
    "3dm": ["model/rodshell.3dm"],
    "opensees": [f"opensees/{POPPED}*.json", "opensees/replay.py"],
    "png": [
        *(f"pictures/{state}{what}.png" for state in ("flat", *_SHELLS) for what in ("", "-stress")),
        "pictures/pop_up.png",
    ],
    "report": ["report.html"],
}  # fmt: skip
"""Of the files of each kind: names that may conflict with files of others are checked before the work."""
