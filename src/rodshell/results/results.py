"""The content of result.json: all records of `rodshell.figures` in a whole, with every value checked.

`Results` reads the file of any version, writes it, and gives its JSON Schema.
"""

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence, Sized
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import numpy as np
from pydantic import FailFast, Field, ValidationError

from rodshell.errors import InputError, OutputError
from rodshell.figures import checks, form
from rodshell.figures.design import Design
from rodshell.figures.fabrication import Brace, Fabrication
from rodshell.figures.findings import Finding, Level, Tried
from rodshell.figures.loads import DesignStrength, LoadCases, LoadedShell
from rodshell.figures.records import (
    FARTHEST,
    SHORTEST,
    ByEnds,
    Ends,
    Flag,
    Flat,
    Number,
    Point,
    Record,
    Rows,
    Text,
    Whole,
    by_ends,
    far_apart,
    json_text,
    key,
    plain,
    printable,
    rows,
)
from rodshell.results.manifest import read_table
from rodshell.validation import instance, short

FORMAT = "rodshell-result"
VERSION = 2
SIZE = 25e6  # bytes of result.json; its content takes up to a hundred times that
SCHEMA = "https://json-schema.org/draft/2020-12/schema"


class Drawings(Record):
    """What the drawings have in common."""

    paper: Literal["A4", "A3", "A2", "A1", "A0"] = Field(default="A3", description="size of the PDF's sheets: A4 to A0")
    project: Text = Field(default="", description="name of the project")
    revision: Text = Field(default="", description="revision")
    tolerance: Number = key("to which lengths are to be kept", "m")
    layers: dict[Text, Text] = Field(default_factory=dict, description="other names of DXF layers")
    name: Text = Field(default="", description='name of the drawings; "": the target\'s')
    author: Text = Field(default="", description="author")
    date: Text = Field(default="", description='a day as "2026-11-22"; "": the day of writing')


LEVELS: dict[Level, str] = {"good": "Good", "check": "Check", "unbuildable": "Not buildable", "unknown": "Not known"}
"""The levels in words."""


if TYPE_CHECKING:  # a type checker sees the fields
    from pydantic._internal._model_construction import ModelMetaclass as _Refusing
else:

    class _Refusing(type(Record)):
        """What makes records in Python: a value that cannot be used is refused in a sentence, as everywhere."""

        def __call__(cls, **values):
            try:
                return super().__call__(**values)
            except ValidationError as error:
                raise InputError(f"{cls.__name__}: {_first_fault(error)}") from None
            except RecursionError:
                raise InputError(f"{cls.__name__}: a value contains itself: give plain ones") from None


class Verdict(Record, metaclass=_Refusing):
    """What a result is worth."""

    level: Level = Field(
        description='"good": it pops up, stands under its own weight and can be built; "check": something has to be '
        'checked first; "unbuildable": no end condition gives a shell that can be built; "unknown": no shell was '
        "computed, as where the computation did not converge, or one that might be built was not"
    )
    unloaded: Flag | None = key("true: of no loads but the shell's own weight; absent where loads were checked")
    reasons: Annotated[tuple[Text, ...], FailFast()] = Field(min_length=1, description="sentences, the gravest first")
    findings: Rows[Finding] = rows("what each of these sentences says, as data; empty in results of earlier versions")

    @property
    def headline(self) -> str:
        """The first sentence, after the level in words; of a shell without loads these say that it is unloaded."""
        return f"{LEVELS[self.level]}{', unloaded' if self.unloaded else ''}: {self.reasons[0]}"


# The whole


