"""Pages of the site that follow from the source or from files outside of docs/: one module for each, Sphinx in none."""

from pathlib import Path

from docs.generators import repository

PAGES = {
    "overview.md": lambda: repository.page("README.md"),
    "changelog.md": lambda: repository.page("CHANGELOG.md"),
    "contributing.md": lambda: repository.page("CONTRIBUTING.md"),
    "security.md": lambda: repository.page("SECURITY.md"),
}


def write_pages(folder: Path) -> None:
    """Write all pages; one whose text is as it was stays untouched, so that it is not built again."""
    folder.mkdir(exist_ok=True)
    for name, page in PAGES.items():
        path, text = folder / name, page()
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
