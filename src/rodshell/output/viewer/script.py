"""The script of the viewer, as one ES module without imports: three.js (MIT licence) and our own viewer.js.

static/three.min.js is three.js 0.187.0, bundled and minified by `npm run build` in the folder viewer/ of the
repository, which names the parts that are used. static/LICENSE-three.txt is its licence.
"""

from functools import cache
from importlib.resources import files

STATIC = files("rodshell.output.viewer").joinpath("static")


@cache
def viewer_script() -> str:
    """The module's text, in UTF-8; it exports `createViewer(element)`. Nothing in it ends a script element."""
    parts = (STATIC.joinpath(name).read_text(encoding="utf-8") for name in ("three.min.js", "viewer.js"))
    return "\n".join(parts)


@cache
def viewer_style() -> str:
    """The style sheet of the viewer."""
    return STATIC.joinpath("viewer.css").read_text(encoding="utf-8")
