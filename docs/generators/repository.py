"""Documents at the root of the repository, as pages in docs/generated/, with links to the pages of the others."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCUMENTS = {"README": "overview", "CHANGELOG": "changelog", "CONTRIBUTING": "contributing", "SECURITY": "security"}


def page(name: str) -> str:
    """The page of a document such as "README.md"."""
    return re.sub(r"\]\(([^)\s]+)\)", _moved, (ROOT / name).read_text(encoding="utf-8"))


def _moved(link: re.Match[str]) -> str:
    target = link[1]
    if re.match(r"[a-z]+:|#", target):
        return link[0]
    if example := re.fullmatch(r"examples(?:/(\w+)\.py)?", target):
        return f"](gallery/{example[1] or 'index'}.rst)"
    document, _, rest = target.partition(".md")
    if document in DOCUMENTS:
        return f"]({DOCUMENTS[document]}.md{rest})"
    return f"]({'../' + target.removeprefix('docs/') if target.startswith('docs/') else '../../' + target})"
