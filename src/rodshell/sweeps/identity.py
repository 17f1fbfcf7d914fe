"""By what a job is known: its resolved case, the content of its files, and the program.

The same job in another folder, with its files called otherwise, is the same job.
"""

import hashlib
import json
from functools import cache
from pathlib import Path
from typing import Any

from rodshell.case.load import named_files
from rodshell.errors import InputError
from rodshell.job import Job
from rodshell.schema import written
from rodshell.targets.gltf import gltf_parts
from rodshell.targets.mesh_files import file_bytes
from rodshell.units import shown
from rodshell.version import __version__

DIGITS = 32


def job_identity(job: Job, until: str) -> str:
    """`DIGITS` hexadecimal digits of SHA-256, of a job whose case a file can describe and the last stage that is run.

    Raises:
        InputError: a file of the case cannot be read.
    """
    tables: dict[str, Any] = written(job.case)
    for table, key in named_files(tables):
        table[key] = content_digest(Path(table[key]))
    content = json.dumps([program_version(), until, tables], sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(content.encode()).hexdigest()[:DIGITS]


def content_digest(path: Path) -> str:
    """The type and the SHA-256 of a file, read again only if it changed; of a glTF file also those that it names."""
    try:
        stat = path.stat()
        return _digest(path.absolute(), stat.st_mtime_ns, stat.st_size)
    except OSError as error:
        raise InputError(f"target.file = {shown(str(path))} cannot be read: {error.strerror}") from None


@cache
def _digest(path: Path, _modified: int, _size: int) -> str:
    content = file_bytes(path)
    digest = hashlib.sha256(content)
    if path.suffix.lower() == ".gltf":
        for part in gltf_parts(path, content).values():
            digest.update(part)
    return f"{path.suffix.lower()} {digest.hexdigest()}"


@cache
def program_version() -> str:
    """The version, and twelve digits of SHA-256 of the sources, which may have changed since."""
    digest = hashlib.sha256()
    home = Path(__file__).parents[1]
    for file in sorted(home.rglob("*.py")):
        digest.update(f"{file.relative_to(home).as_posix()}\n".encode() + file.read_bytes())
    return f"{__version__}+{digest.hexdigest()[:12]}"
