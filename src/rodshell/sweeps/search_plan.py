"""The plan of a search: base, variables, objectives and constraints, read from a TOML file or a mapping."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.figures.findings import CODES
from rodshell.sweeps.axes import Axis, Span, count_of, flat_keys, read_listed, read_span
from rodshell.sweeps.columns import (
    FINDINGS,
    NUMBERS,
    STANDARD,
    known_when_popped_up,
    number_of,
    read_column,
    read_columns,
)
from rodshell.sweeps.plan import GENERATION, Plan, Source, known, read_origin, read_settings, table
from rodshell.units import shown
from rodshell.validation import choices_of

TABLES = ("base", "columns", "variables", "objectives", "constraints", "search", "run")
COUNTS = {"population": (24, 4), "generations": (20, 1), "seed": (0, 0)}  # of a search, and the least of each
FAR = 1e3  # violation of a design without a form: larger than that of any constraint


@dataclass(frozen=True)
class Objective:
    """A column that is to be small (sign 1) or large (sign -1)."""

    column: str
    sign: Literal[1, -1]


@dataclass(frozen=True)
class Constraint:
    """What a column must be.

    Args:
        low, high: bounds of a number; None: there is none.
        words: that it may be, in place of bounds.
        without: codes of which the column "findings" may have none.
    """

    column: str
    low: float | None = None
    high: float | None = None
    words: tuple[str, ...] = ()
    without: tuple[str, ...] = ()

    def violation(self, value: Any) -> float:
        """How far it is from holding: 0 or less where it holds, relative to the bound."""
        if self.words:
            return 0.0 if value in self.words else 1.0
        if self.without:
            count = number_of(value, self.without)
            return FAR if count is None else float(count)
        if not isinstance(value, int | float):
            return FAR
        below = 0.0 if self.low is None else (self.low - value) / (abs(self.low) or 1.0)
        above = 0.0 if self.high is None else (value - self.high) / (abs(self.high) or 1.0)
        return min(max(below, above, 0.0), FAR)


@dataclass(frozen=True)
class SearchPlan(Plan):
    """A whole search; its keys are "generation" and those of its variables, which are intervals or lists of values.

    Args:
        checks_last: objectives and constraints need no checks, which the best designs alone get, at the end.
    """

    variables: tuple[Span | Axis, ...]
    objectives: tuple[Objective, ...]
    constraints: tuple[Constraint, ...]
    population: int
    generations: int
    seed: int
    checks_last: bool

    def values(self, generation: int, point: Floats) -> tuple[Any, ...]:
        """Values of the keys at a point (n,) of the unit cube."""
        rows = (variable.row(share) for variable, share in zip(self.variables, point.tolist(), strict=True))
        return (generation, *(value for row in rows for value in row))


def read_search(source: Source) -> SearchPlan:
    """The plan of a search; `source` and errors as of `read_plan`."""
    origin = read_origin(source, TABLES)
    if len(origin.bases) > 1:
        raise InputError("base: a search has one: choose among targets by a variable such as target.kind")
    given = origin.tables
    variables = tuple(
        read_span(key, value, origin.first, ("from", "to", "scale"))
        if isinstance(value, Mapping)
        else read_listed(key, value, origin.first, origin.folder)
        for key, value in flat_keys(table(given, "variables"))
    )
    if not variables:
        raise InputError(
            '[variables] is missing: give at least one key, such as "layout.spacing" = { from = "25 mm", to = "35 mm" }'
        )
    keys = (GENERATION, *(key for variable in variables for key in variable.keys))
    objectives = _objectives(table(given, "objectives"))
    limits = flat_keys(table(given, "constraints"), {"min", "max"}, STANDARD)
    constraints = tuple(_constraint(column, value) for column, value in limits)
    columns = read_columns(given.get("columns", ()), keys)
    there = (*STANDARD, *keys, *(column.name for column in columns))
    judged = [*(objective.column for objective in objectives), *(constraint.column for constraint in constraints)]
    columns += tuple(read_column(name) for name in dict.fromkeys(judged) if name not in there)
    run, search = table(given, "run"), table(given, "search")
    if "best" in run:
        raise InputError("run.best: a search has objectives, which say what is best: leave it out")
    if "without" in run:
        raise InputError("run.without: a search has constraints: give findings = { without = [...] } there")
    known("search", search, tuple(COUNTS))
    settings = read_settings(run, [column.name for column in columns])
    checks_last = "until" not in run and all(map(known_when_popped_up, judged))
    plan = SearchPlan(
        origin, keys, columns, replace(settings, until="pop-up") if checks_last else settings,
        variables, objectives, constraints,
        **{
            name: count_of(f"search.{name}", search.get(name, default), least)
            for name, (default, least) in COUNTS.items()
        },
        checks_last=checks_last,
    )  # fmt: skip
    for corner in (0.0, 0.5, 1.0):
        plan.job(plan.values(1, np.full(len(variables), corner)))
    return plan


def _objectives(given: Mapping[str, Any]) -> tuple[Objective, ...]:
    known("objectives", given, ("minimise", "maximise"))
    found = list[Objective]()
    for name, sign in (("minimise", 1), ("maximise", -1)):
        columns = given.get(name, [])
        if not isinstance(columns, list | tuple):
            raise InputError(f'objectives.{name} = {shown(columns)}: give a list of columns, such as ["rms_pinned"]')
        for column in columns:
            if column not in NUMBERS:
                read_column(column)
            found.append(Objective(column, 1 if sign > 0 else -1))
    if not found:
        raise InputError('[objectives] is missing: give columns of the table, such as minimise = ["rms_pinned"]')
    names = [objective.column for objective in found]
    if len(set(names)) < len(names):
        raise InputError("[objectives]: a column occurs twice: leave one out")
    return tuple(found)


def _constraint(column: str, given: Any) -> Constraint:
    if column not in STANDARD:
        read_column(column)
    if column == FINDINGS:
        if not isinstance(given, Mapping) or set(given) != {"without"}:
            raise InputError(f'constraints findings = {shown(given)}: give {{ without = ["strength", "contact"] }}')
        return Constraint(column, without=choices_of("constraints.findings.without", given["without"], tuple(CODES)))
    if isinstance(given, str):
        given = [given]
    if isinstance(given, list | tuple) and given and all(isinstance(word, str) for word in given):
        return Constraint(column, words=tuple(given))
    if not isinstance(given, Mapping):
        raise InputError(
            f"constraints {shown(column)} = {shown(given)}: give {{ min = 30 }}, {{ max = 1.0 }} or a list of words"
        )
    known(f"constraints.{column}", given, ("min", "max"))
    for name, bound in given.items():
        if not isinstance(bound, int | float) or isinstance(bound, bool):
            raise InputError(f"constraints {shown(column)}: {name} = {shown(bound)}: give a number in SI")
    return Constraint(column, low=given.get("min"), high=given.get("max"))
