"""Every file that is made from an archive, by kind: what `rodshell export --only` may ask for."""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING
from warnings import warn

from rodshell.errors import InputError, OutOfTimeError, OutputWarning
from rodshell.output.schedules import SCHEDULES, table_csv
from rodshell.progress import Progress, require_progress, silent
from rodshell.results.archive import Archive, archive_names, put_archive
from rodshell.results.folder import ResultFolder, open_folder
from rodshell.results.states import DRAPED, POPPED, shells_among
from rodshell.validation import described, flag, instance, mapping

if TYPE_CHECKING:
    from rodshell.output.drawing import Drawing
    from rodshell.output.drawings.flat import FlatPlan

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
        kinds: of files in addition to the archive (see `KINDS`), or one text such as "dxf, csv"; default: all but 3dm.
        force: also replace files that rodshell did not write, or that were changed since, where it has to write.
        progress: called for each kind of files; where it raises OutOfTimeError the archive is written and the kinds
            that are left are not, with a warning that names them.

    Raises:
        InputError: an unknown kind, or a form in place of its archive. ForeignFileError : such files are there, and
            `force` is False. OutputError : the folder cannot be written.
    """
    _require_archive(archive)
    flag("force", force)
    require_progress(progress)
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
        content, left = Content(archive), list(DEFAULT if wanted is None else wanted)
        with suppress(OutOfTimeError):
            while left:
                progress("files", left[0], 0.0)
                for name, made in KINDS[left[0]](content):
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
    kinds: str | Iterable[str] | None = None,
    *,
    force: bool = False,
    progress: Progress = silent,
) -> list[str]:
    """Write files of some kinds into `folder`, all of them or none; returns their names.

    Args:
        kinds: as of `save`, without the archive.
        force, progress: as of `save`.

    Raises:
        InputError: as of `save`, or a kind needs a package that is not installed. OutputError : as of `save`.
    """
    _require_archive(archive)
    flag("force", force)
    require_progress(progress)
    names = list[str]()
    wanted = wanted_kinds(kinds)
    with open_folder(folder, reserved=reserved(wanted), force=force) as place:
        for name, content in files_of(archive, wanted):
            progress("files", f"{len(names) + 1} written, {name}", 0.0)
            place.put(name, content)
            names.append(name)
        place.commit(keep_others=True)
    return names


@dataclass(frozen=True)
class Content:
    """An archive, and what several kinds of files are made from."""

    archive: Archive

    @cached_property
    def plan(self) -> "FlatPlan":
        from rodshell.output.drawings.flat import flat_plan

        return flat_plan(self.archive)

    @cached_property
    def drawings(self) -> "dict[str, Drawing]":
        from rodshell.output.drawings import drawing_set

        return drawing_set(self.archive)

    @cached_property
    def svgs(self) -> dict[str, str]:
        from rodshell.output.svg import drawing_svg

        return {name: drawing_svg(drawing) for name, drawing in self.drawings.items()}


def files_of(archive: Archive, kinds: Iterable[str] | None = None) -> Files:
    """Names in the result's folder and contents of the files of some kinds; default: all but 3dm.

    Args:
        kinds: of files, keys of `KINDS`; default: all but 3dm.

    Raises:
        InputError: an unknown kind, or one that needs a package that is not installed.
    """
    content = Content(archive)
    for kind in DEFAULT if kinds is None else kinds:
        yield from KINDS[kind](content)


def reserved(kinds: Iterable[str] | None = None) -> list[str]:
    """Patterns (of `Path.glob`) of every name that `files_of` may give for some kinds, whatever the archive.

    Args:
        kinds: see `KINDS`; default: all but 3dm.
    """
    return [name for kind in (DEFAULT if kinds is None else kinds) for name in NAMES[kind]]


def read_kinds(words: str) -> list[str]:
    """The kinds named in "dxf, csv".

    Args:
        words: in any case, with commas.
    """
    kinds = [word.strip().lower() for word in words.split(",") if word.strip()]
    return [_known(word) for word in kinds or [words]]


def wanted_kinds(kinds: object) -> list[str] | None:
    """The kinds of files that are wanted, None for the default ones.

    Args:
        kinds: one text, as of `read_kinds`, or several kinds, maybe none.

    Raises:
        InputError: an unknown kind.
    """
    if kinds is None:
        return None
    if isinstance(kinds, str):
        return read_kinds(kinds)
    if not isinstance(kinds, Iterable) or getattr(kinds, "ndim", 1) == 0:
        raise InputError(f"kinds must be kinds of files, such as {', '.join(KINDS)}, not {described(kinds)}")
    return [_known(kind) for kind in kinds]


def _known(kind: object) -> str:
    if not isinstance(kind, str) or kind not in KINDS:
        raise InputError(f"unknown kind of file {described(kind)}: use {', '.join(KINDS)}")
    return kind


def _require_archive(value: object) -> None:
    if not isinstance(value, Archive):
        raise InputError(
            f"archive must be a rodshell Archive, not {described(value)}: a form is written with form.save, or give "
            "form.archive()"
        )


def _dxf(content: Content) -> Files:
    from rodshell.output.dxf import drawing_dxf

    style = content.archive.results.drawings
    names = style.layers if style else None
    for name, drawing in content.drawings.items():
        yield f"drawings/{name}.dxf", drawing_dxf(drawing, names)


def _svg(content: Content) -> Files:
    for name, svg in content.svgs.items():
        yield f"drawings/{name}.svg", svg


def _pdf(content: Content) -> Files:
    from rodshell.output.drawings import sheet_set
    from rodshell.output.pdf import drawings_pdf

    sheets, paper = sheet_set(content.archive)
    yield "drawings/drawings.pdf", drawings_pdf(sheets, paper, content.archive.name)


def _csv(content: Content) -> Files:
    for name, schedule in SCHEDULES.items():
        if schedule.known(content.archive):
            yield f"schedule/{name}.csv", table_csv(schedule.table(content.archive))


def _obj(content: Content) -> Files:
    from rodshell.output.models import obj_text

    archive = content.archive
    for state in _shells(archive):
        yield f"model/{state}.obj", obj_text(archive, state)


def _gltf(content: Content) -> Files:
    from rodshell.output.models import glb_bytes

    archive = content.archive
    if archive.final and _meshed(archive):
        yield f"model/{archive.final}.glb", glb_bytes(archive, archive.final)


def _vtp(content: Content) -> Files:
    from rodshell.output.models import time_series, vtp_text

    archive = content.archive
    for state in _shells(archive) if _meshed(archive) else []:
        yield f"model/{state}.vtp", vtp_text(archive, state)
    for name, text in time_series(archive):
        yield f"model/{name}", text


def _compas(content: Content) -> Files:
    from rodshell.output.models import compas_json

    archive = content.archive
    if archive.final and _meshed(archive):
        yield f"model/{archive.final}.json", compas_json(archive, archive.final)


def _rhino(content: Content) -> Files:
    from rodshell.output.models import rhino_bytes

    yield "model/rodshell.3dm", rhino_bytes(content.archive, content.plan)


def _png(content: Content) -> Files:
    from rodshell.output.grid import shape_names, shape_of
    from rodshell.output.pictures import deployment_picture, picture
    from rodshell.output.png import drawing_png

    archive = content.archive
    shown = [name for name in shape_names(archive) if name in ("flat", archive.final)]
    for name in shown if _meshed(archive) else []:
        shape = shape_of(archive, name)
        if shape.gap is not None or shape.stress is None:
            yield f"pictures/{name}.png", drawing_png(picture(archive, name))
        if shape.stress is not None:
            yield f"pictures/{name}-stress.png", drawing_png(picture(archive, name, "stress"))
    if "history" in archive.states and _meshed(archive):
        yield "pictures/pop_up.png", drawing_png(deployment_picture(archive))


def _report(content: Content) -> Files:
    from rodshell.output.report import report_html

    yield "report.html", report_html(content.archive, content.plan, content.drawings, content.svgs)


def _shells(archive: Archive) -> list[str]:
    return shells_among(archive.states)


def _meshed(archive: Archive) -> bool:
    """Whether the archive knows the nodes of each rod."""
    return "rod_nodes" in archive.states


KINDS: dict[str, Callable[[Content], Files]] = {
    "dxf": _dxf, "svg": _svg, "pdf": _pdf, "csv": _csv, "obj": _obj, "gltf": _gltf, "vtp": _vtp, "compas": _compas,
    "3dm": _rhino, "png": _png, "report": _report,
}  # fmt: skip
DEFAULT = tuple(kind for kind in KINDS if kind != "3dm")  # it needs another package

_DRAWINGS = ("plan", "strips", "supports", "elevations", "bracing", "erection")
_STAGES = ("flat", "stage_[0-9]*", f"{POPPED}*")

_SHELLS = (DRAPED, f"{POPPED}*")

NAMES: dict[str, list[str]] = {
    "dxf": [f"drawings/{name}.dxf" for name in _DRAWINGS],
    "svg": [f"drawings/{name}.svg" for name in _DRAWINGS],
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
    "png": [
        *(f"pictures/{state}{what}.png" for state in ("flat", *_SHELLS) for what in ("", "-stress")),
        "pictures/pop_up.png",
    ],
    "report": ["report.html"],
}  # fmt: skip
"""Of the files of each kind: names that may conflict with files of others are checked before the work."""
