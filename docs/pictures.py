"""Makes the README's pictures: `python docs/pictures.py`."""

from pathlib import Path

from rodshell.job import Job
from rodshell.output.pictures import picture_svg

FOLDER = Path(__file__).parent / "pictures"


def main() -> None:
    archive = Job.load("pavilion").run().archive()
    (FOLDER / "pavilion-flat.svg").write_text(picture_svg(archive, "flat"), encoding="utf-8")
    (FOLDER / "pavilion-pinned.svg").write_text(picture_svg(archive, "popped_pinned", "stress"), encoding="utf-8")


if __name__ == "__main__":
    main()
