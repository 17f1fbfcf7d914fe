"""The content of result.json: reading with every value checked, older versions, writing, and the JSON Schema."""

import json
from collections.abc import Iterator, Mapping
from math import isfinite
from pathlib import Path
from typing import Any, Self

import numpy as np
from pydantic import Field, ValidationError

from rodshell.errors import OutputError
from rodshell.results.checked import (
    Bending,
    Contact,
    Deployment,
    Drawings,
    Fabrication,
    JointLoad,
    OtherShapes,
    Reactions,
    SelfWeight,
    Verdict,
)
from rodshell.results.records import (
    Agreement,
    ByEnds,
    Drape,
    Dropped,
    Flat,
    Joint,
    Layout,
    Net,
    Patch,
    Point,
    PopUp,
    Record,
    Rod,
    RodType,
    Rows,
    Seam,
    Target,
    Text,
    Whole,
    by_ends,
    key,
    printable,
    rows,
)

FORMAT = "rodshell-result"
VERSION = 2
SCHEMA = "https://json-schema.org/draft/2020-12/schema"


class Results(Record):
    """All that is known of a form, in SI; a table that is absent was not asked for or not found.

    `Results.of` reads a plain dictionary, `plain` gives it back.
    """

    format: Text = Field(default=FORMAT, description='"rodshell-result"')
    version: Whole = Field(default=VERSION, description="version of the keys")
    units: Text = Field(default="SI", description='"SI"')
    version_rodshell: Text | None = key("the rodshell that found it")
    versions: dict[str, Text] | None = key("versions of Python and of the numerical libraries")
    name: Text | None = key("name of the result")
    status: Text = Field(default="unknown", description='"converged", or which stage stopped')
    warnings: Rows[Text] = rows("sentences")
    target: Target | None = key("the target; absent for a table of rods")
    layout: Layout | None = key("the flat grid that was asked for")
    rod: RodType | None = key("section, material and stiffnesses of every rod")
    joint: Joint | None = key("what the rods do to each other where they cross")
    patches: Rows[Patch] = rows("patches of a shell that is cut along seams")
    seams: Rows[Seam] = rows("seams between patches")
    net: Net | None = key("the inextensible net")
    rods: Rows[Rod] = rows("the rods, cut to their supports")
    dropped: Rows[Dropped] = rows("rods of the layout that are not part of the grid")
    footprint: Rows[Flat] = rows("flat place of each rod's start and end in turn", "m")
    boundary: Rows[Point] = rows("place in space of each rod's start and end in turn", "m")
    end_tangents: Rows[Point] = rows("direction in which each of these rod ends points out of the shell")
    agreement: ByEnds[Agreement] = by_ends("gap to the target")
    drape: Drape | None = key("the rods laid on the target")
    pop_up: ByEnds[PopUp] = by_ends("the shell popped up from flat")
    bending: Bending | None = key("bending and stress")
    reactions: ByEnds[Reactions] = by_ends("forces and moments at the supports")
    joint_loads: ByEnds[tuple[JointLoad, ...]] = by_ends("what acts at the joints")
    self_weight: ByEnds[SelfWeight] = by_ends("how much of its own weight the shell bears")
    deployment: Deployment | None = key("the shell on its way from flat to popped up")
    contact: Contact | None = key("contact of rods with each other")
    other_shapes: ByEnds[OtherShapes] = by_ends("other stable shapes on the same supports")
    fabrication: Fabrication | None = key("how the rods are cut and braced")
    drawings: Drawings | None = key("what the drawings have in common")
    verdict: Verdict | None = key("what the result is worth")

    @classmethod
    def of(cls, content: Mapping[str, Any], *, source: str = "the result") -> Self:
        """Results from the plain content of a result.json of any version, every value checked.

        Parameters
        ----------
        content : dictionaries, lists, numbers and texts; NumPy's arrays and numbers will do.
        source : what messages call it.

        Raises
        ------
        OutputError : it is no such content; the sentence names the key.
        """
        return cls.from_text(json.dumps(plain(upgraded(content, source=source))), source=source)

    @classmethod
    def from_text(cls, text: str, *, source: str) -> Self:
        """Results from the text of a result.json of the present version; as `of`."""
        try:
            found = cls.model_validate_json(text)
        except ValidationError as error:
            raise OutputError(f"{source}: {_first_fault(error)}") from None
        for fault in contradictions(found):
            raise OutputError(f"{source}: {fault}")
        return found

    def text(self) -> str:
        """The text of result.json."""
        return json_text(self.plain())


