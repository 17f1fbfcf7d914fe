"""Logarithmic charts of the paper's figures."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from rodshell.arrays import Floats
from rodshell.output.svg import document, label, number, tag
from rodshell.paper.panels import INK, PAPER, SOFT, joined

WIDTH, HEIGHT, EDGE, GAP, TEXT = 360.0, 260.0, 56.0, 40.0, 11.0  # drawing units
MARGIN = 0.06  # of a chart's logarithmic span, at each end
LEGENDS = 3  # in a row
LINE = "#e2e4e5"


@dataclass(frozen=True)
class Series:
    """Points (x, y), all positive, with one sign in one colour; `lined`: with a line through them."""

    x: Sequence[float]
    y: Sequence[float]
    colour: str
    sign: str = "\N{BLACK CIRCLE}"
    lined: bool = False


@dataclass(frozen=True)
class Chart:
    """One chart; `legend`: words with their colours, under it."""

    series: Sequence[Series]
    across: str
    up: str
    legend: Sequence[tuple[str, str]] = ()


def charts_svg(charts: Sequence[Chart], words: str = "") -> str:
    """Charts side by side; `words` under all of them."""
    lines = max(-(-len(chart.legend) // LEGENDS) for chart in charts)
    width, height = len(charts) * (WIDTH + EDGE) + GAP, HEIGHT + 90 + 15 * lines + (22 if words else 0)
    parts = [tag("rect", x=0, y=0, width=width, height=height, fill=PAPER)]
    for across, chart in enumerate(charts):
        left = EDGE + across * (WIDTH + EDGE)
        parts.append(tag("g", *_marks(chart), transform=f"translate({number(left)} 24)"))
    parts.append(label(words, EDGE, height - 14, TEXT, fill=INK))
    return document((0, 0, width, height), *parts)


def _marks(chart: Chart) -> list[str]:
    x, y = (np.concatenate([getattr(one, name) for one in chart.series]) for name in "xy")
    at_x, at_y = _scale(x, WIDTH), _scale(y, HEIGHT)
    parts = [
        tag("rect", x=0, y=0, width=WIDTH, height=HEIGHT, fill="none", stroke=SOFT, stroke_width=0.8),
        label(chart.across, WIDTH / 2, HEIGHT + 34, TEXT, fill=INK, text_anchor="middle"),
        label(chart.up, 0, -8, TEXT, fill=INK),
    ]
    for value in _ticks(x):
        place = float(at_x(value))
        parts.append(tag("line", x1=place, x2=place, y1=0, y2=HEIGHT + 4, stroke=LINE, stroke_width=0.8))
        parts.append(label(f"{value:g}", place, HEIGHT + 16, 9.0, fill=SOFT, text_anchor="middle"))
    for value in _ticks(y):
        place = HEIGHT - float(at_y(value))
        parts.append(tag("line", x1=-4, x2=WIDTH, y1=place, y2=place, stroke=LINE, stroke_width=0.8))
        parts.append(label(f"{value:g}", -7, place + 3, 9.0, fill=SOFT, text_anchor="end"))
    for one in chart.series:
        at = np.column_stack([at_x(np.asarray(one.x)), HEIGHT - at_y(np.asarray(one.y))])
        if one.lined:
            parts.append(tag("polyline", points=joined(at), fill="none", stroke=one.colour, stroke_width=1.0))
        parts += [label(one.sign, px, py + 4, 13.0, fill=one.colour, text_anchor="middle") for px, py in at.tolist()]
    for k, (text, colour) in enumerate(chart.legend):
        left, down = k % LEGENDS * WIDTH / LEGENDS, HEIGHT + 56 + 15 * (k // LEGENDS)
        parts.append(label(text, left, down, TEXT, fill=colour))
    return parts


def _scale(values: Floats, room: float) -> Callable[[Floats | float], Floats]:
    """From a value to its place in a logarithmic chart."""
    low, high = np.log10(values.min()), np.log10(values.max())
    span = max(high - low, 0.1)
    return lambda value: room * (MARGIN + (1 - 2 * MARGIN) * (np.log10(value) - low) / span)


def _ticks(values: Floats) -> Floats:
    """Powers of ten between the smallest and the largest value, and numbers between them where these are few."""
    low, high = float(values.min()), float(values.max())
    decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
    between = (1,) if high > 300 * low else (1, 2, 5) if high > 8 * low else (1, 2, 3, 4, 6, 8)
    steps = np.outer(decades, between).ravel()
    return np.asarray(steps[(steps >= 0.999 * low) & (steps <= 1.001 * high)])
