"""Second-order forward differentiation: a value with its exact gradient and Hessian in two variables."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from numbers import Real
from typing import Any, NoReturn

import numpy as np

from rodshell.arrays import Floats

_Part = Any
"""A part of a jet: an array, a float where it is constant, or a jet."""

LN2, _LN10 = float(np.log(2.0)), float(np.log(10.0))


def _times(a: _Part, b: _Part) -> _Part:
    """a b, without arithmetic where a factor is a plain 0 or 1: a part that is zero everywhere stays so."""
    if a.__class__ is float:
        if a == 0.0:
            return 0.0
        if a == 1.0:
            return b
    if b.__class__ is float:
        if b == 0.0:
            return 0.0
        if b == 1.0:
            return a
    return a * b


def _plus(a: _Part, b: _Part) -> _Part:
    if a.__class__ is float and a == 0.0:
        return b
    if b.__class__ is float and b == 0.0:
        return a
    return a + b


def _minus(a: _Part, b: _Part) -> _Part:
    if b.__class__ is float and b == 0.0:
        return a
    if a.__class__ is float and a == 0.0:
        return -b
    return a - b


def _over(a: _Part, b: _Part) -> _Part:
    return 0.0 if a.__class__ is float and a == 0.0 else a / b


def _plain(part: _Part) -> Any:
    """The array in a jet of jets."""
    while part.__class__ is Jet:
        part = part.value
    return part


def _jet(a: Any) -> "Jet":
    return a if a.__class__ is Jet else Jet(a)


def _add(a: Any, b: Any) -> "Jet":
    a, b = _jet(a), _jet(b)
    return Jet(a.value + b.value, *map(_plus, a.parts[1:], b.parts[1:]))


def _subtract(a: Any, b: Any) -> "Jet":
    a, b = _jet(a), _jet(b)
    return Jet(a.value - b.value, *map(_minus, a.parts[1:], b.parts[1:]))


def _multiply(a: Any, b: Any) -> "Jet":
    if a.__class__ is not Jet:
        a, b = b, a
    f, p, q = a.value, a.dx, a.dy
    if b.__class__ is not Jet:
        return Jet(f * b, *[_times(part, b) for part in a.parts[1:]])
    g, r, s = b.value, b.dx, b.dy
    return Jet(
        f * g,
        _plus(_times(f, r), _times(p, g)),
        _plus(_times(f, s), _times(q, g)),
        _plus(_plus(_times(f, b.dxx), _times(a.dxx, g)), _times(2.0, _times(p, r))),
        _plus(_plus(_times(f, b.dxy), _times(a.dxy, g)), _plus(_times(p, s), _times(q, r))),
        _plus(_plus(_times(f, b.dyy), _times(a.dyy, g)), _times(2.0, _times(q, s))),
    )


def _divide(a: Any, b: Any) -> "Jet":
    a, b = _jet(a), _jet(b)
    g, r, s = b.value, b.dx, b.dy
    f = a.value / g
    # differentiate f g = a
    dx, dy = _over(_minus(a.dx, _times(f, r)), g), _over(_minus(a.dy, _times(f, s)), g)
    dxx = _minus(_minus(a.dxx, _times(f, b.dxx)), _times(2.0, _times(dx, r)))
    dxy = _minus(_minus(a.dxy, _times(f, b.dxy)), _plus(_times(dx, s), _times(dy, r)))
    dyy = _minus(_minus(a.dyy, _times(f, b.dyy)), _times(2.0, _times(dy, s)))
    return Jet(f, dx, dy, _over(dxx, g), _over(dxy, g), _over(dyy, g))


def _power(a: Any, b: Any) -> Any:
    if b.__class__ is Jet:
        return _smooth(np.exp, _multiply(np.log(a), b))
    u, c = a.value, b
    if isinstance(c, Real):
        c = float(c)
        if c == 0.0:
            return Jet(u * 0.0 + 1.0)
        if c == 1.0:
            return a
        if c == 2.0:
            return _chain(a, u * u, 2.0 * u, 2.0)
        if c == 3.0:
            return _chain(a, u * u * u, 3.0 * (u * u), 6.0 * u)
    return _chain(a, u**c, c * u ** (c - 1.0), c * (c - 1.0) * u ** (c - 2.0))


def _chain(u: "Jet", value: _Part, d1: _Part, d2: _Part) -> "Jet":
    """f(u) from f, f' and f'' at u's value."""
    p, q = u.dx, u.dy
    dx, dy = _times(d1, p), _times(d1, q)
    bend_x, bend_y = (dx, dy) if d2 is d1 else (_times(d2, p), _times(d2, q))
    return Jet(
        value,
        dx,
        dy,
        _plus(_times(d1, u.dxx), _times(bend_x, p)),
        _plus(_times(d1, u.dxy), _times(bend_x, q)),
        _plus(_times(d1, u.dyy), _times(bend_y, q)),
    )


def _swapped(rule: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    return lambda right, left: rule(left, right)


@dataclass(slots=True, eq=False, repr=False)
class Jet:
    """A function of x and y at n points: value, gradient and Hessian through arithmetic and numpy functions.

    A part that is constant stays a float, and 0.0 and 1.0 cost nothing: most parts of x, of y and of functions of
    a single variable. Parts may be jets: a jet of jets has higher derivatives. Operations without a derivative here
    (comparisons, np.where, np.maximum, float()) are refused with a TypeError.

    Args:
        value, dx, dy, dxx, dxy, dyy: (n,) arrays, floats or jets.
    """

    value: _Part
    dx: _Part = 0.0
    dy: _Part = 0.0
    dxx: _Part = 0.0
    dxy: _Part = 0.0
    dyy: _Part = 0.0

    @property
    def parts(self) -> tuple[_Part, ...]:
        """Value, first and second derivatives, in the order of the arguments."""
        return self.value, self.dx, self.dy, self.dxx, self.dxy, self.dyy

    @staticmethod
    def variables(x: _Part, y: _Part) -> tuple["Jet", "Jet"]:
        """The variables `x` and `y` (n,) as jets."""
        return Jet(x, dx=1.0), Jet(y, dy=1.0)

    def __neg__(self) -> "Jet":
        return Jet(*(-part for part in self.parts))

    def __pos__(self) -> "Jet":
        return self

    def __abs__(self) -> "Jet":
        return _chain(self, np.abs(self.value), np.sign(_plain(self.value)), 0.0)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        rule = _RULES.get(ufunc)
        if rule is None or method != "__call__" or options:
            return NotImplemented
        return rule(*inputs)

    def __array_function__(self, function: Any, *_: Any) -> NoReturn:
        raise TypeError(f"{getattr(function, '__name__', function)} has no derivative here")

    def _refuse(self, *_: Any) -> NoReturn:
        raise TypeError("a jet is not a plain array: use arithmetic and smooth numpy functions only")

    __add__ = __radd__ = _add
    __mul__ = __rmul__ = _multiply
    __sub__, __rsub__ = _subtract, _swapped(_subtract)
    __truediv__, __rtruediv__ = _divide, _swapped(_divide)
    __pow__, __rpow__ = _power, _swapped(_power)
    __array__ = __bool__ = __float__ = __int__ = __len__ = __iter__ = _refuse
    __lt__ = __le__ = __gt__ = __ge__ = _refuse
    __eq__ = __ne__ = _refuse
    __hash__ = None  # type: ignore[assignment]


# f'(u, f) and f''(u, f, f') of smooth functions f(u)
_DERIVATIVES: dict[np.ufunc, tuple[Callable[[_Part, _Part], _Part], Callable[[_Part, _Part, _Part], _Part]]] = {
    np.exp: (lambda u, f: f, lambda u, f, d: d),
    np.expm1: (lambda u, f: np.exp(u), lambda u, f, d: d),
    np.log: (lambda u, f: 1.0 / u, lambda u, f, d: -(d * d)),
    np.log1p: (lambda u, f: 1.0 / (1.0 + u), lambda u, f, d: -(d * d)),
    np.sqrt: (lambda u, f: 0.5 / f, lambda u, f, d: -(d * d) / f),
    np.sin: (lambda u, f: np.cos(u), lambda u, f, d: -f),
    np.cos: (lambda u, f: -np.sin(u), lambda u, f, d: -f),
    np.tan: (lambda u, f: 1.0 + f * f, lambda u, f, d: 2.0 * f * d),
    np.arcsin: (lambda u, f: 1.0 / np.sqrt(1.0 - u * u), lambda u, f, d: u * d * d * d),
    np.arccos: (lambda u, f: -1.0 / np.sqrt(1.0 - u * u), lambda u, f, d: u * d * d * d),
    np.arctan: (lambda u, f: 1.0 / (1.0 + u * u), lambda u, f, d: -2.0 * u * d * d),
    np.sinh: (lambda u, f: np.cosh(u), lambda u, f, d: f),
    np.cosh: (lambda u, f: np.sinh(u), lambda u, f, d: f),
    np.tanh: (lambda u, f: 1.0 - f * f, lambda u, f, d: -2.0 * f * d),
}


def _smooth(function: np.ufunc, u: Jet) -> Jet:
    first, second = _DERIVATIVES[function]
    f = function(u.value)
    d = first(u.value, f)
    return _chain(u, f, d, second(u.value, f, d))


_RULES: dict[np.ufunc, Callable[..., Any]] = {
    np.add: _add,
    np.subtract: _subtract,
    np.multiply: _multiply,
    np.divide: _divide,
    np.power: _power,
    np.float_power: _power,
    np.negative: Jet.__neg__,
    np.positive: Jet.__pos__,
    np.absolute: Jet.__abs__,
    np.fabs: Jet.__abs__,
    np.square: lambda u: _power(u, 2.0),
    np.reciprocal: lambda u: _divide(1.0, u),
    np.hypot: lambda a, b: _smooth(np.sqrt, _add(a * a, b * b)),
    np.exp2: lambda u: _smooth(np.exp, _multiply(u, LN2)),
    np.log2: lambda u: _divide(_smooth(np.log, u), LN2),
    np.log10: lambda u: _divide(_smooth(np.log, u), _LN10),
    **{function: partial(_smooth, function) for function in _DERIVATIVES},
}
"""The derivatives of numpy functions; any other function is refused."""


def differences(function: Callable[[Any, Any], Any], x: Floats, y: Floats, step: float) -> Jet:
    """z(x, y), a function of plain arrays, and its derivatives at points `x`, `y` (n,), by central differences of
    fourth order; it is called once with all 17 points of the stencil."""
    near, far = np.array([[1], [-1]]), np.array([[2], [-2]])
    zero = np.zeros((2, 1))
    corner = np.array([[1], [1], [-1], [-1]]), np.array([[1], [-1], [1], [-1]])
    across = np.concatenate([[[0]], near, far, zero, zero, corner[0], 2 * corner[0]]) * step
    up = np.concatenate([[[0]], zero, zero, near, far, corner[1], 2 * corner[1]]) * step
    stencil = (x + across).ravel(), (y + up).ravel()
    f = np.broadcast_to(np.asarray(function(*stencil), dtype=float), stencil[0].shape).reshape(17, -1)
    along_x, along_y, cross, wide = f[1:5], f[5:9], f[9:13], f[13:17]
    sign = np.array([1.0, -1.0, -1.0, 1.0])
    first = np.array([8.0, -8.0, -1.0, 1.0]) / (12 * step)
    second = np.array([16.0, 16.0, -1.0, -1.0]) / (12 * step**2)
    return Jet(
        f[0].copy(),
        first @ along_x,
        first @ along_y,
        second @ along_x - 30.0 * f[0] / (12 * step**2),
        (16.0 * sign @ cross - sign @ wide) / (48 * step**2),
        second @ along_y - 30.0 * f[0] / (12 * step**2),
    )
