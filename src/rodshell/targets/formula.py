"""Height formulas as people write them: "0.1 - 2*x^2 - y^2" is parsed into a function, without running any code."""

import ast
import operator
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from difflib import get_close_matches
from math import e, inf, isfinite, pi
from typing import Any, NamedTuple

import numpy as np

from rodshell.errors import InputError
from rodshell.units import shown

FUNCTIONS: dict[str, Callable[[Any], Any]] = {
    "sqrt": np.sqrt,
    "exp": np.exp,
    "log": np.log,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "sinh": np.sinh,
    "cosh": np.cosh,
    "tanh": np.tanh,
    "abs": np.abs,
}
CONSTANTS = {"pi": pi, "e": e}
OPERATORS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
ALLOWED = "x, y, numbers, pi, e, + - * / ^, parentheses and " + ", ".join(FUNCTIONS)

FOREIGN = {"−": "-", "·": "*", "×": "*", "÷": "/", "²": "^2", "³": "^3", "=": "only the part after it"}
LONGEST = 4000  # characters; Python's parser is safe with texts of this length
DEEPEST = 100  # nested parentheses
_FOREIGN = re.compile(r"[^A-Za-z0-9_.,+\-*/^() ]|//|__")

Slot = int
Step = tuple[Callable[..., Any], Slot, Slot | None]


@dataclass(frozen=True)
class Formula:
    """z = f(x, y), callable with numbers, arrays or jets. Make one with `parse_formula`.

    Parameters
    ----------
    text : the formula as it was written.
    constants : numbers in slots 2, 3, ...; slots 0 and 1 are x and y.
    steps : a straight-line program: functions of one or two earlier slots, whose results go into the next slots. Equal
        parts of the formula are evaluated once.
    """

    text: str
    constants: tuple[float, ...] = field(repr=False, compare=False)
    steps: tuple[Step, ...] = field(repr=False, compare=False)

    def __call__(self, x: Any, y: Any) -> Any:
        slots = [x, y, *self.constants]
        for function, a, b in self.steps:
            slots.append(function(slots[a]) if b is None else function(slots[a], slots[b]))
        return slots[-1]

    def __reduce__(self) -> tuple[Callable[[str], "Formula"], tuple[str]]:
        return parse_formula, (self.text,)


def parse_formula(text: str) -> Formula:
    """Read a formula in x and y without running any code.

    Parameters
    ----------
    text : numbers, x, y, pi, e, + - * / ^ (or **), parentheses and `FUNCTIONS`.

    Raises
    ------
    InputError : anything else; one sentence that names the wrong part and lists what is allowed.
    """
    if not isinstance(text, str):
        raise InputError(f"a formula must be text such as {shown('0.1 - 2*x^2 - y^2')}, not {shown(text)}")
    if len(text) > LONGEST:
        raise InputError(f"the formula has {len(text)} characters, and at most {LONGEST} are read: write a shorter one")
    source = " ".join(text.split())
    if not source:
        raise InputError(f"the formula is empty: write z in {ALLOWED}")
    if foreign := _FOREIGN.search(source):
        raise _refusal(text, foreign[0], FOREIGN.get(foreign[0]))
    if _nesting(source) > DEEPEST:
        raise InputError(f"formula {shown(text)}: more than {DEEPEST} nested parentheses: write a simpler one")
    return _Compiler(text, source).formula()


class _Result(NamedTuple):
    """An operand that is the result of a step. Other operands are floats and the names "x" and "y"."""

    step: int


_Operand = float | str | _Result


