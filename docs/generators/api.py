"""The reference of Python's names: which stand on the page of which part, each to be documented by Sphinx's autodoc."""

import inspect
import re

import rodshell
from docs.generators.case_file import accepted
from rodshell.schema import Field, fields_of

PARTS = {
    "jobs": ("Jobs and forms", ("job", "form", "progress", "__version__")),
    "targets": ("Targets", ("targets",)),
    "layouts": ("Flat grids and nets", ("layout", "nets")),
    "rods": ("Rods, joints and supports", ("rods", "joints")),
    "stages": ("Stages of form finding", ("formfinding",)),
    "loads": ("Loads, checks and fabrication", ("loads", "checks", "fabrication")),
    "mechanics": ("Rods in statics and time", ("solve", "model")),
    "results": ("Results and files", ("results", "output")),
    "sweeps": ("Many designs", ("sweeps",)),
    "errors": ("Errors", ("errors",)),
}
"""The pages by name: their titles, and the rooms whose names they have."""


def names_of(part: str) -> list[str]:
    """The public names of a page, in the order of the alphabet."""
    return [name for name in rodshell.__all__ if _room(name) in PARTS[part][1]]


def _room(name: str) -> str:
    module = getattr(getattr(rodshell, name), "__module__", f"rodshell.{name}")
    return str(module).split(".")[1]


def page(part: str) -> str:
    entries = "".join(map(_entry, names_of(part)))
    return f"# {PARTS[part][0]}\n\n```{{eval-rst}}\n.. currentmodule:: rodshell\n\n{entries}```\n"


def _entry(name: str) -> str:
    thing = getattr(rodshell, name)
    if inspect.isclass(thing):
        return f".. autoclass:: rodshell.{name}\n   :members:\n\n"
    return f".. auto{'function' if inspect.isfunction(thing) else 'data'}:: rodshell.{name}\n\n"


def arguments(record: type) -> str:
    """Those of a dataclass, with their defaults."""
    signature = inspect.signature(record)
    plain = [given.replace(annotation=given.empty) for given in signature.parameters.values()]
    return re.sub(r"<factory>|<[^>]*>|\w+\([^()]*\)", "...", str(inspect.Signature(plain)))


def keys(record: type) -> list[tuple[str, str]]:
    """The arguments of a dataclass that are also keys of a case file, with their help and unit."""
    try:
        fields = fields_of(record)
    except NameError:  # a type that is imported for type checkers alone: of no class that a case file has
        return []
    found = [(field.attribute, field.help, unit_of(field)) for field in fields if field.help]
    return [(name, text + (f" [{unit}]" if unit else "")) for name, text, unit in found]


def unit_of(field: Field) -> str:
    """The SI unit in which Python gives it, as it is said where something else is given."""
    said = re.search(r"plain number in ([\w/]+)", accepted(field))
    return said[1] if said else ""
