"""CSV files: the one place where they are written. Spreadsheets must not take a text for a formula [OWASP].

OWASP, "CSV Injection": cells that begin with = + - @ (also as full-width letters), a tab or a line break are run by
Excel, LibreOffice and Google Sheets. They get an apostrophe, by which a spreadsheet takes what follows for text.
"""

import csv
import io
import re
from collections.abc import Iterable, Sequence

from rodshell.output.archive import printable

NUMBER = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
RUN = "=+\\-@\uff1d\uff0b\uff0d\uff20"  # what a formula begins with, the last four full-width
WHOLE = re.compile(NUMBER)
FORMULA = re.compile(rf'(^[\s"]*|[;,][\s"]*(?!{NUMBER}\s*(?:[;,]|$)))(?=[{RUN}])')


def csv_text(rows: Iterable[Sequence[object]]) -> str:
    """Rows as CSV; a number stays as it is, a text that a spreadsheet would run gets an apostrophe."""
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows([[safe_cell(str(cell)) for cell in row] for row in rows])
    return stream.getvalue()


def safe_cell(cell: str) -> str:
    """A cell that no spreadsheet takes for a formula, whether it parts cells by commas or by semicolons."""
    return cell if WHOLE.fullmatch(cell) else FORMULA.sub(r"\1'", printable(cell))