class Results(Record, metaclass=_Refusing):
    """All that is known of a form, in SI; a table that is absent was not asked for or not found.

    `Results.of` reads a plain dictionary, `plain` gives it back.
    """

    format: Text = Field(default=FORMAT, description='"rodshell-result"')
    version: Whole = Field(default=VERSION, description="version of the keys")
    units: Text = Field(default="SI", description='"SI"')
    version_rodshell: Text | None = key("the rodshell that found it")
    versions: dict[Text, Text] | None = key("versions of Python and of the numerical libraries")
    name: Text | None = key("name of the result")
    status: Text = Field(default="unknown", description='"converged", or which stage stopped')
    warnings: Rows[Text] = rows("sentences")
    target: form.Target | None = key("the target; absent for a table of rods")
    layout: form.Layout | None = key("the flat grid that was asked for")
    rod: form.RodType | None = key("section, material and stiffnesses of every rod")
    joint: form.Joint | None = key("what the rods do to each other where they cross")
    patches: Rows[form.Patch] = rows("patches of a shell that is cut along seams")
    seams: Rows[form.Seam] = rows("seams between patches")
    net: form.Net | None = key("the inextensible net")
    rods: Rows[form.Rod] = rows("the rods, cut to their supports")
    crossings_without_joint: Whole | None = key("where rods pass each other too near to an end for a joint, a count")
    dropped: Rows[form.Dropped] = rows("rods of the layout that are not part of the grid")
    flat_state: form.FlatState | None = key("the rods in the plane, where that is not a straight lattice")
    footprint: Rows[Flat] = rows("flat place of each rod's start and end in turn", "m")
    boundary: Rows[Point] = rows("place in space of each rod's start and end in turn", "m")
    end_tangents: Rows[Point] = rows("direction in which each of these rod ends points out of the shell")
    edge_beams: Rows[form.EdgeBeam] = rows("beams along the edge")
    agreement: ByEnds[form.Agreement] = by_ends("gap to the target")
    drape: form.Drape | None = key("the rods laid on the target")
    pop_up: ByEnds[form.PopUp] = by_ends("the shell popped up from flat")
    refinement: form.Refinement | None = key("how the form was refined; absent where that was not asked for")
    bending: checks.Bending | None = key("bending and stress")
    reactions: ByEnds[checks.Reactions] = by_ends("forces and moments at the supports")
    joint_loads: ByEnds[Rows[checks.JointLoad]] = by_ends("what acts at the joints")
    ends_in_the_air: checks.EndsInTheAir | None = key("rod ends that may not stand on the ground")
    self_weight: ByEnds[checks.SelfWeight] = by_ends("how much of its own weight the shell carries")
    snow: ByEnds[Number] = by_ends(
        "uniform snow on the plan that the unbraced shell carries on top of its weight [Pa]; null: above 10 kPa"
    )
    strength: DesignStrength | None = key("design strengths, by which the rods are judged")
    loads: LoadCases = Field(default_factory=dict, description="the shell under loads, by combination and ends")
    design: Design | None = key("how loads decided section, bracing and spacing; absent where that was not asked for")
    deployment: checks.Deployment | None = key("the shell from flat to popped up")
    contact: checks.Contact | None = key("contact of rods with each other")
    other_shapes: ByEnds[checks.OtherShapes] = by_ends("other stable shapes on the same supports")
    fabrication: Fabrication | None = key("how the rods are cut and braced")
    drawings: Drawings | None = key("what the drawings have in common")
    verdict: Verdict | None = key("what the result is worth")
    advice: Rows[Tried] = rows("what came of the verdict's offers that `rodshell advise` has tried")

    @classmethod
    def of(cls, content: Mapping[str, Any], *, source: str = "the result") -> Self:
        """Results from the plain content of a result.json of any version, every value checked.

        Args:
            content: dictionaries, lists, numbers and texts; NumPy's arrays and numbers are converted.

        Raises:
            InputError: not a mapping. OutputError : the content is not valid; the sentence names the key.
        """
        instance("content", content, Mapping, "a mapping, as result.json holds one")
        try:
            return cls.from_text(json.dumps(plain(upgraded(content, source=source))), source=source)
        except RecursionError:
            raise InputError(f"{source} contains itself: give plain tables, lists, numbers and texts") from None

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

    @property
    def bracing(self) -> tuple[Brace, ...]:
        """All diagonals; none where there is no fabrication."""
        return self.fabrication.bracing if self.fabrication else ()

    @property
    def rod_ends(self) -> list[str]:
        """Names of the start and the end of each rod in turn: "U01.0", "U01.1"."""
        return [f"{rod.id}.{end}" for rod in self.rods for end in (0, 1)]

    def loaded_shells(self) -> Iterator[tuple[str, Ends, LoadedShell]]:
        """Every combination of loads with each end condition, and the shell under it."""
        return ((name, ends, shell) for name, found in self.loads.items() for ends, shell in found.items())


