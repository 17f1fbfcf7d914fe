"""The keys of the case file in a row, read off its tables, for command-line options; and what is wrong with a key, in
one sentence: the key, its value, and what is accepted."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import cache
from typing import Any

from rodshell import schema
from rodshell.case.case import Case
from rodshell.case.stage_tables import IDLE
from rodshell.quantities import Value
from rodshell.schema import Place, keys_in, kind_of
from rodshell.units import shown
from rodshell.validation import either

BY_KIND: dict[str, str] = {
    "target": "hemisphere",
    "layout": "chebyshev",
    "rod.section": "auto",
    "joint": "ball",
    "bracing": "none",
    "bracing.section": "circle",
}
"""Tables whose `kind` decides which keys they have, and the kind that they are by default."""


@dataclass(frozen=True)
class CaseKey:
    """One key of the case file.

    Args:
        path: dotted, such as "target.radius".
        kinds: of the table that has the key, where not every kind has it.
        choices: the words that it may take, where it is a choice.
        any_value: whether it may take values other than these words.
        reads_file: whether it names a file.
        unit: of a number without a unit; "" where it has none.
    """

    path: str
    help: str
    kinds: tuple[str, ...] = ()
    choices: tuple[str, ...] = ()
    any_value: bool = True
    reads_file: bool = False
    unit: str = ""

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
            kinds = tuple(dict.fromkeys(known.kinds + key.kinds))
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


def _keys_of(table: type, prefix: str = "", kinds: tuple[str, ...] = ()) -> Iterator[CaseKey]:
    """The keys of a class and of the tables in it, each with the kind of its table that has it."""
    for field, name in keys_in(table):
        path = prefix + name
        if field is None or field.rows or not field.tables:
            help_ = field.help.replace(field.name, name) if field else f"kind of {prefix.rstrip('.')}"
            words, others = (field.choices, field.any_value) if field else (kinds, False)
            value = field.value if field and field.value else Value(str)
            yield CaseKey(path, help_, kinds, words, others, value.role == "file", value.unit)
            continue
        if field.value is not None:
            yield CaseKey(path, field.help, kinds)
        for inner in field.tables:
            yield from _keys_of(inner, f"{path}.", (kind_of(inner),) if field.by_kind else ())


def unknown_key(raw: Mapping[str, Any], place: Place, key: str, given: Mapping[str, Any], table: type) -> str:
    """The sentence on a key that a table of the case `raw` does not have."""
    if place.row:
        return schema.unknown_key(place, key, given, table)
    return unknown_path(place.name(key), given[key], raw)


def unknown_path(path: str, value: object, raw: Mapping[str, Any]) -> str:
    """A key that no case has, or not one with the kinds of `raw`; only keys that such a case has are proposed."""
    table, _, name = path.rpartition(".")
    if (kinds := _kinds_with(path)) and any(kinds):
        kind = _table_of(raw, table)["kind"]
        while path in case_tables() and isinstance(value, Mapping):
            inside = next((key for key in value if key != "kind"), "kind")
            path, value = f"{path}.{inside}", value[inside]
        return (
            f'{path} = {shown(value)}: a {table.rpartition(".")[2]} of kind "{kind}" has no {name}: '
            f"leave it out, or set {table}.kind to {either(kinds)}"
        )
    known = keys_of_kinds(raw)
    if near := _nearest(path, known):
        return f"unknown key {path}: did you mean {near}?"
    if table in case_tables():
        return f"unknown key {path}: [{table}] has {', '.join(_inside(table, known))}"
    return f"unknown key {path}: the tables are {', '.join(_inside('', known))}"


def _kinds_with(path: str) -> list[str]:
    """The kinds of its table that have a key, or a table in it."""
    *outer, name = path.split(".")
    tables: list[type] = [Case]
    for part in outer:
        tables = [inner for table in tables for field, key in keys_in(table) if key == part and field
                  for inner in field.tables]  # fmt: skip
    return list(dict.fromkeys(kind_of(table) for table in tables if name in [key for _, key in keys_in(table)]))


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
    return list(dict.fromkeys(name for outer, _, name in (path.rpartition(".") for path in paths) if outer == table))
