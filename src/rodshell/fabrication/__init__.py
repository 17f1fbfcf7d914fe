"""What a workshop needs beyond the form: layers, cut lengths, splices, stock, bracing."""

from rodshell.fabrication.bracing import Diagonal, diagonals
from rodshell.fabrication.fabricate import Fabricated, fabricate
from rodshell.fabrication.nesting import Bar, Nesting, nest
from rodshell.fabrication.options import Fabrication
from rodshell.fabrication.splices import splices

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
