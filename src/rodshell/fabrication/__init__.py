"""How a form is made: layers, cut lengths, splices, stock, bracing."""

from rodshell.fabrication.cutting import Bar, Nesting, nest, splices
from rodshell.fabrication.fabricate import Diagonal, Fabricated, Fabrication, Lath, fabricate

__all__ = [
    "Bar",
    "Diagonal",
    "Fabricated",
    "Fabrication",
    "Lath",
    "Nesting",
    "fabricate",
    "nest",
    "splices",
]
