"""How a form is made: layers, cut lengths, splices, stock, bracing."""

from rodshell.fabrication.cutting import nest, splices
from rodshell.fabrication.fabricate import Fabricated, Fabrication, Lath, fabricate

__all__ = [
    "Fabricated",
    "Fabrication",
    "Lath",
    "fabricate",
    "nest",
    "splices",
]
