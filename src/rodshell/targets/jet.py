"""Second-order forward differentiation: a value with its exact gradient and Hessian in two variables."""

from collections.abc import Callable
from numbers import Real
from typing import Any, NoReturn

import numpy as np

from rodshell.arrays import Floats

_Part = Any
"""A part of a jet: an array, a float where it is constant, or a jet."""

LN2, _LN10 = float(np.log(2.0)), float(np.log(10.0))


class Jet:
    """A function of x and y at n points: value, gradient and Hessian through arithmetic and numpy functions.

    A part that is constant stays a float, and 0.0 and 1.0 cost nothing: most parts of x, of y and of functions of
    a single variable. Parts may be jets: a jet of jets has higher derivatives. Operations without a derivative here
    (comparisons, np.where, np.maximum, float()) are refused with a TypeError.

    Args:
        value, dx, dy, dxx, dxy, dyy: (n,) arrays, floats or jets.
    """

    __slots__ = ("dx", "dxx", "dxy", "dy", "dyy", "value")

    def __init__(
        self,
        value: _Part,
        dx: _Part = 0.0,
        dy: _Part = 0.0,
        dxx: _Part = 0.0,
        dxy: _Part = 0.0,
        dyy: _Part = 0.0,
    ) -> None:
        self.value, self.dx, self.dy, self.dxx, self.dxy, self.dyy = value, dx, dy, dxx, dxy, dyy

    @staticmethod
    def variables(x: _Part, y: _Part) -> tuple["Jet", "Jet"]:
        """The variables `x` and `y` (n,) as jets."""
        return Jet(x, dx=1.0), Jet(y, dy=1.0)

    def __add__(self, other: Any) -> "Jet":
        return _add(self, other)

    __radd__ = __add__

    def __sub__(self, other: Any) -> "Jet":
        return _subtract(self, other)

    def __rsub__(self, other: Any) -> "Jet":
        return _subtract(other, self)

    def __mul__(self, other: Any) -> "Jet":
        return _multiply(self, other)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> "Jet":
        return _divide(self, other)

    def __rtruediv__(self, other: Any) -> "Jet":
        return _divide(other, self)

    def __pow__(self, other: Any) -> Any:
        return _power(self, other)

    def __rpow__(self, other: Any) -> Any:
        return _power(other, self)

    def __neg__(self) -> "Jet":
        return Jet(-self.value, -self.dx, -self.dy, -self.dxx, -self.dxy, -self.dyy)

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

    __array__ = __bool__ = __float__ = __int__ = __len__ = __iter__ = _refuse
    __lt__ = __le__ = __gt__ = __ge__ = _refuse
    __eq__ = __ne__ = _refuse
    __hash__ = None  # type: ignore[assignment]


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


def _add(a: Any, b: Any) -> Jet:
    if b.__class__ is not Jet:
        return Jet(a.value + b, a.dx, a.dy, a.dxx, a.dxy, a.dyy)
    if a.__class__ is not Jet:
        return Jet(a + b.value, b.dx, b.dy, b.dxx, b.dxy, b.dyy)
    return Jet(
        a.value + b.value,
        _plus(a.dx, b.dx),
        _plus(a.dy, b.dy),
        _plus(a.dxx, b.dxx),
        _plus(a.dxy, b.dxy),
        _plus(a.dyy, b.dyy),
    )


def _subtract(a: Any, b: Any) -> Jet:
    if b.__class__ is not Jet:
        return Jet(a.value - b, a.dx, a.dy, a.dxx, a.dxy, a.dyy)
    if a.__class__ is not Jet:
        return Jet(a - b.value, -b.dx, -b.dy, -b.dxx, -b.dxy, -b.dyy)
    return Jet(
        a.value - b.value,
        _minus(a.dx, b.dx),
        _minus(a.dy, b.dy),
        _minus(a.dxx, b.dxx),
        _minus(a.dxy, b.dxy),
        _minus(a.dyy, b.dyy),
    )


