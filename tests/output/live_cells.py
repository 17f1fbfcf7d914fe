"""What a spreadsheet would run of a CSV file, by the rules of OWASP on CSV injection."""

import csv
import io
import re

LIVE = re.compile(r"[=+\-@\uff1d\uff0b\uff0d\uff20]")


def live_cells(text: str) -> list[str]:
    """Cells that a spreadsheet would run; where semicolons part cells, what begins with a signed number is none."""
    cells = [cell.strip() for row in csv.reader(io.StringIO(text)) for cell in row]
    parted = [cell.strip() for row in csv.reader(io.StringIO(text), delimiter=";") for cell in row]
    live = [cell for cell in cells if LIVE.match(cell) and not _is_number(cell)]
    return live + [cell for cell in parted if LIVE.match(cell) and not re.match(r"[-+][0-9.]", cell)]


def _is_number(cell: str) -> bool:
    try:
        return bool(float(cell) or True)
    except ValueError:
        return False
