"""Settings of the site, for Sphinx: `make docs`. Pages made of the source are first written into docs/generated/."""

import sys
from pathlib import Path

from latex2mathml.converter import convert
from sphinx.application import Sphinx

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS.parent))

from docs.generators import write_pages  # noqa: E402

project, author, html_title = "rodshell", "The rodshell developers", "rodshell"
extensions = ["myst_parser"]
exclude_patterns = ["generators"]
nitpicky = True

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
    write_pages(DOCS / "generated")


def _inline(self, node) -> None:
    self.body.append(convert(node.astext()))
    _skip()


def _block(self, node) -> None:
    self.body.append(f'<div class="math">{convert(node.astext(), display="block")}</div>')
    _skip()


def _skip() -> None:
    from docutils.nodes import SkipNode

    raise SkipNode