def read_results(path: Path) -> Results:
    """The content of a result.json, every value checked.

    Raises:
        OutputError: there is no such file, or this version cannot read it; the sentence names the key.
    """
    if not path.exists():
        raise OutputError(f"{path.parent} holds no rodshell result: it has no {path.name}")
    content = read_table(path, SIZE)
    return Results.from_text(json.dumps(upgraded(content, source=str(path))), source=str(path))


def upgraded(given: Mapping[str, Any], *, source: str) -> dict[str, Any]:
    """The content of a result.json of any version with the keys of the present one.

    Until November 2026 the format was called gridshell-result. Version 2 renamed drape.own_ends to drape.net_deviation.

    Raises:
        OutputError: another format, or a newer version.
    """
    content = dict(given)
    if content.get("format", FORMAT) not in (FORMAT, "gridshell-result"):
        raise OutputError(f'{source} is not a rodshell result: its "format" is not "{FORMAT}"')
    version = content.get("version", VERSION)
    if not isinstance(version, int) or isinstance(version, bool) or not 1 <= version <= VERSION:
        raise OutputError(
            f"{source} has version {printable(str(version)):.20}, this rodshell reads 1 to {VERSION}: "
            "install a newer one"
        )
    content |= {"format": FORMAT, "version": VERSION}
    if "version_gridshell" in content:
        content["version_rodshell"] = content.pop("version_gridshell")
    if version < 2:
        content = _with_net_deviation(content)
        if isinstance(patches := content.get("patches"), list):
            content["patches"] = [_with_net_deviation(patch) for patch in patches]
    return content


def _with_net_deviation(part: Any) -> Any:
    """A form or a patch whose drape has that name in place of the one that it had before version 2."""
    drape = part.get("drape") if isinstance(part, dict) else None
    if not isinstance(drape, dict):
        return part
    return part | {"drape": {"net_deviation" if name == "own_ends" else name: drape[name] for name in drape}}


def contradictions(results: Results) -> Iterator[str]:
    """What the records say against each other: rods that do not exist, and counts that do not agree."""
    ids = [rod.id for rod in results.rods]
    known = set(ids)
    if len(known) < len(ids):
        yield f'rods: the id "{Counter(ids).most_common(1)[0][0]}" occurs twice'
    for k, rod in enumerate(results.rods):
        lengths = [length for length in (rod.end - rod.start, rod.length, rod.cut_length) if length is not None]
        at = [rod.start, rod.end, rod.offset or 0.0, *rod.splices, *(joint.at for joint in rod.joints), *lengths]
        at += [joint.slot for joint in rod.joints if joint.slot is not None]
        if min(lengths) < SHORTEST or max(map(abs, at)) > FARTHEST:
            yield f"rods[{k}] has a length that is not from {SHORTEST:g} to {FARTHEST:g} m"
    section = results.rod.section if results.rod else None
    sizes = [getattr(section, name, None) for name in ("radius", "width", "height", "a", "b")]
    sizes += [results.fabrication.slot_depth] if results.fabrication else []
    if not all(size is None or 0 <= size <= FARTHEST for size in sizes):
        yield f"rod.section or fabrication.slot_depth has a length that is not from 0 to {FARTHEST:g} m"
    for name, points in _places(results):
        placed = [point for point in points if None not in point]
        if placed and (fault := far_apart(np.array(placed))):
            yield f"{name} holds {fault}"
        if len(placed) < len(points):
            yield f"{name} holds a point that is not known"
    for where, name in _named_rods(results):
        if name not in known:
            yield f'{where}: there is no rod "{name}"'
    ends = set(results.rod_ends)
    for k, seam in enumerate(results.seams):
        for j, meeting in enumerate(seam.meetings):
            for end in meeting.ends:
                if end not in ends:
                    yield f'seams[{k}].meetings[{j}].ends: there is no rod end "{end}"'
        for support, forces in seam.forces.items():
            if len(forces.each) != len(seam.meetings):
                where = f"seams[{k}].forces.{support}.each"
                yield f"{where} has {len(forces.each)} entries for {len(seam.meetings)} meetings"
    for k, beam in enumerate(results.edge_beams):
        for end in set(beam.ends) - ends:
            yield f'edge_beams[{k}].ends: there is no rod end "{end}"'
    counts: dict[str, Sized] = {name: getattr(results, name) for name in ("footprint", "boundary", "end_tangents")}
    for support, held in results.reactions.items():
        counts |= {f"reactions.{support}.forces": held.forces, f"reactions.{support}.moments": held.moments}
    for name, support, loaded in results.loaded_shells():
        where, braces = f"loads.{name}.{support}", len(results.bracing)
        counts |= {f"{where}.reactions": loaded.reactions, f"{where}.support_forces": loaded.support_forces}
        counts[f"{where}.support_moments"] = loaded.support_moments
        if len(loaded.bracing) not in (0, braces):
            yield f"{where}.bracing has {len(loaded.bracing)} entries for {braces} braces"
    needed = [name for name in counts if name.startswith("reactions.") or name.endswith("support_forces")]
    for name, entries in counts.items():
        if len(entries) not in (2 * len(ids), *([] if name in needed else [0])):
            yield f"{name} has {len(entries)} points for {len(ids)} rods: there must be two for each"
    if results.loads and not results.boundary:
        yield "there are loads, but no boundary"


