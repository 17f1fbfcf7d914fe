"""Height formulas as people write them: "0.1 - 2*x^2 - y^2" becomes a function of x and y, without running any code."""

import ast
import operator
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from difflib import get_close_matches
from math import e, isfinite, pi
from typing import Any

import numpy as np

from gridshell.errors import InputError
from gridshell.units import shown

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

LONGEST = 4000  # characters; Python's parser is safe with texts of this length
DEEPEST = 100  # parentheses in each other
_FOREIGN = re.compile(r"[^A-Za-z0-9_.,+\-*/^() ]|//|__")

Slot = int
Step = tuple[Callable[..., Any], Slot, Slot | None]


@dataclass(frozen=True)
class Formula:
    """z = f(x, y), callable with numbers, arrays or jets. Make one with `parse_formula`.

    Parameters
    ----------
    text : as it was written.
    constants : numbers in slots 2, 3, ...; slots 0 and 1 are x and y.
    steps : the straight-line program, each a function of one or two earlier slots whose result takes the next;
        every distinct part of the formula once.
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
    """Read a formula in x and y: numbers, + - * / ^ (or **), parentheses, pi, e and the functions in `FUNCTIONS`.

    Raises
    ------
    InputError : anything else; one sentence that names the piece and lists what is allowed.
    """
    if not isinstance(text, str):
        raise InputError(f"a formula must be text such as {shown('0.1 - 2*x^2 - y^2')}, not {shown(text)}")
    if len(text) > LONGEST:
        raise InputError(f"the formula has {len(text)} characters, and at most {LONGEST} are read: write a shorter one")
    source = " ".join(text.split())
    if not source:
        raise InputError(f"the formula is empty: write z in {ALLOWED}")
    if foreign := _FOREIGN.search(source):
        raise _refusal(text, foreign[0])
    if _nesting(source) > DEEPEST:
        raise InputError(f"formula {shown(text)}: more than {DEEPEST} parentheses in each other: write a simpler one")
    return _Compiler(text, source.replace("^", "**")).formula()


class _Compiler:
    """Turns Python's syntax tree into a straight-line program, refusing every node that it does not know."""

    def __init__(self, text: str, source: str) -> None:
        self.text, self.source = text, source
        self.numbers: list[float] = []
        self.steps: list[tuple[Callable[..., Any], Any, Any]] = []
        self.known: dict[tuple[Any, ...], Any] = {}

    def formula(self) -> Formula:
        result = self._walk(self._parse())
        if isinstance(result, float):  # one height for every x: added to 0 x, so that shapes are kept
            result = self._step(operator.add, self._step(operator.mul, "x", 0.0), result)
        elif not self.steps or result != len(self.steps) - 1:
            result = self._step(operator.add, result, 0.0)  # x or y alone
        constants = tuple(dict.fromkeys(a for step in self.steps for a in step[1:] if isinstance(a, float)))
        place: dict[Any, Slot] = {"x": 0, "y": 1, None: -1}
        place |= {number: 2 + k for k, number in enumerate(constants)}

        def slot(operand: Any) -> Slot:
            return 2 + len(constants) + operand if isinstance(operand, int) else place[operand]

        steps = tuple((f, slot(a), None if b is None else slot(b)) for f, a, b in self.steps)
        return Formula(self.text, constants, steps)

    def _parse(self) -> ast.expr:
        try:
            return ast.parse(self.source, mode="eval").body
        except SyntaxError as reason:
            rest = self.source[max((reason.offset or 1) - 1, 0) :]
            where = f"from {shown(rest)} on" if rest else "to its end"
            raise InputError(
                f"formula {shown(self.text)} cannot be read {where}: write it with {ALLOWED}; a product needs its *"
            ) from None
        except (ValueError, MemoryError, RecursionError):
            raise InputError(f"formula {shown(self.text)} is nested too deeply: write a simpler one") from None

    def _walk(self, root: ast.expr) -> Any:
        """Operands first, by a stack of our own: a long sum is a deep tree."""
        done: dict[ast.expr, Any] = {}
        stack = [root]
        while stack:
            node = stack[-1]
            waiting = [child for child in self._operands(node) if child not in done]
            if waiting:
                stack.extend(reversed(waiting))
            else:
                done[stack.pop()] = self._operand(node, done)
        return done[root]

    def _operands(self, node: ast.expr) -> list[ast.expr]:
        match node:
            case ast.BinOp(left, op, right) if type(op) in OPERATORS:
                return [left, right]
            case ast.UnaryOp(ast.USub() | ast.UAdd(), inner):
                return [inner]
            case ast.Call(ast.Name(name), args, []) if name in FUNCTIONS:
                if len(args) != 1 or isinstance(args[0], ast.Starred):
                    raise InputError(
                        f"formula {shown(self.text)}: {name} takes one value, not {len(args)}: write {name}(...)"
                    )
                return args
            case ast.Name(name) if name in ("x", "y") or name in CONSTANTS:
                return []
            case ast.Constant(value) if type(value) in (int, float):
                return []
        raise _refusal(self.text, self._piece(node), _hint(node))

    def _operand(self, node: ast.expr, done: dict[ast.expr, Any]) -> Any:
        """A float, "x", "y" or the number of a step."""
        match node:
            case ast.Name(name):
                return CONSTANTS.get(name, name)
            case ast.Constant(value):
                return self._finite(float, (value,), node)
            case ast.UnaryOp(ast.UAdd(), inner):
                return done[inner]
            case ast.UnaryOp(_, inner):
                function, operands = operator.neg, (done[inner],)
            case ast.BinOp(left, op, right):
                function, operands = OPERATORS[type(op)], (done[left], done[right])
                if function is operator.truediv and operands[1] == 0.0:
                    raise InputError(f"formula {shown(self.text)}: {shown(self._piece(node))} divides by zero")
            case ast.Call(ast.Name(name), [inner]):
                function, operands = FUNCTIONS[name], (done[inner],)
        if all(isinstance(operand, float) for operand in operands):
            return self._finite(function, tuple(np.float64(operand) for operand in operands), node)
        return self._step(function, *operands)

    def _step(self, function: Callable[..., Any], a: Any, b: Any = None) -> Any:
        key = function, a, b
        if key not in self.known:
            self.known[key] = len(self.steps)
            self.steps.append(key)
        return self.known[key]

    def _finite(self, function: Callable[..., Any], operands: tuple[Any, ...], node: ast.expr) -> float:
        """The value of a constant piece."""
        try:
            with np.errstate(all="ignore"):
                value = float(function(*operands))
        except OverflowError:  # an integer past the largest float
            value = np.inf
        if not isfinite(value):
            piece = shown(self._piece(node))
            raise InputError(f"formula {shown(self.text)}: {piece} is no finite number: write a value that is")
        return value

    def _piece(self, node: ast.expr) -> str:
        return ast.get_source_segment(self.source, node) or self.source


def _refusal(text: str, piece: str, hint: str = "") -> InputError:
    return InputError(f"formula {shown(text)}: {shown(piece)} is not allowed{hint}: use {ALLOWED}")


def _hint(node: ast.expr) -> str:
    """What may have been meant by an unknown name."""
    match node:
        case ast.Call(ast.Attribute(_, name)) | ast.Call(ast.Name(name)) | ast.Attribute(_, name) | ast.Name(name):
            spelt = {"ln": "log", "abs": ""}.get(name, name.lower().replace("arc", "a"))
            near = get_close_matches(spelt, ["x", "y", *CONSTANTS, *FUNCTIONS], n=1)
            return f" (did you mean {near[0]}?)" if near else ""
    return ""


def _nesting(source: str) -> int:
    depth = deepest = 0
    for character in source:
        depth += (character == "(") - (character == ")")
        deepest = max(deepest, depth)
    return deepest
