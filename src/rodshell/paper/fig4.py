"""Figure 4: of two rods that cross at one joint the first is twisted or turned at a constant rate; does rod 2 follow,
and with what lag? Both demonstrations, every coupling, linkers and pins [HQK 2.3].

The pictures are instants in the paper's layout, an animation, and the lag against time.

Rods of 5 nodes and 4 edges, the paper's section and material. Rod 1 runs from (L/2, 0, 0) to (-L/2, 0, 0), so that
its first node starts where Eq 7 puts it; rod 2 along y.

    twisting (a)   theta_11 = w t. ERRATA E11: the paper leaves rod 1 free in space; its frame then moves, and theta_11
                   counts from it. Its first edge, x_11 and x_12, is held here: its frame is fixed.
    bending (b)    x_11 = L/2 (cos w t, sin w t, 0), x_13 is held. theta_11 is held at 0 as well: nothing else keeps
                   the two rods from turning about rod 1, and a motion in the plane does not feel it.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import pi
from typing import Any, Literal

import numpy as np

from rodshell.arrays import Floats
from rodshell.geometry.frames import cross, dot
from rodshell.joints import Coupling, ExplicitPenalty, ImplicitPenalty, Joint, Linker, Pin, SharedDofs
from rodshell.layout import mesh_grid, straight_rods
from rodshell.model import Shell
from rodshell.output.pictures import RIGHT, UP
from rodshell.output.svg import document, label, number, tag
from rodshell.paper.figure import INK, PAPER, ROD, SOFT, Figure, Part, Row, joined
from rodshell.progress import Progress
from rodshell.results.wording import nice_ticks
from rodshell.solve.implicit_euler import Motion
from rodshell.solve.linear_stability import step_limit
from rodshell.solve.problem import Supports
from rodshell.solve.simulate import simulate

Demonstration = Literal["twisting", "bending"]

EDGE, LENGTH = 5e-3, 20e-3
RATE = 10 * 2 * pi / 60  # 10 rpm
STEP = 5e-3
NODES = 5
_SAFE = 0.6  # of the step limit of explicit ties
SLOW = 1e6  # times slower: inertia is negligible, each step is an equilibrium
_STATIC_STEPS = 60  # of such a revolution


@dataclass(frozen=True, eq=False)
class Run(Part):
    """A demonstration.

    Args:
        step: of the time stepping [s]; None for statics.
        times: (k,) [s]; of statics those at which the motion reaches each equilibrium.
        angles: (k,) by which rod 2 has turned about the axis of the motion [rad].
        nodes: (k, 2, 5, 3) of rod 1 and rod 2 [m].
        twists: (k, 4) twist angles of rod 1 [rad].
    """

    demonstration: Demonstration
    joint: str
    coupling: str
    step: float | None
    times: Floats
    angles: Floats
    nodes: Floats
    twists: Floats

    @property
    def name(self) -> str:
        """Joint and coupling, and whether it is statics."""
        return f"{self.joint}, {self.coupling}" + (", statics" if self.step is None else "")

    @property
    def prescribed(self) -> Floats:
        """(k,) angle of the first rod [rad]."""
        return RATE * self.times

    @property
    def lag(self) -> Floats:
        """(k,) angle by which rod 2 is behind [rad]."""
        return np.asarray(self.prescribed - self.angles)

    @property
    def start_up_lag(self) -> float:
        """Largest lag at the times recorded [rad]."""
        return float(np.abs(self.lag).max())

    @property
    def rate_error(self) -> float:
        """Of the rotation rate in the second half, by least squares, relative to that prescribed."""
        half = len(self.times) // 2
        return float(np.polyfit(self.prescribed[half:], self.angles[half:], 1)[0] - 1.0)

    @property
    def steady_lag(self) -> float:
        """Mean lag in the second half [rad]."""
        return float(self.lag[len(self.times) // 2 :].mean())

    @property
    def follows(self) -> bool:
        """Whether rod 2 turns with rod 1."""
        return abs(self.rate_error) < 1e-3

    def rows(self) -> list[Row]:
        return [(
            f"({LETTER[self.demonstration]}) {self.demonstration}", self.joint, self.coupling,
            "statics" if self.step is None else f"{1e3 * self.step:.3g}",
            f"{np.degrees(self.start_up_lag):.3g}", f"{np.degrees(self.steady_lag):.2g}",
            f"{100 * self.rate_error:.2g}", "yes" if self.follows else "no",
        )]  # fmt: skip

    def result(self) -> dict[str, Any]:
        names = ("demonstration", "joint", "coupling", "step", "start_up_lag", "steady_lag", "rate_error", "follows")
        return {name: getattr(self, name) for name in names}


def run_in_time(
    demonstration: Demonstration,
    joint: Joint,
    coupling: Coupling,
    *,
    until: float = 2 * pi / RATE,
    step: float = STEP,
) -> Run:
    """The motion from rest.

    Args:
        until: end of the motion [s].
        step: of the record [s]; with explicit ties the time step divides it until it is stable.
    """
    return _run(demonstration, joint, coupling, until, step)


def run_statics(demonstration: Demonstration, joint: Joint, coupling: Coupling, *, until: float = 2 * pi / RATE) -> Run:
    """The equilibria along the motion, which is so slow that each step is one; the joint must hold both rods.

    Args:
        until: end of the motion [s].
    """
    return _run(demonstration, joint, coupling, until, 2 * pi / RATE / _STATIC_STEPS, slower=SLOW)


def _run(
    demonstration: Demonstration, joint: Joint, coupling: Coupling, until: float, step: float, slower: float = 1.0
) -> Run:
    """The motion, so many times slower; statics unless that is 1."""
    half, statics = LENGTH / 2, slower != 1.0
    grid = straight_rods([[[half, 0], [-half, 0]], [[0, -half], [0, half]]])
    shell = Shell.of(mesh_grid(grid, EDGE), ROD, joint=joint, coupling=coupling, twist=True)
    motion = Motion.of(shell, constraint=_support(shell, demonstration, RATE / slower))
    start, every = shell.state(shell.mesh.flat), 1
    if isinstance(coupling, ExplicitPenalty) and not statics:
        every = int(np.ceil(step / (_SAFE * step_limit(motion, start))))
    series = simulate(motion, start, until=slower * until, step=slower * step / every, every=every)
    times, states = series.times / slower, series.states
    nodes = states[:, shell.node_blocks].reshape(len(times), 2, NODES, 3)
    twists = states[:, shell.first_angle : shell.first_angle + NODES - 1, 0]
    second = nodes[:, 1, -1] - nodes[:, 1, 0]
    axis = np.array([-1.0, 0.0, 0.0] if demonstration == "twisting" else [0.0, 0.0, 1.0])  # rod 1, or the normal
    angles = np.unwrap(np.arctan2(dot(axis, cross(second[0], second)), dot(second[0], second)))
    recorded = None if statics else step / every
    return Run(demonstration, joint.name, coupling.name, recorded, times, angles, nodes, twists)


def _support(shell: Shell, demonstration: Demonstration, rate: float) -> Callable[[float], Supports]:
    flat, rod, angle = shell.state(shell.mesh.flat), shell.node_blocks[:NODES], shell.first_angle
    moved = np.array([rod[0], rod[1] if demonstration == "twisting" else rod[2], angle])
    free = shell.freedom().with_directions(moved)

    def at(time: float) -> Supports:
        goals = flat[moved]
        if demonstration == "twisting":
            goals[2, 0] = rate * time
        else:
            goals[0] = 0.5 * LENGTH * np.array([np.cos(rate * time), np.sin(rate * time), 0.0])
        return Supports(free, moved, goals)

    return at


_DEMONSTRATIONS: tuple[Demonstration, ...] = ("twisting", "bending")
LETTER = {"twisting": "a", "bending": "b"}
SHOWN: tuple[tuple[Demonstration, str], ...] = (("twisting", "linker"), ("bending", "linker"), ("bending", "pin"))
COLUMNS = (
    "demonstration", "joint", "coupling", "step [ms]", "start-up lag [deg]", "steady lag [deg]",
    "rate error [%]", "rod 2 follows",
)  # fmt: skip
_FAINT = "#c9cdd0"
RODS = ("#1f5f8b", "#a8552a")
PANEL = 190.0  # drawing units
GAP, TEXT, HEAD, _FOOT = 14.0, 12.0, 44.0, 30.0
_INSTANTS = 5  # from the start to half a revolution
FRAMES = 73  # of the animation
_LAG_CHART, CHART_EDGE = (380.0, 210.0), 56.0
_LOOKS = ((INK, "none"), ("#f28c3a", "5 4"), ("#39b5e6", "none"), ("#4cb873", "2 3"))  # colour and dashes of the lines
TITLES = {
    "twisting": "(a)  Rod 1 is twisted: \N{GREEK SMALL LETTER THETA}\u2081\u2081 = \N{GREEK SMALL LETTER OMEGA}t",
    "bending": "(b)  Rod 1 is turned: x\u2081\u2081 circles at \N{GREEK SMALL LETTER OMEGA}",
}
SCALE = 0.92 * PANEL / LENGTH  # drawing units per metre
_BIG = 1.4  # panels of the animation, against those of the instants


@dataclass(frozen=True)
class Fig4(Figure):
    """All runs of the figure. Each has whether rod 2 follows: not to follow is a result, too."""

    title: str
    parts: tuple[Run, ...]
    name, columns, key = "fig4", COLUMNS, "runs"

    def pictures(self) -> dict[str, str]:
        """Instants, an animation, and the lag against time."""
        shown = [self._first(demonstration, joint) for demonstration, joint in SHOWN]
        return {"fig4": _instants_svg(shown), "fig4-animated": _animation_svg(shown), "fig4-lag": _lag_svg(self.parts)}

    def tables(self) -> Mapping[str, Iterable[Sequence[object]]]:
        """The angles of both rods against time."""
        return {
            f"angles-{letter}": _angles([run for run in self.parts if run.demonstration == demonstration])
            for demonstration, letter in LETTER.items()
        }

    def _first(self, demonstration: Demonstration, joint: str) -> Run:
        return next(run for run in self.parts if (run.demonstration, run.joint) == (demonstration, joint))


def _angles(runs: Sequence[Run]) -> list[Sequence[object]]:
    """The angles of every run at the times of the motions; of statics those of its equilibria."""
    times = runs[0].times
    columns = [np.round(times, 9).tolist(), np.degrees(runs[0].prescribed).tolist()]
    for run in runs:
        at = dict(zip(np.round(run.times, 6).tolist(), np.degrees(run.angles).tolist(), strict=True))
        columns.append([at.get(time, "") for time in np.round(times, 6).tolist()])
    head = ["time [s]", "rod 1 [deg]", *(f"rod 2 [deg]: {run.name}" for run in runs)]
    return [head, *zip(*columns, strict=True)]


def make(progress: Progress, *, turns: float = 1.0) -> Fig4:
    """All runs, over so many revolutions (`turns`) of rod 1."""
    until = turns * 2 * np.pi / RATE
    couplings: tuple[Coupling, ...] = (SharedDofs(), ImplicitPenalty(), ExplicitPenalty())
    cases: list[tuple[Joint, Coupling]] = [(Linker(), coupling) for coupling in couplings]
    runs = []
    for demonstration in _DEMONSTRATIONS:
        for joint, coupling in (*cases, (Pin(), SharedDofs())):
            progress(f"{demonstration}, {joint.name}, {coupling.name}", "in time", 0.0)
            runs.append(run_in_time(demonstration, joint, coupling, until=until))
        for joint, coupling in cases[:2]:
            progress(f"{demonstration}, {joint.name}, {coupling.name}", "statics", 0.0)
            runs.append(run_statics(demonstration, joint, coupling, until=until))
    turned = np.degrees(runs[0].prescribed[-1])
    title = f"Fig 4 [HQK 2.3]: rod 1 of two is driven at {RATE * 30 / np.pi:g} rpm, over {turned:.0f} degrees"
    return Fig4(title, tuple(runs))


# Pictures


def _instants_svg(runs: Sequence[Run]) -> str:
    """A row for each run: the rods at a few instants, side by side."""
    width, down, rows = _INSTANTS * PANEL + (_INSTANTS + 1) * GAP, 0.0, list[str]()
    for run in runs:
        top, height = _extent(run)
        rows.append(tag("g", *_title(run), transform=f"translate({number(GAP)} {number(down)})"))
        last = min(np.pi / RATE, run.times[-1])
        for across, time in enumerate(np.linspace(0, last, _INSTANTS)):
            k = int(np.abs(run.times - time).argmin())
            turned = f"{np.degrees(run.prescribed[k]):.0f}\N{DEGREE SIGN}"
            caption = f"t = {number(run.times[k], 3)} s, \N{GREEK SMALL LETTER OMEGA}t = {turned}"
            panel = [
                *_scene(run),
                *(_polyline(_projected(run.nodes[k, rod]), colour) for rod, colour in enumerate(RODS)),
                *(_polyline(_tick(run, k, edge), RODS[0], width=1.6) for edge in _ticked(run)),
                *(_dots(_projected(run.nodes[k, rod]), colour) for rod, colour in enumerate(RODS)),
                *(_names(run) if across == 0 else ()),
                label(caption, PANEL / 2, top + height + 18, TEXT, fill=INK, text_anchor="middle"),
            ]
            at = f"translate({number(GAP + across * (PANEL + GAP))} {number(down + HEAD - top)})"
            rows.append(tag("g", *panel, transform=at))
        down += HEAD + height + _FOOT
    return document((0, 0, width, down), _paper(width, down), *rows)


def _animation_svg(runs: Sequence[Run]) -> str:
    """The runs side by side, in an endless loop; a browser plays it."""
    width, height = len(runs) * _BIG * PANEL + (len(runs) + 1) * GAP, HEAD + _BIG * PANEL
    panels = []
    for across, run in enumerate(runs):
        frames = np.unique(np.linspace(0, len(run.times) - 1, FRAMES).round().astype(int))
        seconds = f"{number(float(run.times[-1]), 3)}s"
        lines = [([_projected(run.nodes[k, rod]) for k in frames], RODS[rod], 4.0) for rod in range(2)]
        lines += [([_tick(run, k, edge) for k in frames], RODS[0], 1.6) for edge in _ticked(run)]
        moving = [_polyline(drawn[0], colour, _moves(drawn, seconds), width=wide) for drawn, colour, wide in lines]
        left = GAP + across * (_BIG * PANEL + GAP)
        panels.append(tag("g", *_title(run), transform=f"translate({number(left)} 0)"))
        at = f"translate({number(left)} {number(HEAD)}) scale({_BIG})"
        panels.append(tag("g", *_scene(run), *moving, transform=at))
    return document((0, 0, width, height), _paper(width, height), *panels)


def _lag_svg(runs: Sequence[Run], *, until: float = 0.4) -> str:
    """Lag of rod 2 in the first moments `until` [s], of the runs in time in which it follows."""
    shown = [run for run in runs if run.step is not None and run.follows]
    looks = dict(zip(dict.fromkeys(run.name for run in shown), _LOOKS, strict=False))
    lags = np.concatenate([np.degrees(run.lag[run.times <= until]) for run in shown])
    low, high = float(lags.min()), 1.08 * float(lags.max())
    demonstrations = list(dict.fromkeys(run.demonstration for run in shown))
    width, height = CHART_EDGE + len(demonstrations) * (_LAG_CHART[0] + CHART_EDGE), _LAG_CHART[1] + HEAD + 66
    parts = [_paper(width, height)]
    for across, demonstration in enumerate(demonstrations):
        same = [run for run in shown if run.demonstration == demonstration]
        left = CHART_EDGE + across * (_LAG_CHART[0] + CHART_EDGE)
        chart = _chart(same, looks, until, low, high)
        title = label(TITLES[demonstration], 0, 20 - HEAD, TEXT + 1, fill=INK)
        parts.append(tag("g", title, *chart, transform=f"translate({number(left)} {number(HEAD)})"))
    for k, (name, (colour, dash)) in enumerate(looks.items()):
        x, y = CHART_EDGE + 190 * k, height - 12
        line = np.array([[x, y - 4], [x + 26, y - 4]])
        parts += [_polyline(line, colour, width=1.8, dash=dash), label(name, x + 32, y, TEXT, fill=INK)]
    return document((0, 0, width, height), *parts)


def _chart(runs: Sequence[Run], looks: dict[str, tuple[str, str]], until: float, low: float, high: float) -> list[str]:
    """Lag [degrees] against time [s]; the chart's corner is at (0, 0)."""
    wide, tall = _LAG_CHART

    def height_of(value: float) -> float:
        return tall * (high - value) / (high - low)

    parts = [label("lag of rod 2, degrees", 0, 37 - HEAD, TEXT, fill=SOFT)]
    for tick in nice_ticks(low, high, 5):
        y, shown = height_of(tick), number(tick, 3).replace("-", "\N{MINUS SIGN}")
        parts.append(tag("line", x1=0, y1=y, x2=wide, y2=y, stroke=_FAINT, stroke_width=0.8))
        parts.append(label(shown, -6, y + 4, TEXT, fill=SOFT, text_anchor="end"))
    for tick in nice_ticks(0, until, 4):
        x = wide * tick / until
        parts.append(label(number(tick, 3), x, tall + 18, TEXT, fill=SOFT, text_anchor="middle"))
    parts.append(label("time, s", wide, tall + 34, TEXT, fill=SOFT, text_anchor="end"))
    for run in runs:
        early, (colour, dash) = run.times <= until, looks[run.name]
        heights = [height_of(value) for value in np.degrees(run.lag[early])]
        line = np.column_stack([wide * run.times[early] / until, heights])
        parts.append(_polyline(line, colour, width=1.8, dash=dash))
    return parts


