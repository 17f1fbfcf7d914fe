"""A surface z = f(x, y) over a disc or a rectangle, from a formula or from a Python function."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.targets.domain import Disc, Rectangle
from rodshell.targets.formula import parse_formula
from rodshell.targets.height_function import Heights, climb, relative_radius, require_smooth, sample, trusted_region
from rodshell.targets.jet import Jet
from rodshell.targets.target import Implicit
from rodshell.targets.wall_below_rim import WalledTarget
from rodshell.units import shown
from rodshell.validation import instance

TIE = 1e-6  # of the size: peaks this close in height count as equally high
SAME = 1e-3  # of the size: refined peaks this close are one


@dataclass(frozen=True, kw_only=True)
class HeightField(WalledTarget):
    """z = f(x, y) over a domain, at whose edge the shell ends.

    The surface is continued past the edge by the formula itself. Where that is no longer finite or becomes steep (slope
    4, or twice the steepest inside) within 1.6 times the domain, Taylor polynomials of second degree continue it, so
    that the curvature stays continuous.

    Parameters
    ----------
    formula : in x and y [m], such as "0.1 - 2*x^2 - y^2"; see `parse_formula`.
    function : instead of a formula: z(x, y) of arrays (n,) [m]. If it consists of arithmetic and numpy functions, its
        derivatives are exact (`Jet`). Any other is differentiated by central differences of fourth order, is called up
        to 1.61 times the domain and must be smooth there: creases in it are not detected.
    domain : a disc or a rectangle, centred on the origin.
    name : of the target.

    Raises
    ------
    InputError : not exactly one of formula and function; a formula that cannot be read; a height, slope or curvature in
        the domain that is not finite; a step or a crease. The message says where, and names a remedy.
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
            heights = Heights(parse_formula(self.formula or ""), self.size)
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
