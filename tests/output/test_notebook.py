"""A form in a notebook: it shows itself in 3D, offline, in little space; a widget passes on what was clicked."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from rodshell.output.viewer import scene_of
from tests.output.browser import CHROMIUM, browser_options, needs_browser
from tests.output.forms import form

LIMIT = 1.5e6  # bytes of a notebook

SHOWN = """
<script>
const waiting = setInterval(() => {  // for the caption, which is there once the scene is
  const view = document.querySelector("iframe")?.contentDocument, canvas = view?.querySelector("canvas");
  const caption = view?.querySelector(".caption")?.textContent;
  if (!canvas || !caption) return;
  clearInterval(waiting);
  setTimeout(() => {
    const pen = document.createElement("canvas").getContext("2d");
    [pen.canvas.width, pen.canvas.height] = [canvas.width, canvas.height];
    pen.drawImage(canvas, 0, 0);
    const bytes = pen.getImageData(0, 0, canvas.width, canvas.height).data, seen = new Set();
    for (let k = 0; k < bytes.length; k += 4) seen.add((bytes[k] << 16) | (bytes[k + 1] << 8) | bytes[k + 2]);
    document.body.dataset.found = JSON.stringify({ colours: seen.size, caption });
  }, 3000);
}, 200);
</script>
"""


@pytest.mark.slow
@needs_browser
def test_an_executed_notebook_shows_the_form(tmp_path: Path) -> None:
    """Executed and written as a page by nbconvert, opened without a network."""
    nbformat = pytest.importorskip("nbformat")
    cells = [
        "import rodshell as rs",
        'rs.Job.load("hemisphere", layout__edge="15 mm", checks__stages=2).run()',
    ]
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
    source = tmp_path / "dome.ipynb"
    nbformat.write(notebook, source)
    run = [sys.executable, "-m", "nbconvert", "--execute", "--log-level=ERROR"]
    subprocess.run([*run, "--to", "notebook", "--inplace", str(source)], check=True, timeout=600)
    assert source.stat().st_size < LIMIT
    subprocess.run([*run[:3], "--to", "html", "--template", "basic", str(source)], check=True, timeout=600)
    page = tmp_path / "dome.html"
    page.write_text(f"<!doctype html><body>{page.read_text()}{SHOWN}</body>")
    command = [str(CHROMIUM), *browser_options(tmp_path), "--dump-dom", page.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240)
    match = re.search(r'data-found="([^"]*)"', done.stdout)
    assert match, done.stderr[-2000:]
    found = json.loads(match[1].replace("&quot;", '"'))
    assert found["caption"] == "Popped up, clamped ends (directions held)"
    assert found["colours"] > 50  # a picture, not an empty page


def test_a_widget_holds_the_scene_and_hears_of_clicks() -> None:
    pytest.importorskip("anywidget")
    dome = form("dome")
    widget = dome.widget()
    scene = scene_of(dome.archive())
    assert scene is not None
    assert widget.scene == scene.content()
    heard = []
    widget.observe(lambda change: heard.append(change["new"]), "picked")
    widget.set_state({"picked": "U03"})  # as the browser does
    assert heard == ["U03"]
    assert len(widget._esm) + len(widget.scene) < LIMIT
