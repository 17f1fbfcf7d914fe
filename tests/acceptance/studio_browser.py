"""The studio, a report and a notebook in a browser, driven by a robot that clicks what a user clicks."""

import json
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from playwright.sync_api import Page, sync_playwright

from rodshell.output.files import export
from tests.acceptance.rows import Row
from tests.acceptance.targets_broken import as_obj, dome
from tests.output.browser import CHROMIUM
from tests.output.sample_archive import sample_archive

OPTIONS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
CHECKED = ", ".join(f"#verdict.{level}:not(.old)" for level in ("good", "check", "unbuildable", "unknown"))
PATIENCE = 120_000  # ms


@contextmanager
def browser_page(said: list[str], scale: float = 1.0) -> Iterator[Page]:
    """A page of Chromium, drawn with `scale` pixels for each of its own; its console, and errors, go into `said`."""
    assert CHROMIUM, "no browser, and RODSHELL_BROWSER=required: install Chromium (Debian: apt-get install chromium)"
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=CHROMIUM, args=OPTIONS)
        context = browser.new_context(viewport={"width": 1440, "height": 900}, device_scale_factor=scale)
        page = context.new_page()
        page.set_default_timeout(PATIENCE)
        page.on("console", lambda message: said.append(message.text) if message.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: said.append(str(error)))
        yield page
        browser.close()


def errors(said: list[str]) -> list[str]:
    """What is wrong; a processor that draws slowly is not."""
    return [text for text in said if not re.search(r"GPU stall|swiftshader|WebGL.*(fallback|performance)", text, re.I)]


CAPTION = """(part, k) => new Promise(done => {
  part.value = k;
  part.dispatchEvent(new Event("input"));
  requestAnimationFrame(() => requestAnimationFrame(() => done(document.querySelector("#view .caption").textContent)));
})"""  # of a stage of the view, once it was drawn


class Robot:
    """Clicks through the studio and keeps a picture of each step."""

    def __init__(self, page: Page, pictures: Path, name: str) -> None:
        self.page, self.pictures, self.name, self.steps = page, pictures, name, 0
        pictures.mkdir(parents=True, exist_ok=True)

    def checked(self) -> None:
        """Wait until the present case has its verdict."""
        self.page.wait_for_selector(f"{CHECKED}, #verdict.failed:not(.old)")
        self.page.wait_for_selector("#state:empty", state="attached")

    def picture(self, what: str) -> None:
        self.steps += 1
        self.page.screenshot(path=self.pictures / f"{self.name}_{self.steps}_{what}.png")

    def dragged_slider(self, name: str) -> None:
        """Drag a slider by a tenth of its width, and let go."""
        bar = self.page.locator(".lil-controller", has_text=name).first.locator(".lil-slider")
        box = bar.bounding_box()
        assert box is not None
        fill = bar.locator(".lil-fill").bounding_box()
        assert fill is not None
        x, y = fill["x"] + fill["width"], box["y"] + box["height"] / 2
        self.page.mouse.move(x, y)
        self.page.mouse.down()
        for k in range(8):
            self.page.mouse.move(x + 0.004 * k * box["width"], y)
            time.sleep(0.05)
        self.page.mouse.up()
        time.sleep(0.3)
        self.checked()

    def dragged_handle(self, name: str, by: tuple[int, int]) -> None:
        """Drag a handle in space by some pixels, and let go."""
        x, y = json.loads(self.page.get_attribute("#view", "data-handles") or "{}")[name]
        self.page.mouse.move(x, y)
        self.page.mouse.down()
        for k in range(1, 9):
            self.page.mouse.move(x + by[0] * k / 8, y + by[1] * k / 8)
            time.sleep(0.05)
        self.page.mouse.up()
        self.checked()

    def keep(self, name: str) -> None:
        self.page.fill("#name", name)
        self.page.click("#keep button")
        self.page.wait_for_selector(f"#variants input[value='{name}']")


