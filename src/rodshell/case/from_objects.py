"""The case file of objects that were made in Python."""

from collections.abc import Sequence
from math import fmod, tau
from typing import Any

from rodshell.case.case import Case
from rodshell.formfinding import Bound, Fall, Method
from rodshell.formfinding.popup import ENDS, Ends
from rodshell.formfinding.sewn import SewnForm
from rodshell.joints import Joint, joint_parameters
from rodshell.layout import GridLayout
from rodshell.output.options import OutputOptions
from rodshell.rods.section import Rod
from rodshell.targets import Target


def case_text(
    target: Target,
    layout: GridLayout,
    rod: Rod,
    *,
    joint: Joint,
    method: Method = Bound(),
    anchor: tuple[float, float] | None = None,
    ends: Sequence[Ends] = ENDS,
    options: OutputOptions | None = None,
    sewn: SewnForm | None = None,
) -> str:
    """A case file that gives these objects again, or a note on why none can: its target was a Python function, say."""
    shape: dict[str, Any] = target.parameters()
    if "function" in shape:
        return f"# the target was the Python function {shape['function']}: no case file can give it again\n"
    if "vertices" in shape:
        return (
            f"# the target was a mesh of {shape['vertices']} vertices made in Python: no case file can give it again\n"
        )
    if "turn" in shape:
        shape = {**shape, "turn": [_within_a_turn(angle) for angle in shape["turn"]]}
    drape = _method_table(method)
    if anchor is not None:
        drape["anchor"] = anchor
    case = Case.model_validate(
        {
            "target": shape,
            "layout": {**layout.parameters(), "rotate": _within_a_turn(layout.rotate)},
            "rod": rod.parameters(),
            "joint": joint_parameters(joint),
            "drape": drape,
            "pop_up": {"ends": ends[0] if len(ends) == 1 else "both"},
            **({"seams": sewn.parameters()} if sewn else {}),
            **(options or OutputOptions()).parameters(),
        }
    )
    note = "" if ends else "# the grid was not popped up; a case file always asks for a pop-up\n"
    return note + case.to_toml()


def _method_table(method: Method) -> dict[str, Any]:
    """[drape] of a method, in SI; without the folder of a fall's frames, which may be none of the next result's."""
    table: dict[str, Any] = {"method": method.name}
    if not isinstance(method, Bound):
        table["gravity"] = method.acceleration
    if isinstance(method, Fall):
        ties = {name: getattr(method.coupling, name, None) for name in ("C1", "C2")}
        given = {name: getattr(method, name) for name in ("height", "time_step", "duration", "friction", "drag")}
        table |= {name: value for name, value in (given | ties).items() if value is not None}
        table["coupling"] = method.coupling.name
    return table


def _within_a_turn(angle: float) -> float:
    """The angle [rad] as a case file has it; one within a turn to the last bit."""
    return fmod(angle, tau)
