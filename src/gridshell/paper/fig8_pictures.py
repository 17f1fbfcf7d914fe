"""The two charts of Fig 8: computing time against time step, and against the number of unknowns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from gridshell.output.svg import document, label, number, tag

if TYPE_CHECKING:
    from gridshell.paper.fig8 import Timing

PAPER, INK, SOFT = "#fdfdfb", "#22282f", "#7b838a"
COLOURS = {"hemisphere": "#1f5f8b", "paraboloid": "#a8552a", "ellipsoid": "#2f8f4e"}
SIGNS = {
    "explicit": "\N{BLACK CIRCLE}",
    "shared": "\N{WHITE CIRCLE}",
    "implicit": "\N{WHITE SQUARE}",
    "ours": "\N{BLACK DIAMOND}",
}
WIDTH, HEIGHT, EDGE, GAP, TEXT = 360.0, 260.0, 56.0, 40.0, 11.0  # drawing units
MARGIN = 0.08  # of a chart's logarithmic span, at each end


def times_svg(timings: Sequence[Timing]) -> str:
    """Both charts, logarithmic, and what the signs mean."""
    width, height = 2 * (WIDTH + EDGE) + GAP, HEIGHT + 2 * EDGE + 20
    edge = next(one.edge for one in timings if one.method == "ours")
    by_step = [one for one in timings if one.step and one.edge == edge]
    charts = (
        _chart(by_step, lambda one: 1e3 * one.step, "(a)  time step [ms]"),
        _chart(timings, lambda one: float(one.dofs), "(b)  unknowns"),
    )
    parts = [tag("rect", x=0, y=0, width=width, height=height, fill=PAPER)]
    for across, chart in enumerate(charts):
        left = EDGE + across * (WIDTH + EDGE + GAP / 2)
        parts.append(tag("g", *chart, transform=f"translate({number(left)} 24)"))
    words = "   ".join(f"{SIGNS[method]} {method}" for method in SIGNS if any(one.method == method for one in timings))
    parts.append(label(words, EDGE, height - 14, TEXT, fill=INK))
    for k, name in enumerate(dict.fromkeys(one.target for one in timings)):
        parts.append(label(name, EDGE + 330 + 90 * k, height - 14, TEXT, fill=COLOURS.get(name, INK)))
    return document((0, 0, width, height), *parts)


def _chart(timings: Sequence[Timing], across: Callable[[Timing], float], title: str) -> list[str]:
    x = np.array([across(one) for one in timings])
    y = np.array([one.seconds for one in timings])
    at_x, at_y = _scale(x, WIDTH), _scale(y, HEIGHT)
    parts = [
        tag("rect", x=0, y=0, width=WIDTH, height=HEIGHT, fill="none", stroke=SOFT, stroke_width=0.8),
        label(title, WIDTH / 2, HEIGHT + 34, TEXT, fill=INK, text_anchor="middle"),
        label("time [s]", 0, -8, TEXT, fill=INK),
    ]
    for value in np.unique(x):
        place = float(at_x(value))
        parts.append(tag("line", x1=place, x2=place, y1=HEIGHT, y2=HEIGHT + 4, stroke=SOFT))
        if len(np.unique(x)) <= 6:
            parts.append(label(f"{value:.3g}", place, HEIGHT + 16, 9.0, fill=SOFT, text_anchor="middle"))
    if len(np.unique(x)) > 6:
        ends = (x.min(), x.max())
        parts += [label(f"{v:.0f}", float(at_x(v)), HEIGHT + 16, 9.0, fill=SOFT, text_anchor="middle") for v in ends]
    low, high = int(np.floor(np.log10(y.min()))), int(np.ceil(np.log10(y.max())))
    for value in np.outer(10.0 ** np.arange(low, high + 1), (1, 2, 5)).ravel():
        place = HEIGHT - float(at_y(value))
        if 0 <= place <= HEIGHT:
            parts.append(tag("line", x1=-4, x2=WIDTH, y1=place, y2=place, stroke="#e2e4e5", stroke_width=0.8))
            parts.append(label(f"{value:g}", -7, place + 3, 9.0, fill=SOFT, text_anchor="end"))
    for one, px, py in zip(timings, at_x(x).tolist(), at_y(y).tolist(), strict=True):
        colour = COLOURS.get(one.target, INK)
        parts.append(label(SIGNS[one.method], px, HEIGHT - py + 4, 13.0, fill=colour, text_anchor="middle"))
    return parts


def _scale(values: np.ndarray, room: float) -> Callable[[np.ndarray | float], np.ndarray]:
    """From a value to its place in a logarithmic chart."""
    low, high = np.log10(values.min()), np.log10(values.max())
    span = max(high - low, 0.1)
    return lambda value: room * (MARGIN + (1 - 2 * MARGIN) * (np.log10(value) - low) / span)
