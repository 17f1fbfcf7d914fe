"""Writing SVG: elements with escaped attributes and text, and short numbers."""

from html import escape
from typing import Any

SANS = "Inter, 'Helvetica Neue', Helvetica, Arial, 'Liberation Sans', sans-serif"


def number(value: float, digits: int = 2) -> str:
    """`value` with at most `digits` decimals, as short as can be."""
    text = f"{value:.{digits}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def tag(name: str, *children: str, **attributes: Any) -> str:
    """An element; `children` are markup, attribute names take - for _."""
    words = [name]
    for key, value in attributes.items():
        shown = value if isinstance(value, str) else number(value, 3)
        words.append(f'{key.replace("_", "-")}="{escape(shown)}"')
    opening = " ".join(words)
    return f"<{opening}>{''.join(children)}</{name}>" if children else f"<{opening}/>"


def label(text: str, x: float, y: float, size: float, **attributes: Any) -> str:
    """One line of text with its baseline at (x, y)."""
    return tag("text", escape(text), x=x, y=y, font_size=size, **attributes)


def document(view: tuple[float, float, float, float], *children: str, unit: str = "") -> str:
    """A complete SVG with the view box x, y, width, height; its size is the box's, in `unit`."""
    x, y, width, height = (number(value, 3) for value in view)
    body = "\n".join(child for child in children if child)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}{unit}" height="{height}{unit}" '
        f'viewBox="{x} {y} {width} {height}" font-family="{SANS}">\n{body}\n</svg>\n'
    )


def inline(svg: str) -> str:
    """A document as part of an HTML page, where the namespace is known and the size is the page's choice."""
    head, rest = svg.split("viewBox", 1)
    return f"<svg viewBox{rest}" if head.startswith("<svg") else svg
