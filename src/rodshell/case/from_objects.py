"""A case from objects that were made in Python.

What the keys of a case do not describe, such as a target that is a Python function, the case holds as it is.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from math import fmod, tau
from typing import Any, Literal

from numpy.typing import ArrayLike

from rodshell.case.case import Case
from rodshell.case.rod_ends import RodEnds
from rodshell.case.rod_tables import JointKinds, JointTable, RodTable
from rodshell.case.stage_tables import (
    DrapeTable,
    LayoutTable,
    PopUpTable,
    SeamsTable,
)
from rodshell.case.target_tables import HeldTarget, TargetTable
from rodshell.case.values import Held, Table
from rodshell.formfinding import Bound, Fall, Method
from rodshell.formfinding.patches import PatchLayout
from rodshell.formfinding.popup import Ends
from rodshell.formfinding.search import Objective
from rodshell.joints import Joint, joint_parameters
from rodshell.layout import GridLayout
from rodshell.output.options import OutputOptions
from rodshell.rods.section import Rod
from rodshell.targets import Target
from rodshell.targets.patch import Seam

Auto = Literal["auto"]
Point = tuple[float, float]


def case_of(
    target: Target,
    layout: GridLayout,
    rod: Rod,
    *,
    joint: Joint,
    method: Method,
    anchor: Point | Auto | None,
    rotate: float | Auto | None,
    objective: Objective,
    ends: Sequence[Ends],
    seams: Iterable[ArrayLike],
    patches: Mapping[str, PatchLayout],
    options: OutputOptions,
) -> Case:
    """The case of a target, a layout and a rod; arguments as of `rodshell.Job`, each of its kind."""
    heading = layout.rotate if rotate is None else rotate
    tables: dict[str, Any] = {
        "target": _target_table(target),
        "layout": _layout_table(layout, heading),
        "rod": rod_table(rod),
        "joint": joint_table(joint),
        "drape": _drape_table(method, anchor, objective),
        "pop_up": _pop_up_table(ends),
        "seams": SeamsTable.model_validate(
            {
                "lines": [Seam.of(line).points.tolist() for line in seams],
                "patches": [{"name": name, **_given(patch)} for name, patch in patches.items()],
            }
        ),
    }
    return Case.model_validate(options.parameters()).model_copy(update=tables)


def case_of_rod_ends(ends: RodEnds, rod: Rod | None, joint: Joint, options: OutputOptions) -> Case:
    """The case of rods that a table gives by where their ends lie flat and in the end."""
    update = {"target": table_target(ends), "joint": joint_table(joint), "pop_up": PopUpTable(ends="pinned")}
    if rod is not None:
        update["rod"] = rod_table(rod)
    return Case.model_validate(options.parameters()).model_copy(update=update)


def rod_table(rod: Rod) -> RodTable:
    """[rod] with section and material spelled out."""
    table = RodTable.model_validate(rod.parameters())
    return table if table.build() == rod else table.holding(Held(rod, f"the rod {rod}"))


def joint_table(joint: Joint) -> JointTable:
    """[joint] of any joint; linkers of a rod of their own are held."""
    parameters = joint_parameters(joint)
    linkers = parameters.pop("rod", None)
    table: JointTable = _JointCase.model_validate({"joint": parameters}).joint
    return table if linkers is None else table.holding(Held(joint, "joints with linkers of another rod"))


def table_target(ends: RodEnds) -> HeldTarget:
    """[target] of a table of rods."""
    return HeldTarget(kind="table").holding(Held(ends, f"a table of {len(ends.final)} rods"))


class _JointCase(Table):
    joint: JointKinds


class _TargetCase(Table):
    target: TargetTable


def _target_table(target: Target) -> Table:
    shape: dict[str, Any] = target.parameters()
    if "function" in shape:
        what = f"the Python function {shape['function']} as a target"
        return HeldTarget(kind="python").holding(Held(target, what, by_value=False))
    if "vertices" in shape:
        what = f"a mesh of {shape['vertices']} vertices made in Python as a target"
        return HeldTarget(kind="python").holding(Held(target, what, by_value=False))
    if "turn" in shape:
        shape = {**shape, "turn": [_within_a_turn(angle) for angle in shape["turn"]]}
    table: Table = _TargetCase.model_validate({"target": shape}).target
    return table


def _layout_table(layout: GridLayout, rotate: float | Auto) -> LayoutTable:
    heading = "auto" if rotate == "auto" else _within_a_turn(rotate)
    given = {**layout.parameters(), "rotate": heading, "left_out": layout.left_out}
    table = LayoutTable.model_validate(given)
    if any(layout.lines):
        turned = layout if rotate == "auto" else replace(layout, rotate=rotate)
        return table.holding(Held(turned, "a layout with lines at unequal spacing"))
    return table


def _drape_table(method: Method, anchor: Point | Auto | None, objective: Objective) -> DrapeTable:
    """[drape] of a method, in SI; the folder of a fall's frames, which may be none of the next result's, is held."""
    given: dict[str, Any] = {"method": method.name, "objective": objective}
    if anchor is not None:
        given["anchor"] = anchor
    if not isinstance(method, Bound):
        given["gravity"] = method.acceleration
    if isinstance(method, Fall):
        ties = {name: getattr(method.coupling, name, None) for name in ("C1", "C2")}
        known = {name: getattr(method, name) for name in ("height", "time_step", "duration", "friction", "drag")}
        given |= {name: value for name, value in (known | ties).items() if value is not None}
        given["coupling"] = method.coupling.name
    table = DrapeTable.model_validate(given)
    described = table.build()
    if described == method:
        return table
    assert isinstance(method, Fall)
    assert isinstance(described, Fall)
    if replace(described, stream=method.stream, every=method.every) == method:
        return table.holding(Held(method, "a fall whose frames are kept in a folder", writable=True))
    return table.holding(Held(method, "a fall with options that only Python has"))


def _pop_up_table(ends: Sequence[Ends]) -> PopUpTable:
    if ends:
        return PopUpTable(ends=ends[0] if len(ends) == 1 else "both")
    note = "the grid was not popped up; a case file always asks for a pop-up"
    return PopUpTable().holding(Held((), "a grid that is not popped up", writable=True, note=note))


def _given(patch: PatchLayout) -> dict[str, object]:
    return {key: value for key, value in asdict(patch).items() if value is not None}


def _within_a_turn(angle: float) -> float:
    """The angle [rad] as a case file has it; one within a turn to the last bit."""
    return fmod(angle, tau)
