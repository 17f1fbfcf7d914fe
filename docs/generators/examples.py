"""The gallery: the examples as sphinx-gallery reads them, each with a title, and a picture of what it found."""

import ast
import re
from collections.abc import Iterator, Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

import rodshell as rs
from rodshell.geometry.bounds import bounds
from rodshell.output.pictures import View, picture
from rodshell.output.png import drawing_png

EXAMPLES = Path(__file__).parents[2] / "examples"
LONG = ("gallery", "under_snow")  # shown, but not run: they read files, and take minutes
HEAD = """Examples
========

Each is a complete program. The pictures and the printed lines are those of its run when this site was built, and each
ends with what it asserts.
"""
NO_PICTURE = "no_picture.png"  # of examples that leave nothing to be drawn
PAPER, INK = "#fdfdfb", "#22282f"
SIZE, MARGIN, LARGER = 640, 40, 3  # pixels; lines are drawn larger and reduced, which softens their edges


def titles() -> dict[str, str]:
    """What each example is called, by its name: the beginning of its docstring."""
    docs = {path.stem: ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) for path in EXAMPLES.glob("*.py")}
    return {name: re.split("[:;,.]", doc)[0] for name, doc in sorted(docs.items()) if doc}


def write_examples(folder: Path) -> None:
    """Copies in which the docstring begins with a title; one that is as it was stays untouched."""
    folder.mkdir(parents=True, exist_ok=True)
    files = {"GALLERY_HEADER.rst": HEAD}
    for name, title in titles().items():
        text = (EXAMPLES / f"{name}.py").read_text(encoding="utf-8")
        files[f"{name}.py"] = text.replace('"""', f'"""\n{title}\n{"=" * len(title)}\n\n', 1)
    for old in folder.glob("*.py"):
        if old.name not in files:
            old.unlink()
    Image.new("RGB", (400, 280), PAPER).save(folder / NO_PICTURE)
    for name, text in files.items():
        path = folder / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def scraper(block: object, variables: Mapping[str, Any], settings: Mapping[str, Any], **_: object) -> str:
    """The picture of an example, for sphinx-gallery."""
    from sphinx_gallery.scrapers import figure_rst

    found = picture_of(variables["example_globals"])
    if found is None:
        return ""
    path = Path(next(variables["image_path_iterator"]))
    path.write_bytes(found)
    return str(figure_rst([str(path)], settings["src_dir"]))


def picture_of(names: Mapping[str, Any]) -> bytes | None:
    """PNG of the last form among an example's names, else of its rods, else of the last grid that popped up."""
    found = [each for value in names.values() for each in (value if isinstance(value, list) else [value])]
    forms = [each for each in found if isinstance(each, rs.Form)]
    if forms:
        archive = forms[-1].archive()
        return drawing_png(picture(archive, f"popped_{next(iter(forms[-1].popped))}"))
    rods = [_line(each) for each in found if isinstance(each, rs.RodShape)]
    shells = [each for each in found if isinstance(each, rs.PopUp)]
    lines = rods or [line for shell in shells[-1:] for line in _rods(shell)]
    return _lines_png(lines) if lines else None


def _line(rod: rs.RodShape) -> np.ndarray:
    return np.concatenate([rod.positions, rod.positions[: rod.rod.closed]])


def _rods(shell: rs.PopUp) -> Iterator[np.ndarray]:
    mesh = shell.footprint.mesh
    for nodes in np.split(mesh.rod_nodes, mesh.rod_start[1:]):
        yield shell.positions[nodes]


def _lines_png(lines: list[np.ndarray]) -> bytes:
    view = View.of(np.concatenate(lines), 1.0)
    plane = [view.project(line) * (1, -1) for line in lines]
    low, high = bounds(np.concatenate(plane))
    scale = (SIZE - 2 * MARGIN) / (high - low).max()
    width, height = (scale * (high - low) + 2 * MARGIN).round().astype(int).tolist()
    image = Image.new("RGB", (LARGER * width, LARGER * height), PAPER)
    canvas = ImageDraw.Draw(image)
    for line in plane:
        points = LARGER * (scale * (line - low) + MARGIN)
        canvas.line([*map(tuple, points.tolist())], INK, 2 * LARGER, joint="curve")
    file = BytesIO()
    image.resize((width, height), Image.Resampling.BOX).save(file, "PNG")
    return file.getvalue()
