"""Every file that is made from an archive, by kind: what `rodshell export --only` may ask for.

Modules that need a library of one kind of file alone are imported when such a file is written.
"""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from shlex import quote
from warnings import warn

from rodshell.errors import InputError, OutOfTimeError, OutputWarning
from rodshell.output.drawing import Drawing
from rodshell.output.drawings import drawing_set, sheet_set
from rodshell.output.drawings.flat import FlatPlan, flat_plan
from rodshell.output.grid import shape_names, shape_of
from rodshell.output.models import compas_json, glb_bytes, obj_text, rhino_bytes, time_series, vtp_text
from rodshell.output.pictures import deployment_picture, picture
from rodshell.output.schedules import SCHEDULES, table_csv
from rodshell.output.svg import drawing_svg
from rodshell.progress import Progress, require_progress, silent
from rodshell.results.archive import Archive, archive_names, put_archive
from rodshell.results.folder import ResultFolder, open_folder
from rodshell.results.states import DRAPED, POPPED, shells_among
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
        content, left = Content(archive), list(wanted)
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
    def plan(self) -> FlatPlan:
        return flat_plan(self.archive)

    @cached_property
    def drawings(self) -> dict[str, Drawing]:
        return drawing_set(self.archive)

    @cached_property
    def svgs(self) -> dict[str, str]:
        return {name: drawing_svg(drawing) for name, drawing in self.drawings.items()}

    @property
    def meshed(self) -> bool:
        """Whether the nodes of each rod are known."""
        return "rod_nodes" in self.archive.states

    def models(self, suffix: str, make: Callable[[Archive, str], str | bytes], states: Iterable[str | None]) -> Files:
        """A file for each of some states that are known."""
        for state in filter(None, states):
            yield f"model/{state}.{suffix}", make(self.archive, state)


def files_of(archive: Archive, kinds: str | Iterable[str] | None = None) -> Files:
    """Names in the result's folder and contents of the files of some kinds, as of `save`.

    Raises:
        InputError: an unknown kind, or one that needs a package that is not installed.
    """
    content = Content(archive)
    for kind in wanted_kinds(kinds):
        yield from KINDS[kind](content)


def reserved(kinds: str | Iterable[str] | None = None) -> list[str]:
    """Patterns (of `Path.glob`) of every name that `files_of` may give for some kinds, whatever the archive."""
    return [name for kind in wanted_kinds(kinds) for name in NAMES[kind]]


def wanted_kinds(kinds: object) -> list[str]:
    """The kinds of files that are wanted.

    Args:
        kinds: one text such as "dxf, csv", in any case, or several kinds, maybe none; None: the default ones.

    Raises:
        InputError: an unknown kind.
    """
    if kinds is None:
        return list(DEFAULT)
    if isinstance(kinds, str):
        words = [word.strip().lower() for word in kinds.split(",") if word.strip()]
        return [_known(word) for word in words or [kinds]]
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
    from rodshell.output.pdf import drawings_pdf

    sheets, paper = sheet_set(content.archive)
    yield "drawings/drawings.pdf", drawings_pdf(sheets, paper, content.archive.name)


def _csv(content: Content) -> Files:
    for name, schedule in SCHEDULES.items():
        if schedule.known(content.archive):
            yield f"schedule/{name}.csv", table_csv(schedule.table(content.archive))


def _obj(content: Content) -> Files:
    return content.models("obj", obj_text, shells_among(content.archive.states))


def _gltf(content: Content) -> Files:
    return content.models("glb", glb_bytes, [content.archive.final] if content.meshed else [])


def _vtp(content: Content) -> Files:
    yield from content.models("vtp", vtp_text, shells_among(content.archive.states) if content.meshed else [])
    for name, text in time_series(content.archive):
        yield f"model/{name}", text


def _compas(content: Content) -> Files:
    return content.models("json", compas_json, [content.archive.final] if content.meshed else [])


def _rhino(content: Content) -> Files:
    yield "model/rodshell.3dm", rhino_bytes(content.archive, content.plan)


def _png(content: Content) -> Files:
    from rodshell.output.png import drawing_png

    archive = content.archive
    shown = [name for name in shape_names(archive) if name in ("flat", archive.final)]
    for name in shown if content.meshed else []:
        shape = shape_of(archive, name)
        if shape.gap is not None or shape.stress is None:
            yield f"pictures/{name}.png", drawing_png(picture(archive, name))
        if shape.stress is not None:
            yield f"pictures/{name}-stress.png", drawing_png(picture(archive, name, "stress"))
    if "history" in archive.states and content.meshed:
        yield "pictures/pop_up.png", drawing_png(deployment_picture(archive))


def _report(content: Content) -> Files:
    from rodshell.output.report import report_html

    yield "report.html", report_html(content.archive, content.plan, content.drawings, content.svgs)


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
