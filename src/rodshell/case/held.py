"""Objects made in Python that the keys of a case do not describe."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, eq=False)
class Held:
    """An object of which a table was made whose keys do not describe it: a Python function as a target, say.

    Args:
        by_value: whether two such objects are the same that are equal; else only one object is the same as itself.
        writable: whether a case file that leaves out what the keys do not describe gives the same form.
    """

    value: Any
    what: str
    by_value: bool = True
    writable: bool = False
    note: str = ""

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Held):
            return NotImplemented
        return self.value is other.value or (self.by_value and other.by_value and bool(self.value == other.value))

    def __hash__(self) -> int:
        return hash(self.what)


@dataclass(frozen=True, kw_only=True)
class Holding:
    """A table that may hold an object in place of what its keys say."""

    held: Held | None = None


def built(table: Any, *arguments: object) -> Any:
    """The object that a table describes, or the one that it holds."""
    held = getattr(table, "held", None)
    return table.build(*arguments) if held is None else held.value
