"""The two charts of Fig 8: computing time against time step, and against the number of unknowns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from rodshell.paper.charts import Chart, Series, charts_svg
from rodshell.paper.panels import INK

if TYPE_CHECKING:
    from rodshell.paper.fig8 import Timing

COLOURS = {"hemisphere": "#1f5f8b", "paraboloid": "#a8552a", "ellipsoid": "#2f8f4e"}
SIGNS = {
    "explicit": "\N{BLACK CIRCLE}",
    "shared": "\N{WHITE CIRCLE}",
    "implicit": "\N{WHITE SQUARE}",
    "ours": "\N{BLACK DIAMOND}",
}


def times_svg(timings: Sequence[Timing]) -> str:
    """Both charts, and what the signs mean."""
    edge = next(one.edge for one in timings if one.method == "ours")
    by_step = [one for one in timings if one.step and one.edge == edge]
    legend = [(name, COLOURS.get(name, INK)) for name in dict.fromkeys(one.target for one in timings)]
    charts = (
        Chart(_series(by_step, lambda one: 1e3 * one.step), "(a)  time step [ms]", "time [s]", legend),
        Chart(_series(timings, lambda one: float(one.dofs)), "(b)  unknowns", "time [s]"),
    )
    methods = {one.method for one in timings}
    return charts_svg(charts, "   ".join(f"{sign} {method}" for method, sign in SIGNS.items() if method in methods))


def _series(timings: Sequence[Timing], across: Callable[[Timing], float]) -> list[Series]:
    """A series for each target and method."""
    result = []
    for target, method in dict.fromkeys((one.target, one.method) for one in timings):
        mine = sorted((across(one), one.seconds) for one in timings if (one.target, one.method) == (target, method))
        x, y = zip(*mine, strict=True)
        result.append(Series(x, y, COLOURS.get(target, INK), SIGNS[method]))
    return result
