"""The keys of the case file in a row, read off the schema: for messages and command-line options."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

from rodshell.case.schema import Case
from rodshell.case.table import Table

BY_KIND: dict[str, str] = {
    "target": Case().target.kind,
    "rod.section": Case().rod.section.kind,
    "joint": Case().joint.kind,
}
"""Tables whose `kind` decides which keys they have, and the kind that they are by default."""


@dataclass(frozen=True)
class CaseKey:
    """One key of the case file.

    Parameters
    ----------
    path : dotted, such as "target.radius".
    help : one line.
    kinds : of the table that has the key, where not every kind has it.
    choices : the words that it may take, where it is a choice.
    """

    path: str
    help: str
    kinds: tuple[str, ...] = ()
    choices: tuple[str, ...] = ()

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
            key = replace(known, kinds=known.kinds + key.kinds, choices=known.choices + key.choices)
        keys[key.path] = key
    return keys


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


def _choices(annotation: Any) -> tuple[str, ...]:
    """The words of a key that is a choice, which may be left out; else none."""
    members = get_args(annotation) if get_origin(annotation) in (Union, UnionType) else (annotation,)
    return next((get_args(member) for member in members if get_origin(member) is Literal), ())


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
            choices = _choices(field.annotation)
            yield CaseKey(path, field.description or f"kind of {prefix.rstrip('.')}", kind, choices)
