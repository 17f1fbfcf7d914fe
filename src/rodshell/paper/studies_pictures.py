"""The two charts of the studies: G0's change with the parameters, and with the penalties."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rodshell.paper.charts import Chart, Series, charts_svg

if TYPE_CHECKING:
    from rodshell.paper.studies import Line

FULL, RING, BOX = "\N{BLACK CIRCLE}", "\N{LARGE CIRCLE}", "\N{WHITE SQUARE}"
PARAMETERS = {
    "E": ("#1f5f8b", FULL), "r": ("#a8552a", FULL), "g": ("#2f8f4e", FULL), "H": ("#8a3fa0", FULL),
    "EA alone": ("#22282f", RING), "EI alone": ("#b8862a", BOX),
}  # fmt: skip
PENALTIES = {
    "C1 explicit": ("#1f5f8b", FULL), "C1 implicit": ("#a8552a", BOX), "C2, 2 linkers": ("#2f8f4e", FULL),
    "C2, 4 linkers": ("#8a3fa0", FULL),
}  # fmt: skip
LEAST = 1e-5  # [mm]: less is not drawn


def studies_svg(lines: Sequence[Line]) -> str:
    """Both charts."""
    across = ("(a)  times the base case", "(b)  C1 over 1e6 EI, C2 over GJ/l")
    return charts_svg(
        [
            Chart(
                _series(lines, looks),
                title,
                "change of G0, rms [mm]",
                [(f"{sign} {name}", colour) for name, (colour, sign) in looks.items()],
            )
            for looks, title in zip((PARAMETERS, PENALTIES), across, strict=True)
        ]
    )


def _series(lines: Sequence[Line], looks: dict[str, tuple[str, str]]) -> list[Series]:
    """A line for each thing that is changed, broken at the base case, where nothing changes."""
    result = []
    for changed, (colour, sign) in looks.items():
        points = [(one.factor, 1e3 * one.change_rms) for one in lines if one.changed == changed]
        base = next((k for k, (_, y) in enumerate(points) if y == 0.0), 0)
        for part in (points[:base], points[base:]):
            seen = [(x, y) for x, y in part if y > LEAST]
            if seen:
                x, y = zip(*seen, strict=True)
                result.append(Series(x, y, colour, sign, lined=True))
    return result