class _Compiler:
    """Turns Python's syntax tree into a straight-line program, refusing every node that it does not know."""

    def __init__(self, text: str, source: str) -> None:
        self.text, self.source = text, source
        self.steps: dict[tuple[Callable[..., Any], _Operand, _Operand | None], _Result] = {}

    def formula(self) -> Formula:
        result = self._walk(self._parse())
        if isinstance(result, float):  # one height for every x: added to 0 x, so that shapes are kept
            self._step(operator.add, self._step(operator.mul, "x", 0.0), result)
        elif isinstance(result, str):
            self._step(operator.pos, result)
        constants = dict.fromkeys(a for step in self.steps for a in step[1:] if isinstance(a, float))
        operands: list[_Operand] = ["x", "y", *constants, *self.steps.values()]
        slot_of: dict[_Operand | None, Slot | None] = {None: None}
        slot_of |= {operand: slot for slot, operand in enumerate(operands)}
        steps = tuple((function, slot_of[a] or 0, slot_of[b]) for function, a, b in self.steps)
        return Formula(self.text, tuple(constants), steps)

    def _parse(self) -> ast.expr:
        try:
            return ast.parse(self.source.replace("^", "**"), mode="eval").body
        except SyntaxError as reason:
            read = self.source.replace("^", "**")[: max((reason.offset or 1) - 1, 0)]
            rest = self.source[len(self._as_written(read)) :]
            where = f"from {shown(rest)} on" if rest else "to its end"
            raise InputError(
                f"formula {shown(self.text)} cannot be read {where}: use {ALLOWED}; a product needs its *"
            ) from None
        except (ValueError, MemoryError, RecursionError):
            raise InputError(f"formula {shown(self.text)} is nested too deeply: write a simpler one") from None

    def _walk(self, root: ast.expr) -> _Operand:
        """Operands first, by a stack of our own: a long sum is a deep tree."""
        done: dict[ast.expr, _Operand] = {}
        stack = [root]
        while stack:
            waiting = [child for child in self._operands(stack[-1]) if child not in done]
            if waiting:
                stack.extend(reversed(waiting))
            else:
                node = stack.pop()
                done[node] = self._operand(node, done)
        return done[root]

    def _operands(self, node: ast.expr) -> list[ast.expr]:
        match node:
            case ast.BinOp(left, op, right) if type(op) in OPERATORS:
                return [left, right]
            case ast.UnaryOp(ast.USub() | ast.UAdd(), inner):
                return [inner]
            case ast.Call(ast.Name(name), args, []) if name in FUNCTIONS:
                if len(args) != 1:
                    raise self._wrong(node, f"has {len(args)} values: write {name}(...) with one")
                return args
            case ast.Name(name) if name in FUNCTIONS:
                raise self._wrong(node, f"has no value: write {name}(...)")
            case ast.Name(name) if name in ("x", "y") or name in CONSTANTS:
                return []
            case ast.Constant(value) if type(value) in (int, float):
                return []
        raise _refusal(self.text, self._piece(node), _meant(node))

    def _operand(self, node: ast.expr, done: dict[ast.expr, _Operand]) -> _Operand:
        function: Callable[..., Any]
        operands: tuple[_Operand, ...]
        match node:
            case ast.Name(name):
                return CONSTANTS.get(name, name)
            case ast.UnaryOp(ast.UAdd(), inner):
                return done[inner]
            case ast.Constant(int() | float() as value):
                function, operands = float, (_number(value),)
            case ast.UnaryOp(_, inner):
                function, operands = operator.neg, (done[inner],)
            case ast.BinOp(left, op, right):
                function, operands = OPERATORS[type(op)], (done[left], done[right])
                if function is operator.truediv and operands[1] == 0.0:
                    raise self._wrong(node, "divides by zero: write a divisor other than 0")
            case ast.Call(ast.Name(name), [inner]):
                function, operands = FUNCTIONS[name], (done[inner],)
        numbers = [np.float64(operand) for operand in operands if isinstance(operand, float)]
        if len(numbers) < len(operands):
            return self._step(function, *operands)
        with np.errstate(all="ignore"):
            value = float(function(*numbers))
        if not isfinite(value):
            raise self._wrong(node, "is not a finite number: change it")
        return value

    def _step(self, function: Callable[..., Any], a: _Operand, b: _Operand | None = None) -> _Result:
        return self.steps.setdefault((function, a, b), _Result(len(self.steps)))

    def _wrong(self, node: ast.expr, what: str) -> InputError:
        return InputError(f"formula {shown(self.text)}: {shown(self._piece(node))} {what}")

    def _piece(self, node: ast.expr) -> str:
        return self._as_written(ast.get_source_segment(self.source.replace("^", "**"), node) or self.source)

    def _as_written(self, piece: str) -> str:
        return piece.replace("**", "^") if "^" in self.source else piece


def _refusal(text: str, piece: str, meant: str | None = None) -> InputError:
    hint = f" (did you mean {meant}?)" if meant else ""
    return InputError(f"formula {shown(text)}: {shown(piece)} is not allowed{hint}: use {ALLOWED}")


def _meant(node: ast.expr) -> str | None:
    """The known name that is most similar to an unknown one."""
    match node:
        case ast.Call(ast.Attribute(_, name) | ast.Name(name)) | ast.Attribute(_, name) | ast.Name(name):
            spelt = {"ln": "log"}.get(name, name.lower().replace("arc", "a"))
            return next(iter(get_close_matches(spelt, ["x", "y", *CONSTANTS, *FUNCTIONS], n=1)), None)
    return None


def _number(literal: int | float) -> float:
    try:
        return float(literal)
    except OverflowError:  # an integer larger than any float
        return inf


def _nesting(source: str) -> int:
    depth = deepest = 0
    for character in source:
        depth += (character == "(") - (character == ")")
        deepest = max(deepest, depth)
    return deepest
