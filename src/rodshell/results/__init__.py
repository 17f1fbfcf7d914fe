"""What is kept of a form: the typed content of result.json, its archive on disk, its verdict and its summary.

`Results` knows every key of result.json with its meaning and its unit; `read` opens the folder of a result. Drawings,
tables, models and the report are made from an `Archive` by `rodshell.output`, which only reads it.
"""

from rodshell.results.archive import Archive, read
from rodshell.results.results import Results, Verdict

__all__ = ["Archive", "Results", "Verdict", "read"]
