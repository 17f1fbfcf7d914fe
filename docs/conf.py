"""Settings of the site, for Sphinx: `make docs`. Pages made of the source are first written into docs/generated/."""

import re
import sys
from dataclasses import is_dataclass
from pathlib import Path

from docutils.nodes import SkipNode, Text
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.math import get_node_equation_number

DOCS = Path(__file__).parent
LOADED = re.compile(r"<(?:script|link|img|iframe)[^>]*\b(?:src|href)=\"(?:https?:)?//[^\"]*")
COLON = "\ue000"  # stands for a colon while docstrings are read
sys.path.insert(0, str(DOCS.parent))

from docs.generators import api, examples, write_pages  # noqa: E402

project, author, html_title = "rodshell", "The rodshell developers", "rodshell"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_gallery.gen_gallery"]
exclude_patterns = ["generators"]
default_role = "code"
add_module_names = False
autodoc_member_order = "bysource"
highlight_language = "none"  # of blocks that do not say theirs
smartquotes = False  # values in quotation marks are copied

myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 4
numfig = True  # equations are numbered by chapter: math_numfig
suppress_warnings = ["config.cache"]

BUILT_EXAMPLES = DOCS.parent / "build" / "examples"
sphinx_gallery_conf = {
    "examples_dirs": str(BUILT_EXAMPLES),
    "gallery_dirs": "generated/gallery",
    "filename_pattern": rf"/(?!{'|'.join(examples.LONG)})\w+\.py$",
    "within_subsection_order": "FileNameSortKey",
    "image_scrapers": ("docs.generators.examples.scraper",),
    "default_thumb_file": str(BUILT_EXAMPLES / examples.NO_PICTURE),
    "write_computation_times": False,
    "reset_modules": (),
    "capture_repr": (),
    "download_all_examples": False,
    "show_signature": False,
    "remove_config_comments": True,
}

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
    app.connect("autodoc-process-docstring", _hide_colon, priority=400)  # before napoleon
    app.connect("source-read", _examples_on_pages)
    app.connect("doctree-resolved", _dashes)
    app.connect("build-finished", _require_offline)
    write_pages(DOCS / "generated")
    examples.write_examples(BUILT_EXAMPLES)


def _signature(app, what, name, thing, options, signature: str | None, returns: str | None):
    """Arrays by that name; of a class its arguments and their defaults, whose types and units its documentation has."""
    if what == "class" and is_dataclass(thing):
        signature = api.arguments(thing)
    array = re.compile(r"(numpy\.)?ndarray\[tuple\[(typing\.)?Any, \.\.\.\], (numpy\.)?dtype\[[\w.]+\]\]")
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
    lines[:] = [line.replace("|", "\\|").replace(COLON, ":") for line in lines]


def _hide_colon(app, what, name, thing, options, lines: list[str]) -> None:
    """A colon in the first line of a property is one, and not the end of a type, as which napoleon reads it."""
    if what in ("property", "attribute", "data") and lines:
        lines[0] = lines[0].replace(":", COLON)


def _examples_on_pages(app, name: str, source: list[str]) -> None:
    """Links to examples lead to their pages in the gallery."""
    source[0] = re.sub(r"\]\(\.\./examples/(\w+)\.py\)", r"](/generated/gallery/\1.rst)", source[0])


def _require_offline(app, error: Exception | None) -> None:
    """No page may load anything from elsewhere; links may lead there."""
    for page in [] if error else Path(app.outdir).rglob("*.html"):
        if found := LOADED.search(page.read_text(encoding="utf-8")):
            raise ExtensionError(f"{page} is not readable offline: {found[0]}")


def _dashes(app, doctree, name: str) -> None:
    """Between a parameter and its meaning Sphinx writes two hyphens, which nothing else makes a dash."""
    for text in [*doctree.findall(lambda node: isinstance(node, Text) and node == " -- ")]:
        text.parent.replace(text, Text(" – "))


def _inline(self, node) -> None:
    self.body.append(convert(node.astext()))
    _skip()


def _block(self, node) -> None:
    number = f'<span class="eqno">({get_node_equation_number(self, node)})</span>' if node["number"] else ""
    formula = convert(node.astext(), display="block")
    self.body.append(f"{self.starttag(node, 'div', CLASS='math')}{formula}{number}</div>")
    _skip()


def _skip() -> None:
    raise SkipNode
