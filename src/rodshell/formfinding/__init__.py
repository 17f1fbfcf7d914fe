"""Form finding: drape, trim, map back, pop up, agreement."""

from rodshell.formfinding.drape import drape
from rodshell.formfinding.methods import Bound, Draped, DrapeFigures, Fall, Gravity, Method
from rodshell.formfinding.pipeline import Agreement, Stages, agreement, find_stages, pop_up_stages
from rodshell.formfinding.popup import PopUp, pop_up
from rodshell.formfinding.trim import Boundary, Footprint, Trimmed, map_back, trim

__all__ = [
    "Agreement", "Bound", "Boundary", "DrapeFigures", "Draped", "Fall", "Footprint", "Gravity", "Method",
    "PopUp", "Stages", "Trimmed", "agreement", "drape", "find_stages", "map_back", "pop_up", "pop_up_stages",
    "trim",
]  # fmt: skip
