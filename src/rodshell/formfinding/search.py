"""A coarse search for the anchor and the heading; all trials are shown, so that the user can choose another."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import degrees, pi
from typing import Literal, get_args

import numpy as np

from rodshell.errors import InputError, OutOfTimeError, RodshellError
from rodshell.formfinding.pipeline import find_stages
from rodshell.layout import GridLayout, Layout
from rodshell.layout.gridlayout import require_chebyshev
from rodshell.nets import ChebyshevNet, chebyshev_net
from rodshell.nets.net_ends import inside_nodes
from rodshell.progress import Progress, require_progress, silent
from rodshell.rods.section import Rod
from rodshell.rods.supports import CLAMPED
from rodshell.targets import Target
from rodshell.validation import choice, instance, is_auto, number, point, some

Objective = Literal["shear", "curvature", "gap"]
Auto = Literal["auto"]
Point = tuple[float, float]

HEADINGS = tuple(k * pi / 12 for k in range(6))  # a grid looks the same after a quarter turn
ASIDE = 0.4  # of the size: anchors tried around the default one
COARSE = 4  # spacings from the target's middle to its edge
DEEP = 0.15  # of the size: anchors closer to the end leave half of an axis outside
EQUAL = 1.01  # ratio of values that count as equal: a coarse search does not resolve finer differences
UNITS: dict[Objective, str] = {"shear": "deg", "curvature": "1/m", "gap": "of the size"}


@dataclass(frozen=True)
class Trial:
    """One anchor [m] and heading [rad]: its value, infinite where it fails, and the reason of the failure."""

    anchor: Point
    heading: float
    value: float
    reason: str = ""


@dataclass(frozen=True)
class Search:
    """All trials of a search for the smallest `objective`."""

    objective: Objective
    trials: tuple[Trial, ...]

    @property
    def best(self) -> Trial:
        """The first trial that is as good as the best: the default comes first."""
        least = min(trial.value for trial in self.trials)
        return next(trial for trial in self.trials if trial.value <= least * EQUAL)

    @property
    def title(self) -> str:
        return f"largest {self.objective} [{UNITS[self.objective]}]"

    def table(self) -> str:
        """A line for each anchor, a column for each heading; the best is marked."""
        headings = list(dict.fromkeys(trial.heading for trial in self.trials))
        lines = [f"{self.title} by anchor x, y [m] and heading"]
        lines.append(" " * 20 + "".join(f"{degrees(angle):9.0f} deg" for angle in headings))
        for anchor in dict.fromkeys(trial.anchor for trial in self.trials):
            row = [trial for trial in self.trials if trial.anchor == anchor]
            cells = (f"{trial.value:12.4g}" if np.isfinite(trial.value) else f"{'none':>12}" for trial in row)
            marks = ("*" if trial is self.best else " " for trial in row)
            lines.append(
                f"{anchor[0]:9.4g}, {anchor[1]:9.4g}" + "".join(c + m for c, m in zip(cells, marks, strict=True))
            )
        return "\n".join(lines)


def search(
    target: Target,
    layout: Layout,
    rod: Rod,
    *,
    objective: Objective = "shear",
    anchors: Sequence[Point] | Auto = "auto",
    headings: Sequence[float] | Auto = "auto",
    progress: Progress = silent,
) -> Search:
    """Try anchors and headings with a coarse grid.

    Args:
        objective: "shear", the largest angle by which joints close or open from 90 degrees; "curvature", the largest
            of any rod on the target [1/m]; "gap", rms of the clamped pop-up over the target's size.
        anchors: points of the plan [m]; "auto": the default one and four around it.
        headings: angles of family u against x [rad]; "auto": 0 to 75 degrees in steps of 15.

    Raises:
        InputError: no trial has a net; an unknown objective.
    """
    instance("target", target, Target)
    instance("layout", layout, Layout)
    require_chebyshev(layout, "searches for anchor or heading")
    instance("rod", rod, Rod)
    choice("objective", objective, get_args(Objective))
    require_progress(progress)
    points, turns = _spread_anchors(target), HEADINGS
    if not is_auto(anchors):
        given = some("anchors", anchors, 'points x, y in m, or "auto"')
        points = [point("each of the anchors", anchor) for anchor in given]
    if not is_auto(headings):
        angles = some("headings", headings, 'angles in rad, or "auto"')
        turns = tuple(number("each of the headings", angle, "rad") for angle in angles)
    coarse = target.size / COARSE
    tried = GridLayout.orthogonal(spacing=coarse, edge=coarse / 3, rotate=layout.rotate)
    measure: Callable[[GridLayout, Point], float] = {
        "shear": lambda grid, anchor: 90.0 - degrees(chebyshev_net(target, grid, anchor=anchor).min_angle),
        "curvature": lambda grid, anchor: largest_curvature(chebyshev_net(target, grid, anchor=anchor)),
        "gap": lambda grid, anchor: _gap(target, grid, rod, anchor),
    }[objective]
    trials = list[Trial]()
    for k, (anchor, heading) in enumerate((anchor, heading) for anchor in points for heading in turns):
        try:
            progress("search", f"{k + 1} of {len(points) * len(turns)}", 0.0)
        except OutOfTimeError as late:
            raise OutOfTimeError(f"{late}{_best_so_far(objective, trials)}") from late
        try:
            trials.append(Trial(anchor, heading, measure(replace(tried, rotate=heading), anchor)))
        except RodshellError as reason:
            trials.append(Trial(anchor, heading, np.inf, str(reason)))
    if not any(np.isfinite(trial.value) for trial in trials):
        raise InputError(f"none of {len(trials)} anchors and headings works; the first: {trials[0].reason}")
    return Search(objective, tuple(trials))


def _best_so_far(objective: Objective, trials: list[Trial]) -> str:
    if not any(np.isfinite(trial.value) for trial in trials):
        return ""
    best = Search(objective, tuple(trials)).best
    x, y = best.anchor
    heading = f"{degrees(best.heading):.4g} deg"
    return f"; the best of {len(trials)} tried: anchor {x:.4g},{y:.4g} m, rotate {heading}"


def largest_curvature(net: ChebyshevNet) -> float:
    """Largest curvature of all rods on the target, by second differences [1/m]."""
    bends = net.net.bends(inside_nodes(net.target, net.net))
    return max(float(np.linalg.norm(bend, axis=1).max(initial=0.0)) for _, bend in bends)


def _gap(target: Target, layout: GridLayout, rod: Rod, anchor: Point) -> float:
    form = find_stages(target, layout, rod, anchor=anchor, ends=CLAMPED)
    if form.status != "converged":
        raise InputError(form.status)
    return form.agreement[CLAMPED.name].rms_relative


def _spread_anchors(target: Target) -> list[Point]:
    """The default anchor, and points around it that lie well inside the end."""
    x, y = target.summit
    points = [(x, y)]
    for dx, dy in ((-1, 0), (1, 0), (0, -1), (0, 1)):
        aside = (x + ASIDE * dx * target.size, y + ASIDE * dy * target.size)
        with np.errstate(invalid="ignore"):
            z = float(target.height_at(np.array([aside]))[0])
        if np.isfinite(z) and target.margin(np.array([[*aside, z]]))[0] > DEEP * target.size:
            points.append(aside)
    return points
