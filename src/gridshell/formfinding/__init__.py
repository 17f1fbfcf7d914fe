"""Form finding: drape, trim, map back, pop up, agreement."""

from gridshell.formfinding.agreement import Agreement, agreement
from gridshell.formfinding.drape import drape
from gridshell.formfinding.draped import Draped
from gridshell.formfinding.fall import Fall
from gridshell.formfinding.pipeline import FoundForm, PoppedTable, find_stages, pop_up_stages
from gridshell.formfinding.popup import Popped, pop_up
from gridshell.formfinding.trim import Boundary, Footprint, Trimmed, map_back, trim

__all__ = [
    "Agreement", "Boundary", "Draped", "Fall", "Footprint", "FoundForm", "Popped", "PoppedTable", "Trimmed",
    "agreement", "drape", "find_stages", "map_back", "pop_up", "pop_up_stages", "trim",
]  # fmt: skip
