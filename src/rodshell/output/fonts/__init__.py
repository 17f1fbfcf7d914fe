"""The typeface of PDF and PNG: DejaVu Sans Condensed 2.37, unchanged, under the licence in LICENSE.txt.

It covers Latin, Greek and Cyrillic, and is about as wide as Helvetica, in which browsers and CAD programs show the
same drawings. System fonts are never used, so that files are the same on every computer.
"""

from pathlib import Path

REGULAR, BOLD = (Path(__file__).with_name(f"DejaVuSansCondensed{weight}.ttf") for weight in ("", "-Bold"))
CAPITAL = 0.729  # height of a capital over the text size
