"""What is wrong with a case, in one sentence: the key, its value, and what would do."""

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from functools import reduce
from operator import getitem
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from rodshell.case.keys import BY_KIND, CaseKey, case_keys, case_tables
from rodshell.case.schema import PatchTable
from rodshell.units import shown

NOT_YET: dict[str, tuple[str, ...]] = {}


def sentence(error: ValidationError, raw: Mapping[str, Any]) -> str:
    """The first thing that is wrong with the case `raw`; a misspelt key goes before the one that it meant."""
    row = min(error.errors(), key=lambda row: row["type"] != "extra_forbidden")
    path, value = _path(row), row["input"]
    match row["type"]:
        case "extra_forbidden":
            return unknown_key(path, value, raw)
        case "missing":
            return f"{path} is missing: give the {_help(path)}"
        case "literal_error":
            return _not_a_choice(case_keys()[path], value)
        case "union_tag_invalid":
            return _not_a_choice(case_keys()[f"{path}.kind"], value["kind"])
        case "value_error":
            reason = str(row["ctx"]["error"])
            return reason if path in case_tables() else f"{path} = {shown(value)}: {reason}"
        case "string_type":
            return f"{path} = {shown(value)}: must be text, the {_help(path)}"
        case "tuple_type" | "model_type":
            example = '[{ name = "B", rotate = "10 deg" }]'
            return f"{path} = {shown(value)}: give tables in a case file, such as {example}"
    return f"{path} = {shown(value)}: {row['msg']}"


def unknown_key(path: str, value: object, raw: Mapping[str, Any]) -> str:
    """A key that the schema does not have, or not for this kind."""
    keys = case_keys()
    table, _, name = path.rpartition(".")
    if path in keys:
        own = reduce(getitem, table.split("."), raw)["kind"]
        return (
            f'{path} = {shown(value)}: a {table.rpartition(".")[2]} of kind "{own}" has no {name}: '
            f"leave it out, or set {table}.kind to {_either(keys[path].kinds)}"
        )
    if near := _nearest(path, keys):
        return f"unknown key {path}: did you mean {near}?"
    if table in case_tables():
        return f"unknown key {path}: [{table}] has {', '.join(_inside(table))}"
    return f"unknown key {path}: the tables are {', '.join(_inside(''))}"


def _help(path: str) -> str:
    """The line of help of a key; of a key of one patch, without the patch's number."""
    if path.startswith("seams.patches."):
        return str(PatchTable.model_fields[path.rpartition(".")[2]].description)
    return case_keys()[path].help


def not_a_table(path: str, value: object) -> str:
    """A plain value where a table belongs."""
    return f"{path} = {shown(value)}: must be a table; [{path}] has {', '.join(_inside(path))}"


def _not_a_choice(key: CaseKey, value: object) -> str:
    later = "not yet: " if value in NOT_YET.get(key.path, ()) else ""
    near = get_close_matches(str(value), key.choices, n=1)
    hint = f" (did you mean {near[0]}?)" if near else ""
    return f"{key.path} = {shown(value)}: {later}use {_either(key.choices)}{hint}"


def _nearest(path: str, keys: Mapping[str, CaseKey]) -> str | None:
    """The known key or table whose name looks most like this one: in the same table, else anywhere."""
    table, _, name = path.rpartition(".")
    everywhere = {key.name: key.path for key in reversed(list(keys.values()))} | {top: top for top in _inside("")}
    if len(name) < 3:  # one letter from too many names
        everywhere = {}
    for candidates in ({inner: f"{table}.{inner}" for inner in _inside(table)} if table else {}, everywhere):
        if close := get_close_matches(name, candidates, n=1):
            return candidates[close[0]]
    return None


def _inside(table: str) -> list[str]:
    """Names of the keys and tables directly inside a table; of the outermost tables for ""."""
    paths = [*case_keys(), *case_tables()]
    return [name for outer, _, name in (path.rpartition(".") for path in paths) if outer == table]


def _either(words: Iterable[str]) -> str:
    *first, last = (f'"{word}"' for word in words)
    return f"{', '.join(first)} or {last}" if first else last


def _path(row: ErrorDetails) -> str:
    """The dotted key of an error; pydantic puts the kind behind the name of a table."""
    path = [str(part) for part in row["loc"]]
    for table in BY_KIND:
        depth = table.count(".") + 1
        if ".".join(path[:depth]) == table:
            del path[depth : depth + 1]
    return ".".join(path)
