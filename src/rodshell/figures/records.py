"""What every record of a figure is made of: keys with their meaning and their unit, in SI.

A record keeps the keys that were set, so that a file is written back as it was read: a key that is absent stays absent,
null is what is not known, and keys of later versions are kept as they are. Reading checks every value: a text in place
of a number, a number that is not finite or a point with two coordinates is refused.
"""

import json
from collections.abc import Iterator, Mapping
from math import isfinite
from typing import Annotated, Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    FailFast,
    Field,
    GetPydanticSchema,
    Tag,
    ValidationInfo,
)
from pydantic_core import core_schema

from rodshell.arrays import Floats
from rodshell.validation import NAME
from rodshell.validation import Ends as Ends

LARGEST = 1e30  # of a number in its SI unit, so that its products are finite
MOST = 10**15  # of a count
FARTHEST = 1e6  # m between two points of a shell, and of each of its lengths
SHORTEST = 1e-9  # m of a rod
ORIGIN = 1e9  # m from the origin, as in national grids


def printable(text: str) -> str:
    """`text` on one line, without the control characters and lone surrogates that no text file can hold."""
    return text if text.isprintable() else "".join(letter if letter.isprintable() else " " for letter in text)


def _finite_or_unknown(value: object, info: ValidationInfo) -> object:
    """None for a number of a computation that is out of range; in a file such a number is an error."""
    return None if info.mode == "python" and isinstance(value, float) and not abs(value) <= LARGEST else value


def _in_range(value: Any, info: ValidationInfo) -> Any:
    """The value of a key that is not known here: of an object, or of a later version."""
    if info.mode == "python":
        return plain(value)
    if isinstance(value, int | float) and not abs(value) <= LARGEST:
        raise ValueError(f"it must be a number from {-LARGEST:g} to {LARGEST:g}")
    if isinstance(value, dict):
        return {printable(name): _in_range(item, info) for name, item in value.items()}
    if isinstance(value, list):
        return [_in_range(item, info) for item in value]
    return printable(value) if isinstance(value, str) else value


def _instead_of_null(empty: object) -> BeforeValidator:
    """A list or table that is not known has no entries."""
    return BeforeValidator(lambda value: empty if value is None else value)


T = TypeVar("T")
Real = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST)]
Number = Annotated[Real | None, BeforeValidator(_finite_or_unknown)]
Whole = Annotated[int, Field(strict=True, ge=-MOST, le=MOST)]
Flag = Annotated[bool, Field(strict=True)]
Text = Annotated[str, Field(strict=True), AfterValidator(printable)]
Flat = tuple[Number, Number]
Point = tuple[Number, Number, Number]
_Other = Annotated[Any, AfterValidator(_in_range)]
Rows = Annotated[tuple[T, ...], FailFast(), _instead_of_null(())]
ByEnds = Annotated[dict[Annotated[str, Field(pattern=f"^{NAME}$", strict=True)], T], _instead_of_null({})]
TableOr = Annotated[
    Annotated[T, Tag("(table)")] | Annotated[_Other, Tag("(other)")],
    Discriminator(lambda value: "(table)" if isinstance(value, dict | BaseModel) else "(other)"),
]
"""A key of a record that is not known here, such as the name of a support: what its table holds is a T."""


def _array(kept: Any, *shape: int) -> GetPydanticSchema:
    """What is `kept` as a list of numbers or points, or a point, and in Python is an array of this shape; what is not
    known is NaN."""

    def made(given: Any) -> Floats:
        values = np.array(() if given is None else given, dtype=float).reshape(shape)
        return np.where(np.abs(values) <= LARGEST, values, np.nan)

    return GetPydanticSchema(
        lambda source, handler: core_schema.json_or_python_schema(
            json_schema=core_schema.no_info_after_validator_function(made, handler.generate_schema(kept)),
            python_schema=core_schema.no_info_plain_validator_function(made),
            serialization=core_schema.plain_serializer_function_ser_schema(plain),
        )
    )


Vector = Annotated[Floats, _array(Point, 3)]
Points = Annotated[Floats, _array(Annotated[list[Point] | None, FailFast()], -1, 3)]
Numbers = Annotated[Floats, _array(Annotated[list[Number] | None, FailFast()], -1)]
Found = Annotated[T, GetPydanticSchema(lambda source, handler: core_schema.any_schema())]
"""What a check found and its record leaves out."""


class Record(BaseModel):
    """A part of result.json: frozen, with the keys that the file has.

    A check returns a record of its figures, or a class derived from it with what else it found: only the keys of the
    record are written.
    """

    model_config = ConfigDict(frozen=True, extra="allow", allow_inf_nan=False, populate_by_name=True, defer_build=True)
    __pydantic_extra__: dict[str, _Other] = Field(init=False)

    @classmethod
    def taken_from(cls, found: object, **more: Any) -> Self:
        """The record of what a computation found: those of its attributes that are keys, and `more`."""
        known = {name: getattr(found, name) for name in cls.model_fields if hasattr(found, name)}
        return cls(**(known | more))

    def plain(self) -> dict[str, Any]:
        """The record as it stands in result.json: plain dictionaries, lists and numbers, without absent keys."""
        return self.model_dump(mode="json", by_alias=True, exclude_unset=True)

    def changed(self, **values: Any) -> Self:
        """The same record with other values of some fields, by their names here; they are not checked."""
        return self.model_copy(update=values)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Record) and self.plain() == other.plain()

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        """Arrays by their shape, and without what is not set."""
        for name, value in super().__repr_args__():
            if name is None or name in self.model_fields_set:
                yield name, value.shape if isinstance(value, np.ndarray) else value


def key(meaning: str, unit: str = "", **default: Any) -> Any:
    """A key that may be absent, with what it means and the unit of its value; null unless a `default` is given."""
    return Field(**(default or {"default": None}), description=f"{meaning} [{unit}]" if unit else meaning)


def required(meaning: str, *, alias: str) -> Any:
    """A key that must be there, and that Python cannot have as a name, but has in the file (`alias`)."""
    return Field(alias=alias, description=meaning)


def rows(meaning: str, unit: str = "") -> Any:
    """A list that may be absent."""
    return key(meaning, unit, default=())


def points(meaning: str, unit: str = "") -> Any:
    """An array of points that may be absent."""
    return key(meaning, unit, default_factory=lambda: np.empty((0, 3)))


def numbers(meaning: str, unit: str = "") -> Any:
    """An array of numbers that may be absent."""
    return key(meaning, unit, default_factory=lambda: np.empty(0))


def by_ends(meaning: str) -> Any:
    """A table by end condition that may be absent."""
    return Field(default_factory=dict, description=f"{meaning}, by end condition")


def json_text(content: Mapping[str, Any]) -> str:
    """Plain content as strict JSON, a key or a rod on each line; what is not a finite number becomes null."""
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
    """`value` in JSON's types; records, NumPy's arrays and numbers are converted, texts are printable."""
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


def far_apart(points: NDArray[Any]) -> str:
    """What is wrong with the places (..., 2 or 3) [m] of points of one shell, one at least and finite; or nothing."""
    rows = points.reshape(-1, points.shape[-1])
    low, high = rows.min(axis=0).astype(float), rows.max(axis=0).astype(float)
    if max(high.max(), -low.min()) > ORIGIN:
        return f"a point more than {ORIGIN:g} m from the origin"
    return f"points more than {FARTHEST:g} m apart" if max(high - low) > FARTHEST else ""
