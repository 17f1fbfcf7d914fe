"""The title block: what a drawing is, of which rods, by whom, when, to which tolerance, and what it is not."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime
from typing import Any

import numpy as np

from rodshell.output.archive import Archive, json_text, printable
from rodshell.output.drawing import INK, LETTER, PAPER, SOFT, Drawing, Pen, Pencil
from rodshell.output.inputs import input_hash
from rodshell.output.plan import NOTE, nice_step
from rodshell.output.rounding import rounding_of
from rodshell.output.wording import case_rows, joint_rows, rounded, stress

NOT_GIVEN = "not given"
COLUMNS = 4  # of entries, side by side
TRUE_SIZE = ", 1:1"  # after the title of a drawing that is its own file


@dataclass(frozen=True)
class TitleBlock:
    """What every drawing of a set says.

    Parameters
    ----------
    entries : what it is called and what it is: project, author, date, section, material, ...
    summary : the cut list in one line.
    """

    name: str
    entries: tuple[tuple[str, str], ...]
    summary: str

    def notes(self, drawing: Drawing) -> list[str]:
        """What stands below the entries of a drawing; what it leaves out is said last."""
        left_out = f"Left out for want of room: {'; '.join(drawing.left_out)}." if drawing.left_out else ""
        return [f"{self.summary}. {NOTE}.", *filter(None, [left_out])]


def title_block(archive: Archive, summary: str) -> TitleBlock:
    """The title block of an archive."""
    result = archive.result
    given: Mapping[str, Any] = result.get("drawings") or {}
    rod = result.get("rod") or {}
    source = archive.case_toml or json_text({key: result.get(key) for key in ("rods", "boundary")})
    tolerance = given.get("tolerance")
    entries = (
        ("Project", given.get("project") or NOT_GIVEN),
        ("Drawn by", given.get("author") or NOT_GIVEN),
        ("Date", given.get("date") or today().isoformat()),
        ("Revision", given.get("revision") or "-"),
        ("Section", _section(rod.get("section")) or NOT_GIVEN),
        ("Material", _material(rod.get("material")) or NOT_GIVEN),
        ("Joints", _joint(result.get("joint"))),
        ("Rods", f"{len(result.get('rods') or [])}"),
        ("Units", f"mm, shown to {rounding_of(result).words}"),
        ("Tolerance", NOT_GIVEN if tolerance is None else f"{1e3 * tolerance:g} mm"),
        ("Input", input_hash(source, archive.inputs)),
        ("Made by", f"rodshell {result.get('version_rodshell') or '(version unknown)'}"),
    )
    name = printable(str(given.get("name") or archive.name))
    return TitleBlock(name, tuple((label, printable(str(value))) for label, value in entries), summary)


def today() -> date:
    """The date of writing in UTC; that of SOURCE_DATE_EPOCH, seconds since 1970, where it is set."""
    try:
        return datetime.fromtimestamp(int(os.environ["SOURCE_DATE_EPOCH"]), UTC).date()
    except (KeyError, ValueError, OverflowError, OSError):
        return datetime.now(UTC).date()


def _section(section: object) -> str:
    """ "circle, radius 1 mm"."""
    return ", ".join(value if key == "kind" else f"{key} {value}" for key, value in case_rows(section))


def _material(material: object) -> str:
    """ "larch, E 11 GPa, 470 kg/m3": its name where it has one."""
    if not isinstance(material, dict):
        return ""
    words = [str(material[key]) for key in ("preset", "name") if material.get(key)][:1]
    if (modulus := material.get("youngs_modulus")) is not None:
        words.append(f"E {stress(modulus)}")
    if (density := material.get("density")) is not None:
        words.append(f"{rounded(density, 4)} kg/m\N{SUPERSCRIPT THREE}")
    return ", ".join(words)


def _joint(joint: object) -> str:
    """ "pin, eccentricity 42 mm"; without a word about them, joints are balls, free to turn."""
    return ", ".join(value if key == "kind" else f"{key} {value}" for key, value in joint_rows(joint)) or "ball"


def with_title(drawing: Drawing, block: TitleBlock) -> Drawing:
    """The drawing with its title block and a scale bar below: for a sheet without a frame."""
    (left, bottom), (right, _) = drawing.box()
    size, pencil = drawing.text, Pencil()
    y = bottom - 2.6 * size
    pencil.line([(left, y + 1.6 * size), (right, y + 1.6 * size)], "TITLE")
    pencil.write(f"{block.name}: {drawing.title.lower()}{TRUE_SIZE}", (left, y), 1.4 * size, "TITLE", bold=True)
    rows = [block.entries[k : k + COLUMNS] for k in range(0, len(block.entries), COLUMNS)]
    lines = [" \N{MIDDLE DOT} ".join(f"{label}: {value}" for label, value in row) for row in rows] + block.notes(
        drawing
    )
    for k, line in enumerate(lines, start=1):
        pencil.write(line, (left, y - 1.5 * k * size), size, "TITLE")
    end = left + max(right - left, 0.25 * (right - left) + 4 * size)
    scale_bar(pencil, end, y - (1.5 * len(lines) + 2) * size, 0.25 * (right - left), size, 1.0)
    return drawing + pencil.done("", "", size)


def on_a_page(drawing: Drawing) -> Drawing:
    """A drawing with its title as a page shows it, which has it in any size: no scale but its bar is true there."""
    return replace(
        drawing,
        texts=tuple(
            replace(text, text=text.text.removesuffix(TRUE_SIZE)) if text.layer == "TITLE" and text.bold else text
            for text in drawing.texts
        ),
    )


def write_entries(
    pencil: Pencil, block: TitleBlock, left: float, y: float, width: float, size: float, line: float
) -> float:
    """The entries in columns from (left, y) down, each shortened to its column; the baseline of the next line."""
    step = width / COLUMNS
    for k, (label, value) in enumerate(block.entries):
        x, down = left + step * (k % COLUMNS), y - line * (k // COLUMNS)
        pencil.write(label, (x, down), size, "TITLE", colour=SOFT)
        start = 9.5 * LETTER * size  # after the longest label
        pencil.write(shortened(value, step - start - 2.0, size), (x + start, down), size, "TITLE")
    return y - line * len(range(0, len(block.entries), COLUMNS))


def shortened(text: str, width: float, size: float) -> str:
    """A text that takes at most a width [mm] in a size; what is cut off is shown by dots."""
    letters = int(width / (LETTER * size))
    return text if len(text) <= letters else text[: letters - 1].rstrip() + "\N{HORIZONTAL ELLIPSIS}"


def scale_bar(pencil: Pencil, right: float, y: float, longest: float, text: float, scale: float) -> None:
    """A bar of a round length of at most about `longest` [mm of the sheet], ending at `right`, at 1:`scale`."""
    length = nice_step(scale * longest, 2) * 2 / scale
    for k in range(4):
        x = right - length + k * length / 4
        corners = np.array([[x, y], [x + length / 4, y], [x + length / 4, y + 0.4 * text], [x, y + 0.4 * text]])
        pencil.line(corners, "TITLE", closed=True, pen=Pen(INK, 0.06 * text, fill=INK if k % 2 == 0 else PAPER))
    pencil.write("0", (right - length, y - text), 0.8 * text, "TITLE", anchor="middle")
    pencil.write(f"{scale * length:g} mm", (right, y - text), 0.8 * text, "TITLE", anchor="end")
