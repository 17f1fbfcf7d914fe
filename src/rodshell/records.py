"""How frozen records show themselves: in one line, whatever they hold."""

from dataclasses import MISSING, fields
from typing import Any


def brief(record: Any) -> str:
    """A dataclass in one line, as its `__repr__`: arrays by their shape, and without what is at its default.

    `Pin(eccentricity=0.02)`, `Stretch(blocks=(240, 2), rest_lengths=(240,), ...)`.
    """
    shown = []
    for field in fields(record):
        value = getattr(record, field.name)
        if hasattr(value, "dtype") and hasattr(value, "shape"):  # NumPy is not imported: cases show records without it
            shown.append(f"{field.name}={value.shape}")
        elif field.default is MISSING or type(value) is not type(field.default) or value != field.default:
            shown.append(f"{field.name}={value!r}")
    return f"{type(record).__name__}({', '.join(shown)})"
