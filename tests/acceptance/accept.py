"""Prints the acceptance table: `python -m tests.acceptance.accept`; exit 1 where a figure is missed.

Start-up times are ratios of times and belong to `make bench`.
"""

import sys

from tests.acceptance.rows import all_rows, print_table

if __name__ == "__main__":
    sys.exit(print_table("accept", all_rows()))
