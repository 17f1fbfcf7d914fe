"""Pages of the site that follow from the source or from files outside of docs/: one module for each, Sphinx in none."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from docs.generators import api, case_file, commands, findings, repository, verification

PAGES: dict[str, Callable[[], str]] = {
    "overview.md": lambda: repository.page("README.md"),
    "changelog.md": lambda: repository.page("CHANGELOG.md"),
    "contributing.md": lambda: repository.page("CONTRIBUTING.md"),
    "security.md": lambda: repository.page("SECURITY.md"),
    "case_file.md": case_file.page,
    "commands.md": commands.page,
    "findings.md": findings.page,
    "verification.md": verification.page,
    **{f"api_{part}.md": partial(api.page, part) for part in api.PARTS},
}


def write_pages(folder: Path) -> None:
    """Write all pages; one whose text is as it was stays untouched, so that it is not built again."""
    folder.mkdir(exist_ok=True)
    for name, page in PAGES.items():
        path, text = folder / name, page()
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
