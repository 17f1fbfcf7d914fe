"""What users get wrong, in Python, in a case file and as an option; each is refused in one sentence."""

import io
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import rodshell as rs
from rodshell.cli import main

BAD_INPUT = 2  # exit code of the command line
LONGEST = 300  # characters of one sentence
SMALL = '[layout]\nrods = [5, 5]\nspacing = "60 mm"\nlength = "1 m"\n'


@dataclass(frozen=True)
class Misuse:
    """One mistake: a Python expression, a case file and options that make it; each sentence holds `names`."""

    what: str
    names: str
    python: str
    case: str
    options: tuple[str, ...]


MISUSES = (
    Misuse(
        "ends misspelled", "clampd",
        'rs.pop_up(footprint, boundary, rod, ends="clampd")',
        '[pop_up]\nends = "clampd"\n', ("--pop_up.ends", "clampd"),
    ),
    Misuse(
        "ends misspelled in a form", "ends",
        'rs.find_form(target, layout, rod, ends="clampd")',
        '[pop_up]\nends = ["clampd"]\n', ("--pop_up.ends", "clampd,pinned"),
    ),
    Misuse(
        "start misspelled", "start",
        'rs.pop_up(footprint, boundary, rod, start="drapped")',
        '[pop_up]\nstart = "drapped"\n', ("--pop_up.start", "drapped"),
    ),
    Misuse(
        "a method that does not exist", "bond",
        'rs.find_form(target, layout, rod, method="bond")',
        '[drape]\nmethod = "bond"\n', ("--method", "bond"),
    ),
    Misuse(
        "gravity that pulls upwards", "-5",
        "rs.find_form(target, layout, rod, method=rs.Gravity(acceleration=-5))",
        '[drape]\nmethod = "gravity"\ngravity = -5\n', ("--method", "gravity", "--drape.gravity=-5"),
    ),
    Misuse(
        "gravity that the method ignores", "gravity",
        'rs.find_form(target, layout, rod, method="gravity")',
        '[drape]\nmethod = "bound"\ngravity = 5\n', ("--method", "bound", "--drape.gravity", "5"),
    ),
    Misuse(
        "section and material swapped", "section",
        "rs.Rod(rod.material, rod.section)",
        '[rod]\nsection = { youngs_modulus = "1 MPa" }\n', ("--rod.section.youngs_modulus", "1 MPa"),
    ),
    Misuse(
        "a radius as a word", "twenty",
        'rs.Hemisphere(radius="twenty")',
        '[target]\nradius = "twenty"\n', ("--target.radius", "twenty"),
    ),
    Misuse(
        "a joint by its name", "joint",
        'rs.find_form(target, layout, rod, joint="pin")',
        'joint = "pin"\n', ("--joint", "pin"),
    ),
)  # fmt: skip


@cache
def _names() -> dict[str, object]:
    """What the expressions may use: a small dome, draped and trimmed."""
    target, layout = rs.Hemisphere(radius=0.2), rs.GridLayout.orthogonal(rods=(5, 5), spacing=0.06, length=1.0)
    rod = rs.Rod(rs.Circle(radius=1e-3), rs.Material(youngs_modulus=1e6, density=1e3))
    trimmed = rs.trim(rs.drape(layout, rod, target))
    shell = {"footprint": rs.map_back(trimmed), "boundary": trimmed.boundary}
    return {"rs": rs, "target": target, "layout": layout, "rod": rod, **shell}


def python_fault(misuse: Misuse) -> str:
    """What is wrong with the answer to a misuse in Python; empty if it is refused in one sentence."""
    try:
        eval(misuse.python, dict(_names()))
    except rs.InputError as error:
        return _fault(str(error), misuse)
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return "accepted"


def case_fault(misuse: Misuse, folder: Path) -> str:
    """What is wrong with the answer to a misuse in a case file."""
    path = folder / "case.toml"
    path.write_text(misuse.case if misuse.case.startswith("joint") else misuse.case + SMALL)
    return _command_fault(["form", str(path), "--out", str(folder / "out")], misuse)


def option_fault(misuse: Misuse, folder: Path) -> str:
    """What is wrong with the answer to a misuse as an option."""
    return _command_fault(["form", "hemisphere", *misuse.options, "--out", str(folder / "out")], misuse)


def _command_fault(arguments: list[str], misuse: Misuse) -> str:
    errors = io.StringIO()
    with redirect_stderr(errors), redirect_stdout(io.StringIO()):
        code = main(arguments)
    said = errors.getvalue().strip()
    return f"exit code {code}: {said[:80]}" if code != BAD_INPUT else _fault(said, misuse)


def _fault(said: str, misuse: Misuse) -> str:
    if "\n" in said:
        return f"{said.count(chr(10)) + 1} lines: {said}"
    if len(said) > LONGEST:
        return f"{len(said)} characters: {said}"
    return "" if misuse.names in said else f'"{misuse.names}" is not in it: {said}'
