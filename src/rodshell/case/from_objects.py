"""A case from objects that were made in Python.

What the keys of a case do not describe, such as a target that is a Python function, the case holds as it is.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from math import fmod, tau
from typing import Any, Literal, get_args

from numpy.typing import ArrayLike

from rodshell.case.case import Case
from rodshell.case.held import Held
from rodshell.case.rod_ends import RodEnds
from rodshell.case.rod_tables import RodTable
from rodshell.case.stage_tables import PopUpTable
from rodshell.case.target_tables import HeldTarget
from rodshell.formfinding import Bound, Fall, Method
from rodshell.formfinding.search import Objective
from rodshell.joints import Joint
from rodshell.layout import GridLayout, Layout
from rodshell.output.options import OutputOptions
from rodshell.rods.joints import JointKind
from rodshell.rods.section import Rod
from rodshell.rods.support_groups import Group, SupportGroups
from rodshell.rods.supports import BOTH, PINNED, SUPPORTS, Support
from rodshell.schema import kind_of, read, written
from rodshell.targets import Target
from rodshell.targets.patch import Seam
from rodshell.targets.patch_layout import PatchLayout
from rodshell.validation import either, instance

Auto = Literal["auto"]
Point = tuple[float, float]
NOT_POPPED_UP = "the grid was not popped up; a case file always asks for a pop-up"


def case_of(
    target: Target,
    layout: Layout,
    rod: Rod,
    *,
    joint: Joint,
    method: Method,
    anchor: Point | Auto | None,
    rotate: float | Auto | None,
    objective: Objective,
    ends: Sequence[Support],
    seams: Iterable[ArrayLike],
    patches: Mapping[str, PatchLayout],
    options: OutputOptions,
) -> Case:
    """The case of a target, a layout and a rod; arguments as of `rodshell.Job`, each of its kind."""
    groups, beside = _by_groups(ends)
    heading, shape = layout.rotate if rotate is None else rotate, target.parameters()
    given: dict[str, Any] = {
        "layout": _layout_keys(layout, heading) if isinstance(layout, GridLayout) else written(layout),
        "rod": rod.parameters(),
        "drape": _drape_keys(method, anchor, objective),
        "supports": [written(group) for group in groups],
        "pop_up": {"ends": beside},
        "seams": {
            "lines": [Seam.of(line).points.tolist() for line in seams],
            "patches": [{"name": name, **written(patch)} for name, patch in patches.items()],
        },
    }
    unknown = _without_keys(shape)
    if not unknown:
        given["target"] = _target_keys(shape)
    case = read(Case, given)
    held = {
        **({"layout": _held_layout(layout, heading)} if isinstance(layout, GridLayout) else {}),
        "rod": None if case.rod.build() == rod else Held(rod, f"the rod {rod}"),
        "drape": _held_method(case.drape.build(), method),
        "pop_up": None if groups else _held_supports(ends),
    }
    tables = {name: replace(getattr(case, name), held=found) for name, found in held.items()}
    if unknown:
        tables["target"] = HeldTarget(kind="python", held=Held(target, unknown, by_value=False))
    return replace(case, joint=_of_a_kind(joint), **tables, **options.tables)


def case_of_rod_ends(ends: RodEnds, rod: Rod | None, joint: Joint) -> Case:
    """The case of rods that a table gives by where their ends lie flat and in the end."""
    target = HeldTarget(kind="table", held=Held(ends, f"a table of {len(ends.final)} rods"))
    table = RodTable() if rod is None else read(RodTable, rod.parameters())
    return Case(target=target, rod=table, joint=_of_a_kind(joint), pop_up=read(PopUpTable, {"ends": PINNED.name}))


def _of_a_kind(joint: Joint) -> JointKind:
    """The joint, if it is of a kind that cases have."""
    instance("joint", joint, JointKind, f"of kind {either([kind_of(kind) for kind in get_args(JointKind)])}")
    return joint  # type: ignore[return-value]


def _without_keys(shape: Mapping[str, object]) -> str:
    """What a target with these parameters is that no key describes; "" where keys do."""
    if "function" in shape:
        return f"the Python function {shape['function']} as a target"
    return f"a mesh of {shape['vertices']} vertices made in Python as a target" if "vertices" in shape else ""


def _target_keys(shape: dict[str, Any]) -> dict[str, Any]:
    return {**shape, "turn": [_within_a_turn(angle) for angle in shape["turn"]]} if "turn" in shape else shape


def _layout_keys(layout: GridLayout, heading: float | Auto) -> dict[str, object]:
    rotate = "auto" if heading == "auto" else _within_a_turn(heading)
    edge = "auto" if layout.auto_edge else layout.edge
    return {**layout.parameters(), "edge": edge, "rotate": rotate, "left_out": layout.left_out}


def _held_layout(layout: GridLayout, rotate: float | Auto) -> Held | None:
    """A layout with lines at unequal spacing, with its heading."""
    if not any(layout.lines):
        return None
    turned = layout if rotate == "auto" else replace(layout, rotate=rotate)
    return Held(turned, "a layout with lines at unequal spacing")


def _by_groups(supports: Sequence[Support]) -> tuple[tuple[Group, ...], str]:
    """The groups of rod ends that keys describe, if that is what is asked for, and [pop_up] ends."""
    by_groups = [each for each in supports if isinstance(each, SupportGroups) and each.name == SupportGroups.name]
    beside = [support.name for support in supports if support not in by_groups]
    if len(by_groups) > 1 or len(beside) > 1 or not SUPPORTS.keys() >= {*beside}:
        return (), BOTH
    return (by_groups[0].groups if by_groups else ()), (beside[0] if beside else BOTH)


def _held_supports(supports: Sequence[Support]) -> Held | None:
    """Supports that no key names."""
    if not supports:
        return Held((), "a grid that is not popped up", writable=True, note=NOT_POPPED_UP)
    others = [support.name for support in supports if support.name not in SUPPORTS]
    return Held(tuple(supports), f"the support {' and the support '.join(others)}") if others else None


def _drape_keys(method: Method, anchor: Point | Auto | None, objective: Objective) -> dict[str, Any]:
    """[drape] of a method, in SI."""
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
    return given


def _held_method(described: Method, method: Method) -> Held | None:
    """A fall with options that no key describes; the folder of its frames may be none of the next result's."""
    if described == method:
        return None
    assert isinstance(method, Fall)
    assert isinstance(described, Fall)
    if replace(described, stream=method.stream, every=method.every) == method:
        return Held(method, "a fall whose frames are kept in a folder", writable=True)
    return Held(method, "a fall with options that only Python has")


def _within_a_turn(angle: float) -> float:
    """The angle [rad] as a case file has it; one within a turn to the last bit."""
    return fmod(angle, tau)
