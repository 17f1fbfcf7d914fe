"""The columns of a sweep's table: those of every sweep, and keys of result.json that the user names.

Of every finished job the store keeps result.json without its long lists, so that a column can be added later without
computing anything again.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from typing import Any

from rodshell.errors import InputError
from rodshell.results.results import Results, Verdict, json_schema
from rodshell.rods.supports import SUPPORTS
from rodshell.units import shown

FINDINGS = "findings"  # codes of what the verdict says, with blanks between them
TEXTS = ("verdict", "status", FINDINGS)
NUMBERS = (*(f"rms_{ends}" for ends in SUPPORTS), "min_angle_deg", "total_length", "seconds")
STANDARD = (*TEXTS, *NUMBERS)
JOB = "job"  # its identity, by which its result folder is called
CONVERGED = "converged"
ANY = "NAME"  # in a table whose keys are the user's, such as load combinations
OF_POP_UP = ("agreement", "drape", "joint", "layout", "net", "pop_up", "refinement", "rod", "target")
"""Tables of result.json that are complete when the shell is popped up."""
SHORT = 3  # a list with so many numbers is kept: a point, a pair


def known_when_popped_up(name: str) -> bool:
    """Whether a column needs no checks."""
    return name in NUMBERS or name.partition(".")[0] in ("status", *OF_POP_UP)


@dataclass(frozen=True)
class Column:
    """A key of result.json.

    Args:
        name: dotted, such as "bending.pop_up.utilisation".
        counts: whether it is a list, of which the table shows the number of entries.
    """

    name: str
    counts: bool = False

    def of(self, short: Mapping[str, Any]) -> Any:
        """Its value in the short content of a result; None where there is none."""
        found: Any = short
        for name in self.name.split("."):
            found = found.get(name) if isinstance(found, Mapping) else None
        return len(found) if self.counts and isinstance(found, list) else found


def read_columns(given: object, taken: Sequence[str]) -> tuple[Column, ...]:
    """The columns named in `columns`.

    Args:
        given: keys of result.json, or "job".
        taken: names of the axes' keys.

    Raises:
        InputError: result.json has no such key, it is a table, or it is already a column.
    """
    if isinstance(given, str) or not isinstance(given, Sequence):
        raise InputError(f'columns = {shown(given)}: give a list of keys of result.json, such as ["net.min_angle_deg"]')
    found = tuple(read_column(name) for name in given)
    names = [*taken, *STANDARD, *(column.name for column in found)]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"columns: {shown(name)} is a column already: leave it out")
    return found


def read_column(name: object) -> Column:
    """The column of a key of result.json; see `read_columns`."""
    if not isinstance(name, str):
        raise InputError(f"columns: {shown(name)} is not a key: give text such as net.min_angle_deg")
    if name == JOB:
        return Column(name)
    node: Mapping[str, Any] = _schema()
    path = ""
    for part in name.split("."):
        inside = _inside(node)
        if part not in inside and ANY not in inside:
            if path in ("target", "rod.section"):  # whose keys depend on its kind
                return Column(name)
            if not inside:
                kept = "is a single value or a list, of which the number of entries is shown"
                raise InputError(f"columns: {name}: {path} {kept}: use {path}")
            near = get_close_matches(part, inside, n=1)
            prefix = f"{path}." if path else ""
            hint = f"did you mean {prefix}{near[0]}?" if near else f"{path or 'result.json'} has {', '.join(inside)}"
            raise InputError(f"columns: result.json has no key {name}: {hint}")
        node, path = inside.get(part) or inside[ANY], f"{path}.{part}" if path else part
    if inside := _inside(node):
        raise InputError(f"columns: {name} is a table: name one of its keys, such as {name}.{next(iter(inside))}")
    return Column(name, any("items" in choice for choice in _choices(node)))


@cache
def _schema() -> dict[str, Any]:
    return json_schema()


def _choices(node: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """What a node of the schema may be, references opened; null left out."""
    if "$ref" in node:
        return [_schema()["$defs"][node["$ref"].rpartition("/")[2]]]
    members = node.get("anyOf", [node])
    return [choice for member in members for choice in (_choices(member) if member is not node else [member])]


def _inside(node: Mapping[str, Any]) -> dict[str, Any]:
    """The keys of a table of the schema by name, `ANY` where users name them; none of a value or a list."""
    found = dict[str, Any]()
    for choice in _choices(node):
        found |= choice.get("properties", {})
        each, names = choice.get("additionalProperties"), choice.get("propertyNames", {})
        if each and isinstance(each, Mapping) and "oneOf" not in each:  # that is a `TableOr`
            found |= dict.fromkeys(names.get("enum", (ANY,)), each)
        for each in choice.get("patternProperties", {}).values():  # cases have no other supports
            found |= dict.fromkeys(SUPPORTS, each)
    return found


def row_of(results: Results, *, verdict: Verdict | None, seconds: float) -> dict[str, Any]:
    """What is kept of a form: the standard columns, and the short content of its result.json.

    Args:
        verdict: None where it was not checked.
        seconds: processor time [s].
    """
    drape = results.drape
    return {
        "verdict": verdict.level if verdict else "",
        "status": results.status,
        FINDINGS: " ".join(dict.fromkeys(found.code for found in verdict.findings)) if verdict else None,
        **{f"rms_{ends}": _rms(results, ends) for ends in SUPPORTS},
        "min_angle_deg": drape.min_angle_deg if drape else None,
        "total_length": sum(rod.length or 0.0 for rod in results.rods) if results.rods else None,
        "seconds": seconds,
        "results": _short(results.plain()),
    }


def is_usable(row: Mapping[str, Any], without: Collection[str] = ()) -> bool:
    """Whether a form converged and can be built, as far as was checked, and its verdict has none of the findings
    `without`; `row` as of `row_of`, or with a status only."""
    if without and number_of(row.get(FINDINGS), without) != 0:
        return False
    return row.get("status") == CONVERGED and row.get("verdict") != "unbuildable"


def number_of(findings: object, codes: Collection[str]) -> int | None:
    """How many of these codes are in a cell of the column "findings"; None where nothing was judged."""
    return len({*findings.split()} & {*codes}) if isinstance(findings, str) else None


def _rms(results: Results, ends: str) -> float | None:
    """The gap over the size of a shell that converged: of no other it means anything."""
    shell, gap = results.pop_up.get(ends), results.agreement.get(ends)
    return gap.rms_relative if shell and gap and shell.status == CONVERGED else None


def _short(value: Any) -> Any:
    """Plain content, of longer lists their number of entries."""
    if isinstance(value, dict):
        return {name: _short(item) for name, item in value.items()}
    if isinstance(value, list):
        few = len(value) <= SHORT and all(item is None or isinstance(item, int | float | str) for item in value)
        return value if few else len(value)
    return value
