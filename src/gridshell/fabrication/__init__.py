"""What a workshop needs beyond the form: layers, cut lengths, splices, stock, bracing."""

from gridshell.fabrication.bracing import Diagonal, diagonals
from gridshell.fabrication.fabricate import Fabricated, fabricate
from gridshell.fabrication.nesting import Bar, Nesting, nest
from gridshell.fabrication.options import Fabrication
from gridshell.fabrication.splices import splices

__all__ = [
    "Bar",
    "Diagonal",
    "Fabricated",
    "Fabrication",
    "Nesting",
    "diagonals",
    "fabricate",
    "nest",
    "splices",
]
