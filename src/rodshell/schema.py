"""What a user may give, read off the classes that it becomes: tables of a case file from frozen dataclasses, and back.

A field is a key where it has a line of help, or where it holds such a class, which is a table in the table:

    @dataclass(frozen=True)
    class Snow:
        kind: ClassVar[str] = "snow"
        value: Annotated[Pressure, "snow load, of the plan"]
        direction: Annotated[Angle, "towards which a drifted load lies"] = 0.0

The type says how a value is read (`quantities`); `Literal` and `str` need no more. In a union the key `kind` decides,
by the attribute `kind` of its classes. A class method `completed(given, path)` may complete or refuse the keys of a
table before they are read; what cannot be used together is refused by `__post_init__`, as from Python.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass, replace
from difflib import get_close_matches
from functools import cache, cached_property
from math import inf
from types import MappingProxyType, NoneType, UnionType
from typing import Annotated, Any, Literal, Self, TypeVar, Union, get_args, get_origin, get_type_hints

from rodshell.errors import InputError
from rodshell.quantities import Value
from rodshell.units import shown
from rodshell.validation import choice, either, not_a_choice

Table = Mapping[str, Any]
Files = Callable[[object], str]
T = TypeVar("T")
_EMPTY: Table = MappingProxyType({})


@dataclass(frozen=True)
class Key:
    """Mark of a field whose key is called otherwise; `first`: it is named before the others."""

    name: str
    first: bool = False


@dataclass(frozen=True)
class Missing:
    """Mark of a field without which a table cannot be: what to do where it is left out."""

    remedy: str


@dataclass(frozen=True)
class Twice:
    """Mark of a length that another key may give in its place, twice as long: of a radius the diameter."""

    name: str


class Inline:
    """Mark of a field whose keys stand in the table of the class that has it."""


@dataclass(frozen=True)
class Rows:
    """Mark of a key with tables in a row: what one of them is called, and an example."""

    noun: str
    example: str


@dataclass(frozen=True)
class NoKey:
    """Mark of a field that Python alone can give: what an object is where it is not at its default."""

    what: str


@dataclass(frozen=True)
class Place:
    """Where a table stands: its dotted path, or what a table in a row is called in messages."""

    path: str = ""
    row: str = ""

    def name(self, key: str = "") -> str:
        """What a key of the table is called, or the table itself."""
        path = f"{self.path}.{key}".strip(".")
        return f"{path} of {self.row}" if self.row and path else path or self.row

    def inside(self, key: str) -> Self:
        """A table in the table."""
        return type(self)(f"{self.path}.{key}".lstrip("."), self.row)


@dataclass(frozen=True)
class Field:
    """A key of a table.

    Args:
        value: how it is read; None: as text, one of `choices`, or tables. Of tables, how a text is read as one.
        tables: the classes that it may become, by their kinds.
        choices: the words that it may be.
        any_value: whether it may be something else than these words.
        optional: whether it may be None: left out, or a table without keys.
        twice: the key that may stand in its place and gives twice as much, or "".
    """

    name: str
    attribute: str
    help: str
    value: Value | None
    tables: tuple[type, ...]
    choices: tuple[str, ...]
    any_value: bool
    optional: bool
    default: Any
    rows: Rows | None
    inline: bool
    first: bool
    remedy: str
    twice: str

    @cached_property
    def by_kind(self) -> dict[str, type]:
        """The classes by their kinds, where there are several."""
        return {kind_of(table): table for table in self.tables} if len(self.tables) > 1 else {}

    @property
    def wanted(self) -> str:
        """What the key of a table, or of tables in a row, must hold."""
        return f"give tables in a case file, such as {self.rows.example}" if self.rows else "must be a table"

    def chosen(self, given: Any) -> type | None:
        """The class that a table becomes; None: none has its kind."""
        kind = given.get("kind") if self.by_kind and isinstance(given, Mapping) else None
        return (self.by_kind.get(kind) if isinstance(kind, str) else None) if self.by_kind else self.tables[0]


def _is_table(kind: Any) -> bool:
    """Whether a type is a class with keys, or one of several kinds."""
    return isinstance(kind, type) and is_dataclass(kind) and bool(kind_of(kind) or fields_of(kind))


def kind_of(table: Any) -> str:
    """The word that stands for a class where several could be meant; "" for others."""
    return str(getattr(table, "kind", ""))


def _fields_of(table: Any) -> tuple[Field, ...]:
    """The keys of a class, in its order."""
    hints = get_type_hints(table, include_extras=True)
    found = (_field(each.name, hints[each.name], _default(each)) for each in fields(table) if each.init)
    return tuple(sorted((field for field in found if field is not None), key=lambda field: not field.first))


fields_of: Callable[[Any], tuple[Field, ...]] = cache(_fields_of)


def _default(field: Any) -> Any:
    return field.default_factory() if field.default_factory is not MISSING else field.default


def _flat(hint: Any) -> tuple[list[Any], list[Any]]:
    """The types that a hint is a union of, and all its marks."""
    if get_origin(hint) is Annotated:
        types, marks = _flat(get_args(hint)[0])
        return types, [*marks, *get_args(hint)[1:]]
    if get_origin(hint) in (Union, UnionType):
        parts = [_flat(member) for member in get_args(hint)]
        return [kind for types, _ in parts for kind in types], [mark for _, marks in parts for mark in marks]
    return [hint], []


def _field(name: str, hint: Any, default: Any) -> Field | None:
    """A field as a key; None: Python alone can give it."""
    types, marks = _flat(hint)
    rows = next((mark for mark in marks if isinstance(mark, Rows)), None)
    if rows:
        types = _flat(get_args(types[0])[0])[0]
    texts = [mark for mark in marks if isinstance(mark, str)]
    tables = tuple(kind for kind in types if _is_table(kind))
    if any(isinstance(mark, NoKey) for mark in marks) or not (texts or tables):
        return None
    choices = next((get_args(kind) for kind in types if get_origin(kind) is Literal), ())
    others = [kind for kind in types if get_origin(kind) is not Literal and kind is not NoneType]
    value = next((mark for mark in marks if isinstance(mark, Value)), None)
    choices = choices or (value.words if value else ())
    key = next((mark for mark in marks if isinstance(mark, Key)), Key(name))
    help_ = texts[-1] if texts else ""
    missing = next((mark for mark in marks if isinstance(mark, Missing)), Missing(f"give the {help_}"))
    return Field(
        key.name, name, help_, value, tables, choices, bool(others), NoneType in types, default,
        rows, inline=Inline in marks, first=key.first, remedy=missing.remedy,
        twice=next((mark.name for mark in marks if isinstance(mark, Twice)), ""),
    )  # fmt: skip


def checked(record: Any, what: str | Mapping[str, str] = "{}") -> None:
    """Check the fields of a frozen dataclass in its `__post_init__`, and keep them as they are read from a file.

    Args:
        what: what messages call a field, with {} for its name; or that by name.

    Raises:
        InputError: a value cannot be used.
    """
    for field in fields_of(type(record)):
        value = getattr(record, field.attribute)
        if value is None and field.optional:
            continue
        words = what if isinstance(what, str) else what.get(field.attribute, "{}")
        name = words.format(field.attribute)
        if field.value is not None and field.value.check is not None:
            object.__setattr__(record, field.attribute, field.value.check(name, value))
        elif field.choices and not field.any_value:
            choice(name, value, field.choices)


def read(
    table: type[T],
    given: Table,
    place: Place = Place(),
    *,
    unknown: Callable[[Place, str, Table, type], str] | None = None,
    files: Files | None = None,
) -> T:
    """An object of the keys in a table.

    Args:
        given: what a file, options or Python says, by key.
        unknown: the sentence on an unknown key of a table; default: it names the keys that the table has.
        files: gives the path for the value of each key that names a file, or raises InputError; None: as it is. With it
            no folder may be written.

    Raises:
        InputError: a key is unknown or missing, or a value cannot be used; in one sentence. A misspelt key goes first.
    """
    _require_known(table, given, place, unknown or unknown_key)
    return _read(table, given, place, files)


def _require_known(table: type, given: Any, place: Place, unknown: Callable[..., str]) -> None:
    if not isinstance(given, Mapping):
        return
    known = set[str]()
    for field, key in keys_in(table, given):
        known.add(key)
        if field is None or key not in given or not field.tables:
            continue
        for within, inside in _tables_in(field, given[key], place):
            if chosen := field.chosen(inside):
                _require_known(chosen, inside, within, unknown)
    if not known:  # of a kind that there is not
        return
    for key in given:
        if key not in known:
            raise InputError(unknown(place, key, given, table))


def keys_in(table: type, given: Table = _EMPTY) -> Iterator[tuple[Field | None, str]]:
    """The keys that a table has; no field for `kind`.

    Args:
        given: the table, where the keys of another stand in it whose kind it says.
    """
    if kind_of(table):
        yield None, "kind"
    for field in fields_of(table):
        if not field.inline:
            yield from ((field, name) for name in (field.name, field.twice) if name)
            continue
        chosen = field.chosen(given)
        yield from keys_in(chosen, given) if chosen else ((None, str(key)) for key in ("kind", *given))


def _tables_in(field: Field, given: Any, place: Place) -> Iterable[tuple[Place, Any]]:
    """The table of a key, or each of its tables in a row, and where it stands."""
    if field.rows is None:
        return [(place.inside(field.name), given)]
    if not isinstance(given, list | tuple):
        return []
    return [(Place(row=_row(field.rows.noun, k, inside)), inside) for k, inside in enumerate(given)]


def _row(noun: str, k: int, given: Any) -> str:
    """A table in a row, counted from one, with its name where it has one: load 2 ("snow")."""
    name = given.get("name") if isinstance(given, Mapping) else None
    return f"{noun} {k + 1}" + (f" ({shown(name)})" if isinstance(name, str) and name else "")


def unknown_key(place: Place, key: str, given: Table, table: type) -> str:
    """The sentence on a key that a table does not have."""
    known = [name for _, name in keys_in(table, given)]
    near = get_close_matches(str(key), known, n=1)
    what = f' of kind "{given["kind"]}"' if "kind" in given else ""
    hint = f"did you mean {near[0]}?" if near else f"a table{what} has {', '.join(known)}"
    return f"unknown key {place.name(key)}: {hint}"


def _read(table: type[T], given: Table, place: Place, files: Files | None) -> T:
    complete = getattr(table, "completed", None)
    given = complete(given, place.name()) if complete else given
    values, missing = {}, list[Field]()
    for field in fields_of(table):
        if field.inline:
            inside = {key: given[key] for _, key in keys_in(field.tables[0], given) if key in given}
            if _says_something(inside) or not field.optional:
                values[field.attribute] = _one_table(field, given if field.by_kind else inside, place, files)
        elif field.twice and field.twice in given:
            if field.name in given:
                raise InputError(f"{place.name(field.twice)} and {field.name} are given: leave one of them out")
            double = _value(replace(field, name=field.twice), given[field.twice], place, files)
            values[field.attribute] = double if isinstance(double, str) else double / 2
        elif field.name in given:
            values[field.attribute] = _value(field, given[field.name], place, files)
        elif field.default is MISSING:
            missing.append(field)
    if missing:
        raise InputError(f"{place.name(missing[0].name)} is missing: {missing[0].remedy}")
    return table(**values)


def _says_something(given: Table) -> bool:
    """Whether a key of a table is given; an empty table in it does not count."""
    return any(value is not None and not (isinstance(value, Mapping) and not value) for value in given.values())


def _value(field: Field, given: Any, place: Place, files: Files | None) -> Any:
    """What a key holds."""
    name = place.name(field.name)
    if given is None and field.optional:
        return None
    if field.rows and not isinstance(given, list | tuple):
        raise InputError(f"{name} = {shown(given)}: {field.wanted}")
    if field.rows:
        return tuple(_one_table(field, inside, within, files) for within, inside in _tables_in(field, given, place))
    if field.tables and field.value is not None and isinstance(given, str):
        given = _read_value(name, field.value, given)
    if field.tables:
        left_out = field.optional and isinstance(given, Mapping) and not _says_something(given)
        return None if left_out else _one_table(field, given, place.inside(field.name), files)
    role = field.value.role if field.value is not None else "text"
    if field.value is not None and not role:
        return _read_value(name, field.value, given)
    try:
        if role == "folder" and files is not None:
            raise ValueError("nothing is written for a case from somebody else: leave it out")
        given = files(given) if role == "file" and files is not None else given
    except ValueError as reason:
        raise InputError(f"{name} = {shown(given)}: {reason}") from None
    if field.choices:
        return choice(name, given, field.choices)
    if not isinstance(given, str):
        raise InputError(f"{name} = {shown(given)}: must be text, the {field.help}")
    if role == "name" and not given:
        raise InputError(f"{name} is empty: give the {field.help}")
    return given


def _one_table(field: Field, given: Any, place: Place, files: Files | None) -> Any:
    if not isinstance(given, Mapping):
        raise InputError(f"{place.name()} = {shown(given)}: {field.wanted}")
    chosen = field.chosen(given)
    if chosen is None:
        name = place.name("kind")
        if "kind" not in given:
            raise InputError(f"{name} is missing: give {either(list(field.by_kind))}")
        raise InputError(not_a_choice(name, given["kind"], list(field.by_kind)))
    return _read(chosen, given, place, files)


def value_of(hint: Any, name: str, given: object) -> Any:
    """A value of a type of `quantities`; InputError, which calls it by its name."""
    return _read_value(name, next(mark for mark in _flat(hint)[1] if isinstance(mark, Value)), given)


def _read_value(name: str, value: Value, given: object) -> Any:
    try:
        return value.read(given)
    except ValueError as reason:
        raise InputError(f"{name} = {shown(given)}: {reason}") from None


def written(record: Any, *, changed: bool = False) -> dict[str, Any]:
    """The keys of an object in SI, as they stand in a case file, without the empty ones.

    Args:
        changed: whether what is at its default is left out, except the kinds of tables.
    """
    keys: dict[str, Any] = {"kind": kind_of(record)} if kind_of(record) else {}
    for field in fields_of(type(record)):
        value = getattr(record, field.attribute)
        if value is None or (changed and value == field.default):
            continue
        if field.inline:
            keys |= written(value, changed=changed)
        elif field.rows:
            keys[field.name] = tuple(written(row, changed=changed) for row in value)
        else:
            plain = written(value, changed=changed) if field.tables else value
            keys[field.name] = "rigid" if isinstance(plain, float) and plain == inf else plain
    as_written = getattr(record, "as_written", None)
    return as_written(keys) if as_written else keys


def undescribed(record: Any) -> str:
    """What an object is that no keys describe; "" where they do."""
    hints = get_type_hints(type(record), include_extras=True)
    for each in fields(record):
        marks = [mark for mark in _flat(hints[each.name])[1] if isinstance(mark, NoKey)]
        if marks and getattr(record, each.name) != _default(each):
            return marks[0].what
    return ""
