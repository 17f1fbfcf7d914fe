"""Every file that is made from an archive, by kind: what `rodshell export --only` may ask for."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from rodshell.errors import InputError
from rodshell.output.archive import SHELLS, Archive
from rodshell.output.plan import FlatPlan, flat_plan

if TYPE_CHECKING:
    from rodshell.output.drawing import Drawing

Files = Iterator[tuple[str, str | bytes]]


@dataclass(frozen=True)
class Content:
    """An archive, and what several kinds of files are made from."""

    archive: Archive

    @cached_property
    def plan(self) -> FlatPlan:
        return flat_plan(self.archive)

    @cached_property
    def drawings(self) -> "dict[str, Drawing]":
        from rodshell.output.drawings import drawing_set

        return drawing_set(self.archive, self.plan)


def files_of(archive: Archive, kinds: Iterable[str] | None = None) -> Files:
    """Names in the result's folder and contents of the files of some kinds; default: all that every installation can.

    Raises
    ------
    InputError : an unknown kind, or one that needs a package that is not installed.
    """
    content = Content(archive)
    for kind in DEFAULT if kinds is None else kinds:
        yield from KINDS[kind](content)


def reserved(kinds: Iterable[str] | None = None) -> list[str]:
    """Patterns (of `Path.glob`) of every name that `files_of` may give for some kinds, whatever the archive."""
    return [name for kind in (DEFAULT if kinds is None else kinds) for name in NAMES[kind]]


def read_kinds(words: str) -> list[str]:
    """The kinds named in "dxf, csv"."""
    kinds = [word.strip().lower() for word in words.split(",") if word.strip()]
    unknown = [word for word in kinds if word not in KINDS]
    if unknown or not kinds:
        raise InputError(f'"{unknown[0] if unknown else words}" is no kind of file: use {", ".join(KINDS)}')
    return kinds


def _dxf(content: Content) -> Files:
    from rodshell.output.dxf import drawing_dxf

    names = (content.archive.result.get("drawings") or {}).get("layers")
    for name, drawing in content.drawings.items():
        yield f"drawings/{name}.dxf", drawing_dxf(drawing, names)


def _svg(content: Content) -> Files:
    from rodshell.output.svg import drawing_svg

    for name, drawing in content.drawings.items():
        yield f"drawings/{name}.svg", drawing_svg(drawing)


def _pdf(content: Content) -> Files:
    from rodshell.output.drawings import sheet_set
    from rodshell.output.pdf import drawings_pdf

    sheets, paper = sheet_set(content.archive, content.plan)
    yield "drawings/drawings.pdf", drawings_pdf(sheets, paper, content.archive.name)


def _csv(content: Content) -> Files:
    from rodshell.output import schedules
    from rodshell.output.csvtext import csv_text

    archive = content.archive
    made = archive.result.get("fabrication") or {}
    tables: dict[str, Callable[[Archive], schedules.Table]] = {
        "rods": schedules.rods_table,
        "joints": schedules.joints_table,
        "supports": schedules.supports_table,
    }
    tables |= {"bracing": schedules.bracing_table} if made.get("bracing") else {}
    tables |= {"stock": schedules.stock_table} if made.get("stock") else {}
    tables |= {"seams": schedules.seams_table} if archive.result.get("seams") else {}
    tables |= {"end_paths": schedules.end_paths_table} if "history" in archive.states else {}
    for name, table in tables.items():
        columns, rows = table(archive)
        yield f"schedule/{name}.csv", csv_text([columns, *rows])


def _obj(content: Content) -> Files:
    from rodshell.output.models.obj import obj_text

    archive = content.archive
    for state in _shells(archive):
        yield f"model/{state}.obj", obj_text(archive, state)


def _gltf(content: Content) -> Files:
    from rodshell.output.models.gltf import glb_bytes

    archive = content.archive
    if archive.final and _meshed(archive):
        yield f"model/{archive.final}.glb", glb_bytes(archive, archive.final)


def _vtp(content: Content) -> Files:
    from rodshell.output.models.vtk import time_series, vtp_text

    archive = content.archive
    for state in _shells(archive) if _meshed(archive) else []:
        yield f"model/{state}.vtp", vtp_text(archive, state)
    for name, text in time_series(archive):
        yield f"model/{name}", text


def _compas(content: Content) -> Files:
    from rodshell.output.models.compas import compas_json

    archive = content.archive
    if archive.final and _meshed(archive):
        yield f"model/{archive.final}.json", compas_json(archive, archive.final)


def _rhino(content: Content) -> Files:
    from rodshell.output.models.rhino import rhino_bytes

    yield "model/rodshell.3dm", rhino_bytes(content.archive, content.plan)


def _png(content: Content) -> Files:
    from rodshell.output.pictures import picture
    from rodshell.output.png import drawing_png
    from rodshell.output.shapes import shape_names, shape_of

    archive = content.archive
    for name in shape_names(archive) if _meshed(archive) else []:
        shape = shape_of(archive, name)
        if shape.gap is not None or shape.stress is None:
            yield f"pictures/{name}.png", drawing_png(picture(archive, name))
        if shape.stress is not None:
            yield f"pictures/{name}-stress.png", drawing_png(picture(archive, name, "stress"))


def _report(content: Content) -> Files:
    from rodshell.output.report import report_html

    yield "report.html", report_html(content.archive, content.plan, content.drawings)


def _shells(archive: Archive) -> list[str]:
    return [state for state in SHELLS if state in archive.states]


def _meshed(archive: Archive) -> bool:
    """Whether the archive knows which nodes belong to which rod."""
    return "rod_nodes" in archive.states


KINDS: dict[str, Callable[[Content], Files]] = {
    "dxf": _dxf, "svg": _svg, "pdf": _pdf, "csv": _csv, "obj": _obj, "gltf": _gltf, "vtp": _vtp, "compas": _compas,
    "3dm": _rhino, "png": _png, "report": _report,
}  # fmt: skip
DEFAULT = tuple(kind for kind in KINDS if kind != "3dm")  # which needs another package

_DRAWINGS = ("plan", "strips", "supports", "elevations", "bracing", "erection")
_SCHEDULES = ("rods", "joints", "supports", "bracing", "stock", "seams", "end_paths")
_STAGES = ("flat", "stage_[0-9]*", "popped_pinned")

NAMES: dict[str, list[str]] = {
    "dxf": [f"drawings/{name}.dxf" for name in _DRAWINGS],
    "svg": [f"drawings/{name}.svg" for name in _DRAWINGS],
    "pdf": ["drawings/drawings.pdf"],
    "csv": [f"schedule/{name}.csv" for name in _SCHEDULES],
    "obj": [f"model/{state}.obj" for state in SHELLS],
    "gltf": [f"model/{state}.glb" for state in SHELLS],
    "vtp": [
        *(f"model/{state}.vtp" for state in SHELLS), "model/pop_up.pvd",
        *(f"model/pop_up/{state}.vtp" for state in _STAGES),
    ],
    "compas": [f"model/{state}.json" for state in SHELLS],
    "3dm": ["model/rodshell.3dm"],
    "png": [f"pictures/{state}{what}.png" for state in (*SHELLS, *_STAGES) for what in ("", "-stress")],
    "report": ["report.html"],
}  # fmt: skip
"""Of the files of each kind: what may stand in the way of a result is asked before the work."""
