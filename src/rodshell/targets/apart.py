"""Readers that a damaged file can crash, or hold for ever: each runs in a process of its own, with bounds.

A reader is a program in the folder of this module that imports nothing of rodshell. It has a function `main`, which
takes a dictionary with the `path` of a copy of the file and whatever else it needs, and returns arrays.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from rodshell.errors import InputError
from rodshell.untrusted import limit, raised

LONGEST = 60.0  # seconds that reading may take
MEMORY = 3e9  # bytes that a reader may use
_QUOTED = 120  # characters of a reader's message
_BOUNDED = """
import json, runpy, sys
try:
    import resource
    for what, most in ((resource.RLIMIT_AS, int(sys.argv[4])), (resource.RLIMIT_CPU, int(sys.argv[5]))):
        resource.setrlimit(what, (most, most))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
except (ImportError, OSError, ValueError):
    pass  # this system has no such bounds, or lower ones
found = runpy.run_path(sys.argv[1])["main"](json.loads(sys.argv[2]))
import numpy
numpy.savez(sys.argv[3], **found)
"""


def read_apart(reader: Path, path: Path, data: bytes, format: str, **request: object) -> dict[str, Any]:
    """What a reader finds in a file; messages call it by its `path` and `format`, and `request` is what the reader
    needs.

    Raises:
        InputError: the reader fails, or needs too long.
    """
    import numpy as np

    with tempfile.TemporaryDirectory(prefix="rodshell-") as folder:
        copy, result = Path(folder, "file").with_suffix(path.suffix), Path(folder, "found.npz")
        copy.write_bytes(data)
        bounds = [str(int(limit(most))) for most in (MEMORY, LONGEST)]
        program = [sys.executable, "-P", "-c", _BOUNDED, str(reader)]
        program += [json.dumps({"path": str(copy), **request}), str(result), *bounds]
        one_thread = {f"{library}_NUM_THREADS": "1" for library in ("OPENBLAS", "OMP", "MKL")}  # each reserves memory
        try:
            subprocess.run(
                program, stdin=subprocess.DEVNULL, capture_output=True, timeout=limit(LONGEST), check=True,
                env=os.environ | one_thread,
            )  # fmt: skip
            with np.load(result) as found:
                return {key: found[key] for key in found.files}
        except subprocess.TimeoutExpired:
            raise InputError(
                f"{path} cannot be read within {limit(LONGEST):.0f} s: export only what is needed, "
                f"{raised(LONGEST, 2 * LONGEST)}"
            ) from None
        except (subprocess.CalledProcessError, OSError, ValueError):
            raise unreadable(path, format) from None


def unreadable(path: Path, format: str, reason: Exception | None = None) -> InputError:
    """What is said of a file that breaks its reader, with the reader's own exception if it is of use."""
    said = f" (the reader says: {cause(reason)})" if reason else ""
    return InputError(f"{path} cannot be read as {format}: it is damaged or of another format; export it again{said}")


def cause(reason: Exception) -> str:
    """The message of a reader's exception, on one short line."""
    said = " ".join(str(reason).split())[:_QUOTED]
    return f"{type(reason).__name__}: {said}" if said else type(reason).__name__
