"""Settings of the site, for Sphinx: `make docs`. Pages made of the source are first written into docs/generated/."""

import re
import sys
from dataclasses import is_dataclass
from pathlib import Path

from latex2mathml.converter import convert
from sphinx.application import Sphinx

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS.parent))

from docs.generators import api, write_pages  # noqa: E402

project, author, html_title = "rodshell", "The rodshell developers", "rodshell"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["generators"]
default_role = "code"
add_module_names = False
autodoc_member_order = "bysource"
smartquotes = False  # values in quotation marks are copied

myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 4
suppress_warnings = ["config.cache"]

html_theme = "pydata_sphinx_theme"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_math_renderer = "mathml"
html_theme_options = {"show_prev_next": False, "navigation_with_keys": False, "secondary_sidebar_items": ["page-toc"]}
html_show_sourcelink = False


def setup(app: Sphinx) -> None:
    """Formulas become MathML, which browsers draw by themselves: without a script, and offline."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    app.connect("autodoc-process-signature", _signature)
    app.connect("autodoc-process-docstring", _docstring, priority=600)  # after napoleon
    write_pages(DOCS / "generated")


def _signature(app, what, name, thing, options, signature: str | None, returns: str | None):
    """Arrays by that name; of a class its arguments and their defaults, whose types and units its documentation has."""
    if what == "class" and is_dataclass(thing):
        signature = api.arguments(thing)
    array = re.compile(r"ndarray\[tuple\[Any, \.\.\.\], dtype\[\w+\]\]")
    return tuple(text and array.sub("array", text) for text in (signature, returns))


def _docstring(app, what, name, thing, options, lines: list[str]) -> None:
    """Help of a class's keys, as of a case file, among its arguments; |x| is a magnitude, not a name to be replaced."""
    if what == "class" and is_dataclass(thing):
        if lines and lines[0].startswith(f"{thing.__name__}("):  # what Python says where there is no docstring
            lines[:] = [""]
        at = next((k for k, line in enumerate(lines) if line.startswith((":param", ":raises"))), len(lines))
        said = "\n".join(lines)
        added = [f":param {key}: {text}" for key, text in api.keys(thing) if f":param {key}:" not in said]
        lines[at:at] = ["", *added]
    lines[:] = [line.replace("|", "\\|") for line in lines]


def _inline(self, node) -> None:
    self.body.append(convert(node.astext()))
    _skip()


def _block(self, node) -> None:
    self.body.append(f'<div class="math">{convert(node.astext(), display="block")}</div>')
    _skip()


def _skip() -> None:
    from docutils.nodes import SkipNode

    raise SkipNode
