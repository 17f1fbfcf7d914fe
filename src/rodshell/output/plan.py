"""The flat plan's content in millimetres, and round numbers for its axes."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rodshell.arrays import Floats
from rodshell.output.archive import Archive
from rodshell.output.drawing import LETTER, SMALL
from rodshell.output.rods import JointRecord, RodRecord, joints_of, outlines_of, rods_of
from rodshell.output.rounding import Rounding, rounding_of

NOTE = "Design aid, not code compliance"


@dataclass(frozen=True)
class FlatPlan:
    """The content of the flat plan.

    Parameters
    ----------
    rods, joints : as in the result [m].
    lines : (r, 2, 2) start and end of each rod on the footprint [mm].
    cuts : (r, 2, 2) start and end of each rod as it is cut, with its allowances [mm].
    marks : (c, 2) the joints, in the order of `joints` [mm].
    footprint : closed curves (f, 2) through the rod ends, around the grid and around each opening [mm].
    boundary : closed curves (f, 3) through the final rod ends [mm], vertex by vertex those of `footprint`; none if they
        are not known.
    rounding : how finely lengths are shown.
    """

    name: str
    rods: list[RodRecord]
    joints: list[JointRecord]
    lines: Floats
    cuts: Floats
    marks: Floats
    footprint: list[Floats]
    boundary: list[Floats]
    rounding: Rounding

    @cached_property
    def extent(self) -> float:
        """The longer side of the plan [mm]."""
        return float(np.ptp(self.lines.reshape(-1, 2), axis=0).max()) if len(self.lines) else 1.0

    @cached_property
    def spacing(self) -> float:
        """The median distance of neighbouring joints on a rod [mm]."""
        steps = [np.diff(np.sort([at for _, at in rod.joints])) for rod in self.rods]
        steps = [step[step > 1e-6] for step in steps]
        known = np.concatenate(steps) if steps else np.empty(0)
        return float(1e3 * np.median(known)) if len(known) else self.extent / 10

    @cached_property
    def text(self) -> float:
        """Size of the rods' labels at 1:1 [mm]: joint ids find room between the rods."""
        longest = max((len(joint.id) for joint in self.joints), default=1)
        return min(self.spacing / (SMALL * LETTER * longest + 0.95), 0.25 * self.spacing, 0.015 * self.extent)

    @cached_property
    def summary(self) -> str:
        """The cut list in one line; lengths as cut."""
        lengths = [rod.cut_length for rod in self.rods]
        return (
            f"{len(self.rods)} rods, {len(self.joints)} joints, {sum(lengths):.1f} m in total, "
            f"longest {self.rounding.mm(max(lengths, default=0.0))} mm"
            + (", with allowances" if self.allowances else "")
        )

    @property
    def allowances(self) -> bool:
        """Whether rods are cut longer than they are between their supports."""
        return any(rod.allowance for rod in self.rods)


def flat_plan(archive: Archive) -> FlatPlan:
    """The flat plan of an archive."""
    rods = rods_of(archive)
    joints = joints_of(rods)
    lines = np.array([rod.flat for rod in rods]).reshape(-1, 2, 2)
    cuts = np.array([[rod.point(-rod.allowance), rod.point(rod.length + rod.allowance)] for rod in rods])
    marks = np.array([rods[joint.rods[0]].point(joint.at[0]) for joint in joints]).reshape(-1, 2)
    footprint = np.array(archive.result.get("footprint") or lines.reshape(-1, 2), dtype=float).reshape(-1, 2)
    boundary = np.array(archive.result.get("boundary") or [], dtype=float).reshape(-1, 3)
    loops = outlines_of(rods)
    return FlatPlan(
        archive.name, rods, joints, 1e3 * lines, 1e3 * cuts.reshape(-1, 2, 2), 1e3 * marks,
        [1e3 * footprint[loop] for loop in loops],
        [1e3 * boundary[loop] for loop in loops] if len(boundary) == len(footprint) else [],
        rounding_of(archive.result),
    )  # fmt: skip


def nice_step(span: float, count: int) -> float:
    """A step of 1, 2 or 5 times a power of ten that divides `span` into `count` parts or a few less."""
    if span <= 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(span / count))
    return float(next(k * power for k in (1.0, 2.0, 5.0, 10.0) if k * power >= span / count * (1 - 1e-9)))


def nice_ticks(low: float, high: float, count: int) -> list[float]:
    """Round numbers from `low` to `high`, `count` + 1 at most."""
    step = nice_step(high - low, count)
    first, last = np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9)
    return [float(k) * step for k in np.arange(first, last + 1)]
