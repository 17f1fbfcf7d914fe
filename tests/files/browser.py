"""A browser without a window and without a network, to open reports in.

Tests that want it skip without it, unless RODSHELL_BROWSER=required, as in CI: then they fail.
"""

import json
import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

CHROMIUM = next(
    (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None
)
needs_browser = pytest.mark.skipif(
    CHROMIUM is None and os.environ.get("RODSHELL_BROWSER") != "required",
    reason="no browser: install Chromium (Debian: apt-get install chromium)",
)

PROBE = """
<script>
window.requestAnimationFrame = work => setTimeout(() => work(performance.now()), 0);  // no screen, no frames
addEventListener("load", () => {
  const view = document.getElementById("view"), slider = document.getElementById("view-stage"), found = {};
  const picture = () => view.toDataURL().length + ":" + view.toDataURL().slice(-400);
  const wait = () => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
  const column = (table, k) => [...table.tBodies[0].rows].map(row => row.cells[k].textContent);
  (async () => {
    if (view) {
      found.stages = [];
      for (let k = 0; k <= +slider.max; k++) {
        slider.value = k; slider.dispatchEvent(new Event("input")); await wait();
        found.stages.push([document.getElementById("view-caption").textContent, picture()]);
      }
      const choice = document.getElementById("view-colour");
      found.legends = [];
      const stages = found.stages.map((_, k) => k), bar = document.getElementById("view-bar");
      for (const { value: kind } of choice.options) {
        choice.value = kind; choice.dispatchEvent(new Event("change"));
        for (const k of [...stages, ...stages.toReversed()]) {
          slider.value = k; slider.dispatchEvent(new Event("input")); await wait();
          const visible = getComputedStyle(bar).visibility === "visible", what = bar.querySelector(".what").textContent;
          const ticks = [...bar.querySelectorAll(".ticks span")];
          const places = ticks.map(tick => [parseFloat(tick.style.left) / 100, tick.textContent]);
          found.legends.push([kind, k, visible ? what : "", places]);
        }
      }
      found.kinds = Object.fromEntries([...choice.options].map(({ value, textContent }) => [value, textContent]));
      slider.value = slider.max; slider.dispatchEvent(new Event("input"));
      choice.value = "gap"; choice.dispatchEvent(new Event("change")); await wait(); found.gap = picture();
      choice.value = "stress"; choice.dispatchEvent(new Event("change")); await wait();
      found.stress = picture();
      const at = (type, x, y) => new PointerEvent(type, { pointerId: 1, clientX: x, clientY: y });
      view.setPointerCapture = () => {};
      view.dispatchEvent(at("pointerdown", 300, 300)); view.dispatchEvent(at("pointermove", 380, 340));
      view.dispatchEvent(at("pointerup", 380, 340)); await wait();
      found.turned = picture();
    }
    const table = document.querySelector("table.sortable"), heads = [...table.tHead.rows[0].cells];
    const k = heads.findIndex(head => head.textContent.startsWith("cut length"));
    heads[k].click(); found.up = column(table, k); heads[k].click(); found.down = column(table, k);
    found.ids = column(table, 0);
    const start = performance.now();
    if (view) { slider.dispatchEvent(new Event("input")); await wait(); }
    found.frame = performance.now() - start;
    document.body.dataset.found = JSON.stringify(found);
  })();
});
</script>
"""


def open_report(page: Path, folder: Path) -> tuple[dict[str, Any], list[str]]:
    """What a user finds who moves and clicks everything, and all that the console says."""
    assert CHROMIUM, "no browser, and RODSHELL_BROWSER=required: install Chromium (Debian: apt-get install chromium)"
    probed = folder / "probed.html"
    probed.write_text(page.read_text(encoding="utf-8").replace("</body>", PROBE + "</body>"), encoding="utf-8")
    command = [
        str(CHROMIUM), "--headless=new", "--no-sandbox", "--disable-gpu", "--window-size=1200,900",
        "--host-resolver-rules=MAP * ~NOTFOUND", "--proxy-server=127.0.0.1:9", "--disable-background-networking",
        "--virtual-time-budget=30000", "--enable-logging=stderr", "--v=0", f"--user-data-dir={folder / 'profile'}",
        "--dump-dom", probed.as_uri(),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=240)
    console = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    match = re.search(r'data-found="([^"]*)"', done.stdout)
    assert match, done.stderr[-2000:]
    from html import unescape

    return json.loads(unescape(match[1])), console
