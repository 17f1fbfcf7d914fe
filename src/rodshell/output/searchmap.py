"""The picture of a search: a line for each anchor, a column for each heading, the best one framed."""

from html import escape
from math import degrees
from typing import Protocol

import numpy as np

from rodshell.output.colour_scale import HEIGHT, hex_colours

CELL, ROW, LEFT, TOP = 84, 30, 190, 64


class TrialLike(Protocol):
    """What a picture needs of a trial: anchor [m], heading [rad], value."""

    @property
    def anchor(self) -> tuple[float, float]: ...
    @property
    def heading(self) -> float: ...
    @property
    def value(self) -> float: ...


def search_svg(title: str, trials: tuple[TrialLike, ...], best: TrialLike) -> str:
    """Values in cells, dark the smallest; what failed stays empty.

    Parameters
    ----------
    title : above the map.
    trials : all that were tried.
    best : the one to be framed.
    """
    anchors = list(dict.fromkeys(trial.anchor for trial in trials))
    headings = list(dict.fromkeys(trial.heading for trial in trials))
    values = np.array([trial.value for trial in trials])
    low, high = values[np.isfinite(values)].min(), values[np.isfinite(values)].max()
    shares = np.clip((values - low) / (high - low if high > low else 1.0), 0.0, 1.0)
    colours = hex_colours(HEIGHT, np.where(np.isfinite(values), shares, 1.0))
    width, height = LEFT + CELL * len(headings) + 20, TOP + ROW * len(anchors) + 20
    parts = [f'<text x="20" y="24" font-weight="bold">{escape(title)}</text>']
    for k, heading in enumerate(headings):
        parts.append(
            f'<text x="{LEFT + CELL * (k + 0.5):g}" y="{TOP - 10}" text-anchor="middle">{degrees(heading):.0f}°</text>'
        )
    for k, (x, y) in enumerate(anchors):
        parts.append(f'<text x="20" y="{TOP + ROW * (k + 0.65):g}">({x:.4g}, {y:.4g}) m</text>')
    for trial, colour in zip(trials, colours, strict=True):
        x, y = LEFT + CELL * headings.index(trial.heading), TOP + ROW * anchors.index(trial.anchor)
        found = np.isfinite(trial.value)
        frame = ' stroke="#d33" stroke-width="3"' if trial is best else ""
        fill = colour if found else "#f4f4f4"
        parts.append(f'<rect x="{x + 2}" y="{y + 2}" width="{CELL - 4}" height="{ROW - 4}" fill="{fill}"{frame}/>')
        text, ink = (f"{trial.value:.3g}", "white") if found else ("none", "#888")
        parts.append(
            f'<text x="{x + CELL / 2:g}" y="{y + ROW * 0.65:g}" text-anchor="middle" fill="{ink}">{text}</text>'
        )
    body = "\n".join(parts)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
        f'font-family="sans-serif" font-size="13">\n<rect width="100%" height="100%" fill="white"/>\n{body}\n</svg>\n'
    )
