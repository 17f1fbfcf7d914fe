"""Makes the pictures of the README and of the lattices: `python docs/pictures.py`."""

from pathlib import Path
from runpy import run_path

from rodshell.job import Job
from rodshell.output.pictures import picture, picture_svg
from rodshell.output.png import drawing_png

FOLDER = Path(__file__).parent / "pictures"
EXAMPLES = Path(__file__).parents[1] / "examples"
LATTICES = ("chebyshev", "geodesic", "three_families", "asymptotic")  # examples of this name


def main() -> None:
    archive = Job.load("pavilion").run().archive()
    (FOLDER / "pavilion-flat.svg").write_text(picture_svg(archive, "flat"), encoding="utf-8")
    (FOLDER / "pavilion-pinned.svg").write_text(picture_svg(archive, "popped_pinned", "stress"), encoding="utf-8")
    for name in LATTICES:
        archive = run_path(str(EXAMPLES / f"{name}.py"))["form"].archive()
        (FOLDER / f"{name}.png").write_bytes(drawing_png(picture(archive, "popped_pinned")))


if __name__ == "__main__":
    main()