def read_results(path: Path) -> Results:
    """The content of a result.json, every value checked.

    Raises
    ------
    OutputError : there is no such file, or it is no result that this version understands; the sentence names the key.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise OutputError(f"{path.parent} holds no rodshell result: it has no {path.name}") from error
    except (OSError, ValueError, RecursionError) as error:
        raise OutputError(f"cannot read {path}: {error}") from error
    if not isinstance(content, dict):
        raise OutputError(f"{path} is not a rodshell result: it is not a table of keys")
    return Results.from_text(json.dumps(upgraded(content, source=str(path))), source=str(path))


def upgraded(content: Mapping[str, Any], *, source: str) -> dict[str, Any]:
    """The content of a result.json with the keys of the present version.

    Until November 2026 the format was called gridshell-result. Version 2 renamed drape.own_ends to drape.net_deviation.

    Raises
    ------
    OutputError : another format, or a newer version.
    """
    content = dict(content)
    if content.get("format", FORMAT) not in (FORMAT, "gridshell-result"):
        raise OutputError(f'{source} is not a rodshell result: its "format" is not "{FORMAT}"')
    version = content.get("version", VERSION)
    if not isinstance(version, int) or isinstance(version, bool) or not 1 <= version <= VERSION:
        raise OutputError(f"{source} has version {version}, this rodshell reads 1 to {VERSION}: install a newer one")
    content |= {"format": FORMAT, "version": VERSION}
    if "version_gridshell" in content:
        content["version_rodshell"] = content.pop("version_gridshell")
    if version < 2:
        content["drape"] = _renamed(content.get("drape"), "own_ends", "net_deviation")
        patches = content.get("patches")
        if isinstance(patches, list):
            content["patches"] = [
                {**patch, "drape": _renamed(patch.get("drape"), "own_ends", "net_deviation")}
                if isinstance(patch, dict)
                else patch
                for patch in patches
            ]
        if content["drape"] is None:
            del content["drape"]
    return content


def _renamed(table: Any, old: str, new: str) -> Any:
    """A table with another name of a key."""
    if not isinstance(table, dict) or old not in table:
        return table
    return {new if name == old else name: value for name, value in table.items()}


def contradictions(results: Results) -> Iterator[str]:
    """What the records say against each other: rods that do not exist, and counts that do not agree.

    Parameters
    ----------
    results : whose values are each valid.
    """
    ids = [rod.id for rod in results.rods]
    known = set(ids)
    if len(known) < len(ids):
        twice = next(name for k, name in enumerate(ids) if name in ids[:k])
        yield f'rods: the id "{twice}" stands twice'
    for where, name in _named_rods(results):
        if name not in known:
            yield f'{where}: there is no rod "{name}"'
    ends = {f"{name}.{end}" for name in ids for end in (0, 1)}
    for k, seam in enumerate(results.seams):
        for j, meeting in enumerate(seam.meetings):
            for end in meeting.ends:
                if end not in ends:
                    yield f'seams[{k}].meetings[{j}].ends: there is no rod end "{end}"'
        for support, forces in seam.forces.items():
            if len(forces.each) != len(seam.meetings):
                where = f"seams[{k}].forces.{support}.each"
                yield f"{where} has {len(forces.each)} entries for {len(seam.meetings)} meetings"
    counts = {"footprint": results.footprint, "boundary": results.boundary, "end_tangents": results.end_tangents}
    for support, held in results.reactions.items():
        counts |= {f"reactions.{support}.forces": held.forces, f"reactions.{support}.moments": held.moments}
    for name, points in counts.items():
        if len(points) not in (0, 2 * len(ids)):
            yield f"{name} has {len(points)} points for {len(ids)} rods: there must be two for each"


def _named_rods(results: Results) -> Iterator[tuple[str, str]]:
    """Every place that names a rod, and the name."""
    for k, rod in enumerate(results.rods):
        yield from ((f"rods[{k}].joints[{j}].with", joint.other) for j, joint in enumerate(rod.joints))
    for support, loads in results.joint_loads.items():
        for k, load in enumerate(loads):
            yield from ((f"joint_loads.{support}[{k}].rods", name) for name in load.rods)
    bent = results.bending.shapes() if results.bending else {}
    yield from ((f"bending.{shape}.rod", worst.rod) for shape, worst in bent.items() if worst.rod is not None)
    for shape in ("pinned", "clamped", "deployment"):
        nearest = results.contact.of(shape) if results.contact else None
        yield from ((f"contact.{shape}.rods", name) for name in (nearest.rods if nearest else None) or ())


def json_schema() -> dict[str, Any]:
    """The JSON Schema of result.json: every key with its meaning and its unit."""
    return {"$schema": SCHEMA, **Results.model_json_schema(by_alias=True), "title": "rodshell result"}


def json_text(content: Mapping[str, Any]) -> str:
    """Plain content as strict JSON, a key or a rod on each line; what is not a finite number becomes null.

    Parameters
    ----------
    content : keys and values; NumPy's arrays and numbers will do.
    """
    lines = []
    for name, value in plain(content).items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            text = "[\n  " + ",\n  ".join(map(_dumps, value)) + "\n ]"
        else:
            text = _dumps(value)
        lines.append(f" {_dumps(name)}: {text}")
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _dumps(value: Any) -> str:
    return json.dumps(value, allow_nan=False, ensure_ascii=False)


def plain(value: Any) -> Any:
    """`value` in JSON's types; records, NumPy's arrays and numbers are converted, texts are printable.

    Parameters
    ----------
    value : dictionaries, sequences, arrays, records, numbers, texts.
    """
    if isinstance(value, float):  # most are; NumPy's float64 is one
        return float(value) if isfinite(value) else None
    if isinstance(value, str):
        return printable(value)
    if isinstance(value, Mapping):
        return {printable(str(name)): plain(item) for name, item in value.items()}
    if isinstance(value, Record):
        return value.plain()
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value


def _first_fault(error: ValidationError) -> str:
    """The first fault in a sentence that names its key as it stands in the file, "rods[3].joints[0].at"."""
    fault = error.errors(include_url=False)[0]
    where = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in fault["loc"]).lstrip(".")
    where = where or "the file"
    if fault["type"] == "missing":
        return f"{where} is missing"
    value = repr(fault["input"])
    shown = value if len(value) <= 40 else f"{value[:37]}..."
    return f"{where} cannot be {shown}: {_EXPECTED.get(fault['type'], fault['msg'])}"


_EXPECTED = {
    "float_type": "it must be a number",
    "finite_number": "it must be a finite number, or null where it is not known",
    "int_type": "it must be a whole number",
    "int_from_float": "it must be a whole number",
    "bool_type": "it must be true or false",
    "string_type": "it must be a text",
    "too_short": "it must not be empty",
    "tuple_type": "it must be a list",
    "dict_type": "it must be a table of keys",
    "model_type": "it must be a table of keys",
    "model_attributes_type": "it must be a table of keys",
}