def _title(run: Run) -> list[str]:
    text = f"{run.joint}, {run.coupling}: rod 2 {'follows' if run.follows else 'stays behind'}"
    return [
        label(TITLES[run.demonstration], 0, 20, TEXT, fill=INK),
        label(text, 0, 37, TEXT, fill=SOFT),
    ]


def _projected(points: Floats) -> Floats:
    """(n, 2) drawing coordinates, y down, of points (n, 3) [m]; the joint is at the middle of a panel."""
    return np.asarray(0.5 * PANEL + SCALE * np.column_stack([points @ RIGHT, -points @ UP]))


def _paper(width: float, height: float) -> str:
    return tag("rect", x=0, y=0, width=width, height=height, fill=PAPER)


def _extent(run: Run) -> tuple[float, float]:
    """Top and height of all that is drawn of a run."""
    circle = _projected(_circle(run))[:, 1]
    drawn = np.append(circle, _projected(run.nodes.reshape(-1, 3))[:, 1])
    return float(drawn.min()) - 8, float(np.ptp(drawn)) + 16


def _circle(run: Run) -> Floats:
    """(n, 3) path of rod 2's ends."""
    angle = np.linspace(0, 2 * np.pi, 73)
    cos, sin, zero = 0.5 * LENGTH * np.cos(angle), 0.5 * LENGTH * np.sin(angle), np.zeros_like(angle)
    return np.column_stack([zero, cos, sin] if run.demonstration == "twisting" else [cos, sin, zero])


