"""The keys of the case file in a row, read off its tables, for command-line options; and what is wrong with a key, in
one sentence: the key, its value, and what is accepted."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import cache
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from rodshell.case.case import Case
from rodshell.case.load_tables import AnyLoad, CombinationTable
from rodshell.case.stage_tables import IDLE, PatchTable
from rodshell.case.values import FileToRead, Table
from rodshell.units import shown
from rodshell.validation import either, not_a_choice

BY_KIND: dict[str, str] = {
    "target": "hemisphere",
    "rod.section": "auto",
    "joint": "ball",
    "bracing": "none",
    "bracing.section": "circle",
}
"""Tables whose `kind` decides which keys they have, and the kind that they are by default."""

ROWS: dict[str, tuple[str, tuple[type[Table], ...], str]] = {
    "seams.patches": ("patch", (PatchTable,), '[{ name = "B", rotate = "10 deg" }]'),
    "loads": ("load", get_args(AnyLoad), '[{ name = "snow", kind = "snow", value = "0.5 kN/m2" }]'),
    "combinations": ("combination", (CombinationTable,), '[{ name = "winter", factors = { snow = 1.5 } }]'),
}
"""Keys that hold tables in a row, what one of them is called, the tables that these may be, and an example."""


@dataclass(frozen=True)
class CaseKey:
    """One key of the case file.

    Parameters
    ----------
    path : dotted, such as "target.radius".
    kinds : of the table that has the key, where not every kind has it.
    choices : the words that it may take, where it is a choice.
    any_value : whether it may take values other than these words.
    reads_file : whether it names a file.
    """

    path: str
    help: str
    kinds: tuple[str, ...] = ()
    choices: tuple[str, ...] = ()
    any_value: bool = True
    reads_file: bool = False

    @property
    def table(self) -> str:
        return self.path.rpartition(".")[0]

    @property
    def name(self) -> str:
        return self.path.rpartition(".")[2]


@cache
def case_keys() -> dict[str, CaseKey]:
    """All keys of the case file by their dotted path, in its order."""
    keys = dict[str, CaseKey]()
    for key in _keys_of(Case, ""):
        known = keys.get(key.path)
        if known:
            choices, any_value = (*known.choices, *key.choices), known.any_value or key.any_value
            kinds = known.kinds + key.kinds
            key = replace(known, kinds=kinds, choices=tuple(dict.fromkeys(choices)), any_value=any_value)
        keys[key.path] = key
    return keys


def file_keys() -> dict[str, tuple[str, ...]]:
    """The keys that name files to be read, by their table."""
    found = dict[str, tuple[str, ...]]()
    for key in case_keys().values():
        if key.reads_file:
            found[key.table] = (*found.get(key.table, ()), key.name)
    return found


@cache
def case_tables() -> list[str]:
    """All tables of the case file by their dotted path, outer ones first."""
    paths = [path.split(".") for path in case_keys()]
    depth = max(map(len, paths))
    return list(dict.fromkeys(".".join(path[:k]) for k in range(1, depth) for path in paths if len(path) > k))


def _table_models(annotation: Any) -> list[type[Table]]:
    """The tables that a key may hold: none for a plain value, several where a `kind` decides."""
    members = get_args(annotation) if get_origin(annotation) in (Union, UnionType) else (annotation,)
    return [member for member in members if isinstance(member, type) and issubclass(member, Table)]


def _choices(annotation: Any) -> tuple[tuple[str, ...], bool]:
    """The words that a key may take, if any, and whether it may take other values too; it may be left out."""
    members = get_args(annotation) if get_origin(annotation) in (Union, UnionType) else (annotation,)
    others = [member for member in members if get_origin(member) is not Literal and member is not NoneType]
    return next((get_args(member) for member in members if get_origin(member) is Literal), ()), bool(others)


def _kind_of(model: type[Table]) -> str:
    """The `kind` that selects this table."""
    return str(model.model_fields["kind"].default)


def _keys_of(model: type[Table], prefix: str, kind: tuple[str, ...] = ()) -> Iterator[CaseKey]:
    for name, field in model.model_fields.items():
        path = prefix + name
        if models := _table_models(field.annotation):
            for inner in models:
                yield from _keys_of(inner, path + ".", (_kind_of(inner),) if len(models) > 1 else ())
        else:
            words = field.description or f"kind of {prefix.rstrip('.')}"
            members = get_args(field.annotation)  # of `FileToRead | None`
            marks = {*field.metadata, *(mark for member in members for mark in get_args(member)[1:])}
            reads_file = not marks.isdisjoint(get_args(FileToRead)[1:])
            yield CaseKey(path, words, kind, *_choices(field.annotation), reads_file)


def sentence(error: ValidationError, raw: Mapping[str, Any]) -> str:
    """The first thing that is wrong with the case `raw`; a misspelt key goes before the one that it meant."""
    row = min(error.errors(), key=lambda row: row["type"] != "extra_forbidden")
    path, value = _path(row), row["input"]
    if (within := _rows_of(path)) is not None:
        return _fault_in_a_row(row, path, within, raw)
    match row["type"]:
        case "extra_forbidden":
            return unknown_key(path, value, raw)
        case "missing":
            return f"{path} is missing: give the {_help(path)}"
        case "literal_error":
            return not_a_choice(path, value, case_keys()[path].choices)
        case "union_tag_invalid":
            path = f"{path}.kind"
            return not_a_choice(path, value["kind"], case_keys()[path].choices)
        case "value_error":
            reason = str(row["ctx"]["error"])
            return reason if path in case_tables() else f"{path} = {shown(value)}: {reason}"
        case "string_type":
            return f"{path} = {shown(value)}: must be text, the {_help(path)}"
    return f"{path} = {shown(value)}: {row['msg']}"


def _rows_of(path: str) -> str | None:
    """The key with tables in a row that an error is about, or None."""
    return next((name for name in ROWS if f"{path}.".startswith(f"{name}.")), None)


def _fault_in_a_row(row: ErrorDetails, path: str, within: str, raw: Mapping[str, Any]) -> str:
    """What is wrong with tables in a row, or with a key of one of them."""
    noun, models, example = ROWS[within]
    value, (index, _, key) = row["input"], path[len(within) + 1 :].partition(".")
    table = _table_in_a_row(raw, within, index, noun) if index else within
    place, name = f"{key} of {table}" if key else table, path.rpartition(".")[2]
    kinds = [_kind_of(model) for model in models] if len(models) > 1 else []
    kind = next((str(part) for part in row["loc"] if part in kinds), None)
    model = models[kinds.index(kind)] if kind is not None else models[0]
    what = f' of kind "{kind}"' if kind is not None else ""
    known = model.model_fields
    match row["type"]:
        case "extra_forbidden":
            near = get_close_matches(name, known, n=1)
            hint = f"did you mean {near[0]}?" if near else f"a table{what} has {', '.join(known)}"
            return f"unknown key {place}: {hint}"
        case "missing":
            return f"{place} is missing: give the {known[name].description}"
        case "union_tag_not_found":
            return f"kind of {table} is missing: give {either(kinds)}"
        case "union_tag_invalid":
            return not_a_choice(f"kind of {table}", value["kind"], kinds)
        case "literal_error":
            return not_a_choice(place, value, _choices(known[name].annotation)[0])
        case "value_error":
            return f"{place} = {shown(value)}: {row['ctx']['error']}"
        case "string_type":
            return f"{place} = {shown(value)}: must be text, the {known[name].description}"
        case "string_too_short":
            return f"{place} is empty: give the {known[name].description}"
        case "tuple_type" | "model_type" | "model_attributes_type":
            return f"{place} = {shown(value)}: give tables in a case file, such as {example}"
    return f"{place} = {shown(value)}: {row['msg']}"


def _table_in_a_row(raw: Mapping[str, Any], within: str, index: str, noun: str) -> str:
    """A table in a row, counted from one, with its name where it has one: load 2 ("snow")."""
    outer, _, last = within.rpartition(".")
    rows = (_table_of(raw, outer) if outer else raw)[last]
    table = rows[int(index)] if isinstance(rows, Sequence) else None  # a generator has been read
    name = table.get("name") if isinstance(table, Mapping) else None
    return f"{noun} {int(index) + 1}" + (f" ({shown(name)})" if isinstance(name, str) and name else "")


def unknown_key(path: str, value: object, raw: Mapping[str, Any]) -> str:
    """A key that no case has, or not one with the kinds of `raw`; only keys that such a case has are proposed."""
    keys = case_keys()
    table, _, name = path.rpartition(".")
    if path in keys:
        kind = _table_of(raw, table)["kind"]
        return (
            f'{path} = {shown(value)}: a {table.rpartition(".")[2]} of kind "{kind}" has no {name}: '
            f"leave it out, or set {table}.kind to {either(keys[path].kinds)}"
        )
    known = keys_of_kinds(raw)
    if near := _nearest(path, known):
        return f"unknown key {path}: did you mean {near}?"
    if table in case_tables():
        return f"unknown key {path}: [{table}] has {', '.join(_inside(table, known))}"
    return f"unknown key {path}: the tables are {', '.join(_inside('', known))}"


def keys_of_kinds(raw: Mapping[str, Any]) -> dict[str, CaseKey]:
    """The keys that a case has whose tables are of the kinds that `raw` says, and its drape of that method."""
    idle = [f"drape.{name}" for name in IDLE.get(_table_of(raw, "drape").get("method", "bound"), ())]
    return {
        path: key
        for path, key in case_keys().items()
        if path not in idle
        and (not key.kinds or _table_of(raw, key.table).get("kind", BY_KIND[key.table]) in key.kinds)
    }


def not_a_table(path: str, value: object) -> str:
    """A plain value where a table belongs."""
    return f"{path} = {shown(value)}: must be a table; [{path}] has {', '.join(_inside(path, case_keys()))}"


def _table_of(raw: Mapping[str, Any], path: str) -> Mapping[str, Any]:
    """The table at a dotted path; empty where it is missing."""
    inner = raw
    for name in path.split("."):
        inner = inner.get(name, {})
    return inner


def _help(path: str) -> str:
    """The line of help of a key."""
    return case_keys()[path].help


def _nearest(path: str, keys: Mapping[str, CaseKey]) -> str | None:
    """The key or table whose name looks most like this one: in the same table, else anywhere."""
    table, _, name = path.rpartition(".")
    everywhere = {key.name: key.path for key in reversed(list(keys.values()))}
    everywhere |= {top: top for top in _inside("", keys)}
    if len(name) < 3:  # one letter from too many names
        everywhere = {}
    for candidates in ({inner: f"{table}.{inner}" for inner in _inside(table, keys)} if table else {}, everywhere):
        if close := get_close_matches(name, candidates, n=1):
            return candidates[close[0]]
    return None


def _inside(table: str, keys: Mapping[str, CaseKey]) -> list[str]:
    """Names of the keys and tables directly inside a table; of the outermost tables for ""."""
    paths = [*keys, *case_tables()] if table else [*case_tables(), *keys]
    return [name for outer, _, name in (path.rpartition(".") for path in paths) if outer == table]


def _path(row: ErrorDetails) -> str:
    """The dotted key of an error; pydantic puts the kind behind the name of a table."""
    path = [str(part) for part in row["loc"]]
    for table in BY_KIND:
        depth = table.count(".") + 1
        if ".".join(path[:depth]) == table:
            del path[depth : depth + 1]
    if path[0] == "loads" and len(path) > 2:  # loads.0.snow.value
        del path[2]
    return ".".join(path)