def _multiply(a: Any, b: Any) -> Jet:
    if a.__class__ is not Jet:
        a, b = b, a
    f, p, q = a.value, a.dx, a.dy
    if b.__class__ is not Jet:
        return Jet(f * b, _times(p, b), _times(q, b), _times(a.dxx, b), _times(a.dxy, b), _times(a.dyy, b))
    g, r, s = b.value, b.dx, b.dy
    return Jet(
        f * g,
        _plus(_times(f, r), _times(p, g)),
        _plus(_times(f, s), _times(q, g)),
        _plus(_plus(_times(f, b.dxx), _times(a.dxx, g)), _times(2.0, _times(p, r))),
        _plus(_plus(_times(f, b.dxy), _times(a.dxy, g)), _plus(_times(p, s), _times(q, r))),
        _plus(_plus(_times(f, b.dyy), _times(a.dyy, g)), _times(2.0, _times(q, s))),
    )


def _divide(a: Any, b: Any) -> Jet:
    if b.__class__ is not Jet:
        return Jet(a.value / b, _over(a.dx, b), _over(a.dy, b), _over(a.dxx, b), _over(a.dxy, b), _over(a.dyy, b))
    a = a if a.__class__ is Jet else Jet(a)
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
        return _exp(_multiply(_log(a) if a.__class__ is Jet else np.log(a), b))
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


def _chain(u: Jet, value: _Part, d1: _Part, d2: _Part) -> Jet:
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


def _exp(u: Jet) -> Jet:
    f = np.exp(u.value)
    return _chain(u, f, f, f)


def _expm1(u: Jet) -> Jet:
    d = np.exp(u.value)
    return _chain(u, np.expm1(u.value), d, d)


def _log(u: Jet) -> Jet:
    d = 1.0 / u.value
    return _chain(u, np.log(u.value), d, -(d * d))


def _log1p(u: Jet) -> Jet:
    d = 1.0 / (1.0 + u.value)
    return _chain(u, np.log1p(u.value), d, -(d * d))


def _sqrt(u: Jet) -> Jet:
    f = np.sqrt(u.value)
    d = 0.5 / f
    return _chain(u, f, d, -(d * d) / f)


def _sin(u: Jet) -> Jet:
    f = np.sin(u.value)
    return _chain(u, f, np.cos(u.value), -f)


def _cos(u: Jet) -> Jet:
    f = np.cos(u.value)
    return _chain(u, f, -np.sin(u.value), -f)


def _tan(u: Jet) -> Jet:
    f = np.tan(u.value)
    d = 1.0 + f * f
    return _chain(u, f, d, 2.0 * f * d)


def _arcsin(u: Jet) -> Jet:
    d = 1.0 / np.sqrt(1.0 - u.value * u.value)
    return _chain(u, np.arcsin(u.value), d, u.value * d * d * d)


def _arccos(u: Jet) -> Jet:
    d = -1.0 / np.sqrt(1.0 - u.value * u.value)
    return _chain(u, np.arccos(u.value), d, u.value * d * d * d)


def _arctan(u: Jet) -> Jet:
    d = 1.0 / (1.0 + u.value * u.value)
    return _chain(u, np.arctan(u.value), d, -2.0 * u.value * d * d)


def _sinh(u: Jet) -> Jet:
    f = np.sinh(u.value)
    return _chain(u, f, np.cosh(u.value), f)


def _cosh(u: Jet) -> Jet:
    f = np.cosh(u.value)
    return _chain(u, f, np.sinh(u.value), f)


def _tanh(u: Jet) -> Jet:
    f = np.tanh(u.value)
    d = 1.0 - f * f
    return _chain(u, f, d, -2.0 * f * d)


def _hypot(a: Any, b: Any) -> Jet:
    return _sqrt(_add(a * a, b * b))


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
    np.sqrt: _sqrt,
    np.hypot: _hypot,
    np.exp: _exp,
    np.exp2: lambda u: _exp(_multiply(u, LN2)),
    np.expm1: _expm1,
    np.log: _log,
    np.log2: lambda u: _divide(_log(u), LN2),
    np.log10: lambda u: _divide(_log(u), _LN10),
    np.log1p: _log1p,
    np.sin: _sin,
    np.cos: _cos,
    np.tan: _tan,
    np.arcsin: _arcsin,
    np.arccos: _arccos,
    np.arctan: _arctan,
    np.sinh: _sinh,
    np.cosh: _cosh,
    np.tanh: _tanh,
}
"""The derivatives of numpy functions; any other function is refused."""


def differences(function: Callable[[Any, Any], Any], x: Floats, y: Floats, step: float) -> Jet:
    """Differentiate a function of plain arrays by central differences of fourth order.

    Args:
        function: z(x, y) of arrays; it is called once with all 17 points of the stencil.
        x, y: (n,) points.
    """
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
