"""The keys of the case file in a row, read off the schema: for messages and command-line options."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from types import NoneType, UnionType
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
    any_value : whether it may take values besides these words.
    """

    path: str
    help: str
    kinds: tuple[str, ...] = ()
    choices: tuple[str, ...] = ()
    any_value: bool = True

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
            yield CaseKey(path, words, kind, *_choices(field.annotation))
