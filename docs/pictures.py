"""Makes the README's pictures: `python docs/pictures.py`."""

from pathlib import Path

from rodshell.case import load_case
from rodshell.form import find_form
from rodshell.output import picture_svg

FOLDER = Path(__file__).parent / "pictures"


def main() -> None:
    target, layout, rod, options = load_case("hemisphere").build()
    archive = find_form(target, layout, rod, **options).archive()
    for name, state in (("flat", "flat"), ("clamped", "popped_clamped")):
        (FOLDER / f"hemisphere-{name}.svg").write_text(picture_svg(archive, state), encoding="utf-8")


if __name__ == "__main__":
    main()
