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

import numpy as np
import pytest

from rodshell.results import Archive

CHROMIUM = next(
    (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None
)
needs_browser = pytest.mark.skipif(
    CHROMIUM is None and os.environ.get("RODSHELL_BROWSER") != "required",
    reason="no browser: install Chromium (Debian: apt-get install chromium)",
)

UNITS = {
    "GPa": 1e9,
    "MPa": 1e6,
    "kPa": 1e3,
    "Pa": 1.0,
    "mm": 1e-3,
    "m": 1.0,
    "1/m": 1.0,
    "kN": 1e3,
    "N": 1.0,
    "mN": 1e-3,
}


SCALE = 0.25  # pixels drawn for each of the page: the layout is the same, and the processor draws a sixteenth of them

PROBE = """
<script>
window.requestAnimationFrame = work => setTimeout(() => work(performance.now()), 0);  // no screen, no frames
addEventListener("load", () => {
  const part = name => document.querySelector("#view " + name), found = {};
  const view = part("canvas"), slider = part("input.stages");
  const picture = () => view.toDataURL().length + ":" + view.toDataURL().slice(-400);
  const wait = () => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
  const column = (table, k) => [...table.tBodies[0].rows].map(row => row.cells[k].textContent);
  (async () => {
    if (view) {
      found.stages = [];
      for (let k = 0; k <= +slider.max; k++) {
        slider.value = k; slider.dispatchEvent(new Event("input")); await wait();
        found.stages.push([part(".caption").textContent, picture()]);
      }
      const choice = part("select.colours");
      found.legends = [];
      const stages = found.stages.map((_, k) => k), bar = part(".bar"), drawing = WebGL2RenderingContext.prototype;
      const draw = Object.entries(Object.getOwnPropertyDescriptors(drawing)).filter(([name]) => /^draw[AE]/.test(name));
      for (const [name] of draw) drawing[name] = () => {};  // only what is written beside the view is read
      for (const { value: kind } of LEGENDS ? choice.options : []) {
        choice.value = kind; choice.dispatchEvent(new Event("change"));
        for (const k of [...stages, ...stages.toReversed()]) {
          slider.value = k; slider.dispatchEvent(new Event("input")); await wait();
          const visible = getComputedStyle(bar).visibility === "visible", what = bar.querySelector(".what").textContent;
          const ticks = [...bar.querySelectorAll(".ticks span")];
          const places = ticks.map(tick => [parseFloat(tick.style.left) / 100, tick.textContent]);
          found.legends.push([kind, k, visible ? what : "", places]);
        }
      }
      Object.defineProperties(drawing, Object.fromEntries(draw));
      found.kinds = Object.fromEntries([...choice.options].map(({ value, textContent }) => [value, textContent]));
      slider.value = slider.max; slider.dispatchEvent(new Event("input"));
      choice.value = "gap"; choice.dispatchEvent(new Event("change")); await wait(); found.gap = picture();
      choice.value = "stress"; choice.dispatchEvent(new Event("change")); await wait();
      found.stress = picture();
      const at = (type, x, y) => new PointerEvent(type, { pointerId: 1, clientX: x, clientY: y, bubbles: true });
      view.setPointerCapture = view.releasePointerCapture = () => {};
      view.dispatchEvent(at("pointerdown", 300, 300)); view.dispatchEvent(at("pointermove", 380, 340));
      view.dispatchEvent(at("pointerup", 380, 340)); await wait();
      found.turned = picture();
    }
    const table = document.querySelector("table.sortable"), heads = [...table.tHead.rows[0].cells];
    const k = heads.findIndex(head => head.textContent.startsWith("cut length"));
    heads[k].click(); found.up = column(table, k); heads[k].click(); found.down = column(table, k);
    found.ids = column(table, 0);
    found.over = [];
    for (const width of [1300, 420]) {
      Object.assign(document.body.style, { width: width + "px", maxWidth: Math.min(width, 1088) + "px" });
      for (const part of document.querySelectorAll(".groups *, .narrow *, .notice *, header *")) {
        const room = part.closest("section, div, header").getBoundingClientRect().right;
        if (part.getBoundingClientRect().right > room + 1) found.over.push([width, part.textContent.trim()]);
      }
    }
    Object.assign(document.body.style, { width: "", maxWidth: "" });
    const start = performance.now();
    if (view) { slider.dispatchEvent(new Event("input")); await wait(); }
    found.frame = performance.now() - start;
    document.body.dataset.found = JSON.stringify(found);
  })();
});
</script>
"""


def browser_options(folder: Path) -> list[str]:
    """Without a window, without a network; WebGL is drawn by the processor. The profile lies in `folder`."""
    return [
        "--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
        "--window-size=1200,900", f"--force-device-scale-factor={SCALE}",
        "--host-resolver-rules=MAP * ~NOTFOUND", "--proxy-server=127.0.0.1:9",
        "--disable-background-networking", "--virtual-time-budget=30000", "--enable-logging=stderr", "--v=0",
        f"--user-data-dir={folder / 'profile'}",
    ]  # fmt: skip


def open_report(page: Path, folder: Path, *, legends: bool = True) -> tuple[dict[str, Any], list[str]]:
    """What a user finds who moves and clicks everything (the colours of every stage, too, if `legends`), and all that
    the console says."""
    assert CHROMIUM, "no browser, and RODSHELL_BROWSER=required: install Chromium (Debian: apt-get install chromium)"
    probed = folder / "probed.html"
    probe = PROBE.replace("LEGENDS", str(legends).lower())
    probed.write_text(page.read_text(encoding="utf-8").replace("</body>", probe + "</body>"), encoding="utf-8")
    command = [str(CHROMIUM), *browser_options(folder), "--dump-dom", probed.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240)
    console = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    match = re.search(r'data-found="([^"]*)"', done.stdout)
    assert match, done.stderr[-2000:]
    from html import unescape

    return json.loads(unescape(match[1])), console


def coloured(made: Archive) -> dict[str, list[np.ndarray | None]]:
    """By colour, what each stage of the view shows (Pa, m, 1/m, N) at each entry of `rod_nodes`, where it is known."""
    states, nodes = made.states, made.states["rod_nodes"]
    ends = [end for end in ("pinned", "clamped") if f"popped_{end}" in states]
    between = len(states["history"]) - 2 if "history" in states else 0
    draped = [states["gap_draped"][nodes]] if "draped" in states else []
    unknown: list[np.ndarray | None] = [None] * (len(draped) + 1)  # draped, and flat
    if not made.results.plain().get("target"):
        found = {"gap": [None, *(states[f"popped_{end}"][nodes, 2] for end in ends)]}
    else:
        found = {"gap": [*draped, *[None] * (1 + between), *(states[f"gap_{end}"][nodes] for end in ends)]}
    for kind in ("stress", "curvature"):
        if f"{kind}_{ends[0]}" in states:
            stages = states.get(f"history_{kind}", [])[1 : between + 1]
            found[kind] = [*unknown, *stages, *(states[f"{kind}_{end}"] for end in ends)]
    if f"force_{ends[0]}" in states:
        found["force"] = [*unknown, *[None] * between, *(states[f"force_{end}"] for end in ends)]
    return found


def wrong_legends(made: Archive, found: dict[str, Any]) -> list[str]:
    """Every caption or tick at the colour bar that is not true of the frame that is shown."""
    strength, wrong = (made.results.plain().get("bending") or {}).get("strength"), []
    for kind, k, caption, ticks in found["legends"]:
        shown = coloured(made)[kind][k] if kind != "none" else None
        if shown is None or not caption:
            wrong += [f"{kind}, frame {k}: {caption!r}"] if (shown is None) != (not caption) else []
            continue
        what, unit = re.match(r"([a-z ]+) in ([A-Za-z%1/]+)", caption).groups()  # type: ignore[union-attr]
        values = shown / (strength / 100 if unit == "%" else UNITS[unit])
        named = re.search(r"here up to ([0-9.e+-]+)(?:, above 100 in magenta)?$", caption)
        capped = caption.endswith("above 100 in magenta")
        (share, least), (stop, most) = [
            (at, float(text.replace("\N{MINUS SIGN}", "-"))) for at, text in ticks[:: len(ticks) - 1]
        ]
        low, high = (least + (end - share) * (most - least) / (stop - share) for end in (0, 1))
        true = {
            "word": what
            == {
                "gap": "gap to target" if made.results.plain().get("target") else "height",
                "stress": "utilisation" if strength else "stress",
                "curvature": "curvature",
                "force": "normal force",
            }[kind],
            "choice": found["kinds"][kind] == what,
            "largest": kind in ("gap", "force") or (named and float(named[1]) == pytest.approx(values.max(), rel=6e-3)),
            "range": low <= values.min() + 1e-3 * (high - low)
            and (high == pytest.approx(100) if capped else values.max() <= high + 1e-3 * (high - low)),
        }
        wrong += [f"{kind}, frame {k}: {caption!r}, {ticks} ({name})" for name, right in true.items() if not right]
    return wrong