def _scene(run: Run) -> list[str]:
    """What does not move: the initial rods, and the circle of their ends."""
    still = [_polyline(_projected(_circle(run)), _FAINT, width=1.0)]
    moving = (0, 1) if run.demonstration == "bending" else (1,)
    return still + [_polyline(_projected(run.nodes[0, rod]), _FAINT, width=3.0) for rod in moving]


def _ticked(run: Run) -> range:
    """Edges of rod 1 whose directors are drawn: they turn where it is twisted."""
    return range(run.twists.shape[1] if run.demonstration == "twisting" else 0)


def _tick(run: Run, k: int, edge: int) -> Floats:
    """(2, 2) the first director of an edge of rod 1, which lies along -x as long as it is only twisted."""
    middle = run.nodes[k, 0, edge : edge + 2].mean(axis=0)
    angle = run.twists[k, edge]
    director = np.array([0.0, np.sin(angle), np.cos(angle)])
    return _projected(np.array([middle, middle + 0.55 * EDGE * director]))


def _names(run: Run) -> list[str]:
    """Labels of the first nodes of both rods."""
    parts = []
    for rod, name in enumerate(("x\u2081\u2081", "x\u2082\u2081")):
        first, second = _projected(run.nodes[0, rod, :2])
        out = first + 12 * (first - second) / np.linalg.norm(first - second)
        parts.append(label(name, out[0], out[1] + 4, TEXT, fill=RODS[rod], text_anchor="middle"))
    return parts


def _polyline(points: Floats, colour: str, *children: str, width: float = 4.0, dash: str = "none") -> str:
    return tag(
        "polyline", *children, points=joined(points), fill="none", stroke=colour, stroke_width=width,
        stroke_linecap="round", stroke_linejoin="round", stroke_dasharray=dash,
    )  # fmt: skip


def _dots(points: Floats, colour: str) -> str:
    return "".join(tag("circle", cx=x, cy=y, r=3.6, fill=PAPER, stroke=colour, stroke_width=1.5) for x, y in points)


def _moves(drawn: Sequence[Floats], seconds: str) -> str:
    values = ";".join(joined(points) for points in drawn)
    return tag("animate", attributeName="points", values=values, dur=seconds, repeatCount="indefinite")