def flow(robot: Robot) -> list[str]:
    """Drag, leave a rod out, undo, keep, compare, link, script, download: what did not work."""
    page, wrong = robot.page, []
    robot.checked()
    robot.picture("begun")
    robot.keep("first")
    before = page.inner_text("#figures")
    robot.dragged_slider("Spacing")
    robot.picture("spacing")
    wrong += ["spacing"] if page.inner_text("#figures") == before else []
    before = page.url  # with the case; a turned dome has the same figures
    robot.dragged_slider("Heading")
    robot.picture("heading")
    wrong += ["heading"] if page.url == before or page.input_value("input[data-path='layout.rotate']") == "0" else []
    handles = [("anchor", "drape.anchor"), ("heading", "layout.rotate"), ("base", "target.base")]
    for handle, key in handles[: 2 if robot.name == "dome" else 3]:
        before = page.url
        robot.dragged_handle(handle, (24, 6) if handle != "base" else (0, -12))
        field = page.locator(f"input[data-path='{key}']").last.input_value()
        wrong += [f"handle of {handle}"] if page.url == before or field in ("", "0") else []
        robot.picture(handle)
    lines = page.locator("#plan line.hit")
    name = lines.nth(2).get_attribute("data-rod")
    lines.nth(2).dispatch_event("pointerover")
    wrong += ["hover"] if str(name) not in page.inner_text("#plan figcaption") else []
    lines.nth(2).dispatch_event("click")
    time.sleep(0.3)
    robot.checked()
    wrong += ["rod left out"] if str(name) not in page.inner_text("#left-out") else []
    robot.picture("left_out")
    robot.keep("second")
    for box in page.query_selector_all("#variants input[type=checkbox]"):
        box.check()
    page.click("#compare")
    page.wait_for_selector("#side tbody tr")
    time.sleep(1)
    robot.picture("compared")
    wrong += ["compare"] if len(page.query_selector_all("#side canvas")) != 2 else []
    page.click("#side > button")
    page.click("#undo")
    time.sleep(0.5)
    robot.checked()
    wrong += ["undo"] if str(name) in page.inner_text("#left-out") else []
    page.click("#redo")
    time.sleep(0.5)
    robot.checked()
    wrong += ["redo"] if str(name) not in page.inner_text("#left-out") else []
    page.click("#python")
    wrong += ["script"] if "rs.Job.load" not in page.inner_text("#script pre") else []
    page.click("#script > button")
    with page.expect_download() as download:
        page.click("#download")
    wrong += ["download"] if not download.value.suggested_filename.endswith(".zip") else []
    figures, link = page.inner_text("#figures"), page.url
    page.reload()
    time.sleep(0.5)
    robot.checked()
    robot.picture("reloaded")
    wrong += ["reload"] if page.inner_text("#figures") != figures else []
    wrong += ["variants"] if len(page.query_selector_all("#variants li")) != 2 else []
    page.evaluate("() => localStorage.clear()")
    page.goto("about:blank")
    page.goto(link)
    if robot.name == "dome":
        robot.checked()
        wrong += ["link"] if page.inner_text("#figures") != figures else []
    else:  # a link holds no files, and this session is a new one
        page.wait_for_selector("#verdict.failed")
        wrong += ["link"] if "upload it first" not in page.inner_text("#verdict") else []
    return wrong


def unnamed(page: Page) -> int:
    """Controls that have no name for a screen reader."""
    return int(
        page.evaluate("""() => [...document.querySelectorAll("button, input, select, a")].filter(part =>
        part.offsetParent && !(part.getAttribute("aria-label") || part.textContent.trim() || part.labels?.length
        || part.getAttribute("aria-labelledby") || part.title)).length""")
    )


