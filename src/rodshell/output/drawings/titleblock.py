"""The title block: what a drawing is, of which input, to which tolerance, and what it is not."""

import hashlib
from dataclasses import dataclass

import numpy as np

from rodshell.output.archive import Archive, json_text, printable
from rodshell.output.drawing import INK, PAPER, Drawing, Pen, Pencil
from rodshell.output.plan import NOTE, nice_step


@dataclass(frozen=True)
class TitleBlock:
    """What every drawing of a set says.

    Parameters
    ----------
    summary : the cut list in one line.
    input_hash : of the resolved case; the same input gives the same, in whatever units it was written.
    """

    name: str
    summary: str
    project: str
    revision: str
    tolerance: str
    input_hash: str
    version: str

    @property
    def lines(self) -> tuple[str, ...]:
        """What it says, most important first."""
        project = f"{self.project}. " if self.project else ""
        return (
            f"{project}Revision {self.revision}. Tolerance {self.tolerance}. Units mm.",
            f"{self.summary}. {NOTE}.",
            f"Input {self.input_hash}, rodshell {self.version}",
        )


def title_block(archive: Archive, summary: str) -> TitleBlock:
    """The title block of an archive."""
    given = archive.result.get("drawings") or {}
    source = archive.case_toml or json_text({key: archive.result.get(key) for key in ("rods", "boundary")})
    tolerance = given.get("tolerance")
    return TitleBlock(
        archive.name,
        summary,
        printable(str(given.get("project") or "")),
        printable(str(given.get("revision") or "-")),
        "not given" if tolerance is None else f"{1e3 * tolerance:g} mm",
        hashlib.sha256(source.encode()).hexdigest()[:12],
        printable(str(archive.result.get("version_rodshell") or "unknown")),
    )


def with_title(drawing: Drawing, block: TitleBlock) -> Drawing:
    """The drawing with its title block and a scale bar below: for a sheet without a frame."""
    (left, bottom), (right, _) = drawing.box()
    size, pencil = drawing.text, Pencil()
    y = bottom - 2.6 * size
    pencil.line([(left, y + 1.6 * size), (right, y + 1.6 * size)], "TITLE")
    pencil.write(f"{block.name}: {drawing.title.lower()}, 1:1", (left, y), 1.4 * size, "TITLE", bold=True)
    for k, line in enumerate(block.lines, start=1):
        pencil.write(line, (left, y - 1.5 * k * size), size, "TITLE")
    longest = max(len(line) for line in block.lines)
    scale_bar(pencil, left + max(right - left, 0.7 * size * longest), y - 6.5 * size, 0.25 * (right - left), size, 1.0)
    return drawing + pencil.done("", "", size)


def scale_bar(pencil: Pencil, right: float, y: float, longest: float, text: float, scale: float) -> None:
    """A bar of a round length of at most about `longest` [mm of the sheet], ending at `right`, at 1:`scale`."""
    length = nice_step(scale * longest, 2) * 2 / scale
    for k in range(4):
        x = right - length + k * length / 4
        corners = np.array([[x, y], [x + length / 4, y], [x + length / 4, y + 0.4 * text], [x, y + 0.4 * text]])
        pencil.line(corners, "TITLE", closed=True, pen=Pen(INK, 0.06 * text, fill=INK if k % 2 == 0 else PAPER))
    pencil.write("0", (right - length, y - text), 0.8 * text, "TITLE", anchor="middle")
    pencil.write(f"{scale * length:g} mm", (right, y - text), 0.8 * text, "TITLE", anchor="end")
