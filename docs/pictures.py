"""Makes the pictures of the README, of the lattices and of the studio: `python docs/pictures.py`."""

import re
from io import BytesIO
from pathlib import Path
from runpy import run_path
from shutil import which
from subprocess import PIPE, Popen
from tempfile import TemporaryDirectory

from PIL import Image
from playwright.sync_api import sync_playwright

from rodshell.job import Job
from rodshell.output.pictures import picture, picture_svg
from rodshell.output.png import drawing_png
from rodshell.results.archive import Archive

FOLDER = Path(__file__).parent / "pictures"
EXAMPLES = Path(__file__).parents[1] / "examples"
LATTICES = ("chebyshev", "geodesic", "three_families", "asymptotic")  # examples of this name
STAGES, PAUSE, STEP = 24, 1500, 100  # of the deployment that moves; ms
WIDE = 600  # pixels
SCREEN = {"width": 1280, "height": 860}
GL = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


def main() -> None:
    (FOLDER / "pavilion.gif").write_bytes(moving(Job.load("pavilion", checks__stages=STAGES).run().archive()))
    refined = Job.load("hemisphere", pop_up__ends="pinned", refine__vary="taper").run()
    for name, form in (("hemisphere", Job.load("hemisphere", pop_up__ends="pinned").run()), ("tapered", refined)):
        (FOLDER / f"{name}.svg").write_text(picture_svg(form.archive(), "popped_pinned", "gap"), encoding="utf-8")
    for name in LATTICES:
        archive = run_path(str(EXAMPLES / f"{name}.py"))["form"].archive()
        (FOLDER / f"{name}.png").write_bytes(drawing_png(picture(archive, "popped_pinned")))
    (FOLDER / "studio.png").write_bytes(studio_page())


def studio_page() -> bytes:
    """The studio's first page in Chromium, by Playwright."""
    chromium = next(path for name in ("chromium", "chromium-browser", "google-chrome") if (path := which(name)))
    options = ("--no-browser", "--no-token", "--port", "0", "--folder")
    with TemporaryDirectory() as folder, sync_playwright() as play:
        server = Popen(["rodshell", "studio", *options, folder], stderr=PIPE, text=True)
        try:
            assert server.stderr is not None
            address = re.search(r"http://\S+", server.stderr.readline())
            assert address is not None
            page = play.chromium.launch(executable_path=chromium, args=GL).new_page(viewport=SCREEN)
            page.goto(address[0])
            page.wait_for_selector("#verdict.good:not(.old)")
            page.wait_for_timeout(PAUSE)
            small = Image.open(BytesIO(page.screenshot())).convert("RGB").quantize(128)
        finally:
            server.terminate()
    file = BytesIO()
    small.save(file, "PNG", optimize=True)
    return file.getvalue()


def moving(archive: Archive) -> bytes:
    """The deployment, from nearly flat to nearly the shell, and a pause, as a GIF that repeats."""
    frames = [drawing_png(picture(archive, f"stage_{k}", "stress")) for k in range(1, STAGES)]
    small = [Image.open(BytesIO(frame)).convert("RGB") for frame in frames]
    small = [frame.resize((WIDE, WIDE * frame.height // frame.width)) for frame in small]
    palette = small[-1].quantize(64)  # of all, or colours would flicker
    small = [frame.quantize(palette=palette) for frame in small]
    file = BytesIO()
    waits = [PAUSE // 2, *[STEP] * (len(small) - 2), PAUSE]
    small[0].save(file, "GIF", save_all=True, append_images=small[1:], duration=waits, loop=0, optimize=True)
    return file.getvalue()


if __name__ == "__main__":
    main()