def _places(results: Results) -> Iterator[tuple[str, Sequence[Sequence[float | None]]]]:
    """Points that are drawn, by the key of each list."""
    yield from (("footprint", results.footprint), ("boundary", results.boundary))
    for k, seam in enumerate(results.seams):
        yield f"seams[{k}].points", seam.points
        yield f"seams[{k}].meetings", [meeting.point for meeting in seam.meetings]
    for ends, agreement in results.agreement.items():
        if agreement.where is not None:
            yield f"agreement.{ends}.where", [agreement.where]


def _named_rods(results: Results) -> Iterator[tuple[str, str]]:
    """Every place that names a rod, and the name."""
    for k, rod in enumerate(results.rods):
        yield from ((f"rods[{k}].joints[{j}].with", joint.other) for j, joint in enumerate(rod.joints))
    for support, loads in results.joint_loads.items():
        for k, load in enumerate(loads):
            yield from ((f"joint_loads.{support}[{k}].rods", name) for name in load.rods)
    bent = results.bending.shapes() if results.bending else {}
    yield from ((f"bending.{shape}.rod", worst.rod) for shape, worst in bent.items() if worst.rod is not None)
    for name, support, loaded in results.loaded_shells():
        for what, where in (("governs", loaded.governs), ("euler_at", loaded.euler_at)):
            if where is not None:
                yield f"loads.{name}.{support}.{what}.rod", where.rod
    for shape, nearest in results.contact.shapes().items() if results.contact else ():
        yield from ((f"contact.{shape}.rods", name) for name in nearest.rods or ())


def json_schema() -> dict[str, Any]:
    """The JSON Schema of result.json: every key with its meaning and its unit."""
    return {"$schema": SCHEMA, **Results.model_json_schema(by_alias=True), "title": "rodshell result"}


def _first_fault(error: ValidationError) -> str:
    """The first fault in a sentence that names its key as it stands in the file, "rods[3].joints[0].at"."""
    fault = error.errors(include_url=False)[0]
    parts = (part for part in fault["loc"] if part not in ("(table)", "(other)"))  # which kind a `TableOr` was read as
    where = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in parts).lstrip(".")
    where = printable(where)[:200] or "the file"
    if fault["type"] == "missing":
        return f"{where} is missing"
    expected = _EXPECTED.get(fault["type"], "") % fault.get("ctx", {})
    return f"{where} cannot be {short(fault['input'])}: {expected or fault['msg'].removeprefix('Value error, ')}"


_EXPECTED = {
    "float_type": "it must be a number",
    "greater_than_equal": "it must be a number from %(ge)g",
    "less_than_equal": "it must be a number up to %(le)g",
    "finite_number": "it must be a finite number, or null where it is not known",
    **dict.fromkeys(("int_type", "int_from_float"), "it must be a whole number"),
    "bool_type": "it must be true or false",
    "string_type": "it must be a text",
    "too_short": "it must not be empty",
    "tuple_type": "it must be a list",
    **dict.fromkeys(("dict_type", "model_type", "model_attributes_type"), "it must be a table of keys"),
}