def browser_rows(address: str, folder: Path, pictures: Path) -> Iterator[Row]:
    """All flows on a dome, a mesh roof and an oculus."""
    said: list[str] = []
    folder.mkdir(parents=True, exist_ok=True)
    points, faces = dome()
    (folder / "roof.obj").write_bytes(as_obj(points, faces))
    ring = faces[(faces >= 3 * 24).all(axis=1)]
    used = np.unique(ring)
    (folder / "oculus.obj").write_bytes(as_obj(points[used], np.searchsorted(used, ring)))
    with browser_page(said) as page:
        for name in ("dome", "roof", "oculus"):
            robot = Robot(page, pictures, name)
            page.goto("about:blank")
            page.goto(address)
            page.evaluate("() => localStorage.clear()")
            page.goto("about:blank")
            page.goto(address)
            robot.checked()
            start(robot, name, folder / f"{name}.obj")
            wrong = flow(robot)
            yield Row(f"clicked through: {name}", "steps that did not work", len(wrong), 0, note=", ".join(wrong))
        yield Row("", "controls without a name", unnamed(page), 0)
    wrong = errors(said)
    yield Row("", "errors in the console", len(wrong), 0, note="; ".join(wrong)[:200])


def start(robot: Robot, name: str, mesh: Path) -> None:
    """Put the first case on the page as a user does: a built-in one, or an upload."""
    page = robot.page
    if name == "dome":
        page.select_option("#preset", "hemisphere")
        return
    page.set_input_files("#file", mesh)
    page.wait_for_selector("#verdict.failed")  # a mesh needs its unit
    page.locator(".lil-title", has_text=re.compile("^Target$")).click()
    field = page.locator("input[aria-label^='unit:']").first
    field.fill("m")
    field.press("Enter")
    time.sleep(1)


def report_rows(folder: Path) -> Iterator[Row]:
    """The report of 60 x 60 rods: its size, its captions, and that it asks for nothing."""
    archive, said, asked = sample_archive(60, 6), [], []
    export(archive, folder, ["report"])
    report = folder / "report.html"
    yield Row("report of 60 x 60 rods", "size", report.stat().st_size / 1e6, 15, "MB")
    with browser_page(said) as page:
        page.on("request", lambda request: asked.append(request.url))
        page.goto(report.as_uri())
        page.wait_for_selector("#view canvas")
        slider, found = page.locator("#view input.stages"), []
        for k in range(int(slider.get_attribute("max") or 0) + 1):
            found.append(slider.evaluate(CAPTION, k))
    from rodshell.output.grid import shape_names, shape_of

    names = list(shape_names(archive))
    names = [name for name in names if name == "draped"] + [name for name in names if name != "draped"]
    captions = [shape_of(archive, name).caption for name in names]
    wrong = sum(a != b for a, b in zip(found, captions, strict=False)) + abs(len(found) - len(captions))
    yield Row("", "captions that are wrong", wrong, 0, note=f"{len(found)} stages")
    abroad = [url for url in asked if not url.startswith(("file:", "data:", "blob:"))]
    yield Row("", "requests to elsewhere", len(abroad), 0)
    yield Row("", "errors in the console", len(errors(said)), 0, note="; ".join(errors(said))[:200])


def notebook_rows(folder: Path) -> Iterator[Row]:
    """A notebook that was executed and rendered."""
    import nbformat
    from nbconvert import HTMLExporter
    from nbconvert.preprocessors import ExecutePreprocessor

    folder.mkdir(parents=True)
    case = 'import rodshell as rs\nrs.Job.load("hemisphere", layout__spacing="60 mm", checks__stages=0).run()'
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(case)])
    ExecutePreprocessor(timeout=240).preprocess(notebook, {"metadata": {"path": str(folder)}})
    shown = notebook.cells[0].outputs[-1]["data"]["text/html"]
    yield Row("notebook", "size of what a form shows", len(shown) / 1e6, 1.5, "MB")
    (folder / "page.html").write_text(HTMLExporter().from_notebook_node(notebook)[0])
    said: list[str] = []
    with browser_page(said) as page:
        page.goto((folder / "page.html").as_uri(), wait_until="domcontentloaded")
        frame = page.frame_locator("iframe").first
        frame.locator("canvas").wait_for()
        time.sleep(2)
        caption = frame.locator(".caption").inner_text()
        page.screenshot(path=folder / "notebook.png")
    yield Row("", "no caption in the frame", float(not caption), 0, note=caption)
