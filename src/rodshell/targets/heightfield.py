"""A surface z = f(x, y) over a disc or a rectangle, from a formula or from a Python function.

Formulas are written as usual: "0.1 - 2*x^2 - y^2" is parsed into a function, without running any code.
"""

import ast
import operator
import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import cached_property
from itertools import accumulate
from math import e, isfinite, pi
from typing import Any, NamedTuple

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.targets.height_function import Heights, climb, relative_radius, require_smooth, sample, trusted_region
from rodshell.targets.jet import Jet
from rodshell.targets.rim import Disc, Rectangle
from rodshell.targets.target import Implicit
from rodshell.targets.wall_below_rim import WalledTarget
from rodshell.units import as_float, shown
from rodshell.validation import instance

_FUNCTIONS: dict[str, Callable[[Any], Any]] = {
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
_CONSTANTS = {"pi": pi, "e": e}
_OPERATORS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
ALLOWED = "x, y, numbers, pi, e, + - * / ^, parentheses and " + ", ".join(_FUNCTIONS)

FOREIGN = {"−": "-", "·": "*", "×": "*", "÷": "/", "²": "^2", "³": "^3", "=": "only the part after it"}
LONGEST = 4000  # characters; Python's parser is safe with texts of this length
DEEPEST = 100  # nested parentheses
TIE = 1e-6  # of the size: peaks this close in height count as equally high
SAME = 1e-3  # of the size: refined peaks this close are the same
_FOREIGN = re.compile(r"[^A-Za-z0-9_.,+\-*/^() ]|//|__")

_Slot = int
Step = tuple[Callable[..., Any], _Slot, _Slot | None]


@dataclass(frozen=True)
class Formula:
    """z = f(x, y), callable with numbers, arrays or jets. Make one with `parse_formula`.

    Args:
        text: the formula as it was written.
        constants: numbers in slots 2, 3, ...; slots 0 and 1 are x and y.
        steps: a straight-line program: functions of one or two earlier slots, whose results go into the next slots.
            Equal parts of the formula are evaluated once.
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

    Args:
        text: numbers, x, y, pi, e, + - * / ^ (or **), parentheses and `_FUNCTIONS`.

    Raises:
        InputError: anything else; one sentence that names the wrong part and lists what is allowed.
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
    """Turns Python's syntax tree into a straight-line program, and refuses every node that it does not know."""

    def __init__(self, text: str, source: str) -> None:
        self.text, self.source = text, source
        self.steps: dict[tuple[Callable[..., Any], _Operand, _Operand | None], _Result] = {}

    def formula(self) -> Formula:
        result = self._walk(self._parse())
        if isinstance(result, float):  # a constant height: added to 0 x, so that shapes are kept
            self._step(operator.add, self._step(operator.mul, "x", 0.0), result)
        elif isinstance(result, str):
            self._step(operator.pos, result)
        constants = dict.fromkeys(a for step in self.steps for a in step[1:] if isinstance(a, float))
        operands: list[_Operand] = ["x", "y", *constants, *self.steps.values()]
        slot_of: dict[_Operand | None, _Slot | None] = {None: None}
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
        """Operands first, with an explicit stack: a long sum is a deep tree."""
        done: dict[ast.expr, _Operand] = {}
        stack = [root]
        while stack:
            function, parts = self._read(stack[-1])
            waiting = [part for part in parts if part not in done]
            if waiting:
                stack.extend(reversed(waiting))
            else:
                node = stack.pop()
                done[node] = self._apply(node, function, [done[part] for part in parts]) if parts else function()
        return done[root]

    def _read(self, node: ast.expr) -> tuple[Callable[..., Any], list[ast.expr]]:
        """The function of a node, and its operands; of a number or a name one without operands."""
        match node:
            case ast.BinOp(left, op, right) if type(op) in _OPERATORS:
                return _OPERATORS[type(op)], [left, right]
            case ast.UnaryOp(ast.USub() | ast.UAdd() as op, inner):
                return operator.neg if isinstance(op, ast.USub) else operator.pos, [inner]
            case ast.Call(ast.Name(name), args, []) if name in _FUNCTIONS:
                if len(args) != 1:
                    raise self._wrong(node, f"has {len(args)} values: write {name}(...) with one")
                return _FUNCTIONS[name], args
            case ast.Name(name) if name in _FUNCTIONS:
                raise self._wrong(node, f"has no value: write {name}(...)")
            case ast.Name(name) if name in ("x", "y") or name in _CONSTANTS:
                return lambda: _CONSTANTS.get(name, name), []
            case ast.Constant(int() | float() as value) if type(value) is not bool:
                return lambda: self._finite(node, as_float(value)), []
        raise _refusal(self.text, self._piece(node), _meant(node))

    def _apply(self, node: ast.expr, function: Callable[..., Any], operands: list[_Operand]) -> _Operand:
        """A step of the program, or a number where all operands are numbers."""
        if function is operator.truediv and operands[1] == 0.0:
            raise self._wrong(node, "divides by zero: write a divisor other than 0")
        if function is operator.pos:
            return operands[0]
        numbers = [np.float64(operand) for operand in operands if isinstance(operand, float)]
        if len(numbers) < len(operands):
            return self._step(function, *operands)
        with np.errstate(all="ignore"):
            return self._finite(node, float(function(*numbers)))

    def _finite(self, node: ast.expr, value: float) -> float:
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
            return next(iter(get_close_matches(spelt, ["x", "y", *_CONSTANTS, *_FUNCTIONS], n=1)), None)
    return None


def _nesting(source: str) -> int:
    return max(accumulate((character == "(") - (character == ")") for character in source))


@dataclass(frozen=True, kw_only=True)
class HeightField(WalledTarget):
    """z = f(x, y) over a domain, at whose edge the shell ends.

    The surface is continued past the edge by the formula itself. Where that is no longer finite or becomes steep (slope
    4, or twice the steepest inside) within 1.6 times the domain, Taylor polynomials of second degree continue it, so
    that the curvature stays continuous.

    Args:
        formula: in x and y [m], such as "0.1 - 2*x^2 - y^2"; see `parse_formula`.
        function: instead of a formula: z(x, y) of arrays (n,) [m]. If it consists of arithmetic and numpy functions,
            its derivatives are exact (`Jet`). Any other is differentiated by central differences of fourth order, is
            called up to 1.61 times the domain and must be smooth there: creases in it are not detected.
        domain: a disc or a rectangle, centred on the origin.

    Raises:
        InputError: not exactly one of formula and function; a formula that cannot be read; a height, slope or curvature
            in the domain that is not finite; a step or a crease. The message says where, and names a remedy.
    """

    formula: str | None = None
    function: Callable[[Any, Any], Any] | None = None
    domain: Disc | Rectangle
    name: str = "heightfield"

    def __post_init__(self) -> None:
        if (self.formula is None) == (self.function is None):
            raise InputError("a height field needs either a formula or a function: give exactly one of them")
        if self.function is not None and not callable(self.function):
            instance("function", self.function, Callable, "a function z(x, y) of arrays")
        instance("name", self.name, str, "text")
        if not isinstance(self.domain, Disc | Rectangle):
            raise InputError(f"domain = {shown(self.domain)}: use Disc(radius) or Rectangle((width, depth))")
        _ = self._heights  # examines the whole domain

    def __repr__(self) -> str:
        source = f"formula={self.formula!r}" if self.function is None else f"function={_qualified_name(self.function)}"
        return f"HeightField({source}, domain={self.domain})"

    @property
    def plan(self) -> Disc | Rectangle:
        return self.domain

    def implicit(self, x: Floats) -> Implicit:
        jet = self._heights.jet(x[:, 0], x[:, 1])
        gradient = np.empty((len(x), 3))
        gradient[:, 0], gradient[:, 1], gradient[:, 2] = -jet.dx, -jet.dy, 1.0
        hessian = np.zeros((len(x), 3, 3))
        hessian[:, 0, 0], hessian[:, 1, 1] = -jet.dxx, -jet.dyy
        hessian[:, 0, 1] = hessian[:, 1, 0] = -jet.dxy
        return Implicit(x[:, 2] - jet.value, gradient, hessian)

    def height_at(self, xy: Floats) -> Floats:
        z = self._heights.jet(xy[:, 0], xy[:, 1]).value
        return np.array(np.broadcast_to(z, len(xy)))

    @cached_property
    def summit(self) -> tuple[float, float]:
        """x, y of the highest point [m]; the centre where that is on the edge, or where there are equal peaks.

        An anchor on the edge would have half of its axis outside; between equal peaks only the centre keeps the
        symmetry.
        """
        peaks = climb(self._heights, self.domain)
        z = self.height_at(peaks)
        tied = peaks[z >= z.max() - TIE * self.size]
        best = peaks[int(np.argmax(z))]
        on_edge = relative_radius(self.domain, *tied.T).max() > 1 - 1e-9
        if on_edge or np.linalg.norm(tied - best, axis=1).max() > SAME * self.size:
            return 0.0, 0.0
        x, y = np.where(np.abs(best) < 1e-9 * self.size, 0.0, best)
        return float(x), float(y)

    def parameters(self) -> dict[str, object]:
        shape: dict[str, object] = (
            {"domain": "disc", "radius": self.domain.radius}
            if isinstance(self.domain, Disc)
            else {"domain": "rectangle", "size": list(self.domain.size)}
        )
        source: dict[str, object] = {"formula": self.formula}
        if self.function is not None:
            source["function"] = _qualified_name(self.function)
        return {"kind": "heightfield", **source, **shape}

    @cached_property
    def _heights(self) -> Heights:
        if self.function is None:
            label = f"the height field {shown(self.formula)}"
            heights = Heights(parse_formula("" if self.formula is None else self.formula), self.size)
        else:
            label = f"the height field of {_qualified_name(self.function)}"
            heights = Heights(self.function, self.size, exact=_takes_jets(self.function, self.size))
        with np.errstate(all="ignore"):
            samples = sample(heights, self.domain)
            require_smooth(heights, self.domain, samples, label)
            return replace(heights, trusted=trusted_region(heights, self.domain, samples, label))


def _takes_jets(function: Callable[[Any, Any], Any], size: float) -> bool:
    """Whether a function can be differentiated exactly; one that does not take arrays is refused."""
    x, y = 0.3 * size * np.array([[0.1, 0.5, -0.7, 0.2, -0.3], [0.6, -0.4, -0.2, 0.3, 0.5]])
    with np.errstate(all="ignore"):
        try:
            plain = np.broadcast_to(np.asarray(function(x.copy(), y.copy())), x.shape)
            if plain.dtype.kind not in "fiu":
                raise TypeError("its heights are not real numbers")
        except Exception as reason:
            raise InputError(
                f"{_qualified_name(function)}(x, y) fails with arrays of plan coordinates ({reason}): "
                "return one height for each point, with numpy functions (np.exp, not math.exp)"
            ) from None
        try:
            jet = function(*Jet.variables(x, y))
        except Exception:  # whatever the reason: it takes arrays
            return False
    value = jet.value if isinstance(jet, Jet) else jet
    exact = isinstance(jet, Jet) or np.ndim(jet) == 0
    return exact and bool(np.allclose(value + 0 * x, plain, rtol=1e-12, atol=0, equal_nan=True))


def _qualified_name(function: Callable[..., Any]) -> str:
    named = function if hasattr(function, "__qualname__") else type(function)
    return f"{named.__module__}.{named.__qualname__}"
