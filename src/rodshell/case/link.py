"""A case as tables that a page of the studio can hold, and the link that opens it there."""

import json
import re
import zlib
from base64 import urlsafe_b64encode
from pathlib import Path
from typing import Any

from rodshell.case.case import Case
from rodshell.case.load import BY_SUFFIX, named_files
from rodshell.errors import InputError
from rodshell.schema import written
from rodshell.units import shown
from rodshell.untrusted import limit, raised
from rodshell.validation import instance

ADDRESS = "http://127.0.0.1:8731/"  # of `rodshell studio` without options
LARGEST = 1_000_000  # bytes of a case as JSON that the studio reads
LARGEST_UPLOAD = 50e6  # bytes of a file that the studio reads
UPLOAD = "upload:"  # before the name of a file that was uploaded, where a case names a file
SURFACES = {suffix: kind for suffix, kind in BY_SUFFIX.items() if suffix != ".gltf"}  # a .gltf names further files
OUTLINES = (".dxf", ".obj", ".3dm")  # closed curves that end a surface
_UPLOADS = tuple(dict.fromkeys((*SURFACES, *OUTLINES)))


def studio_link(case: Case, *, address: str = ADDRESS) -> str:
    """The link that opens a case in the studio, which `rodshell studio` must be running: ADDRESS#case=CODE.

    CODE is the case as JSON, compressed (raw deflate) and written in base64 for URLs without padding. It holds no
    files: a case that names some opens in a studio that was started with them, and is refused by others in a sentence.

    Args:
        address: of the studio, as it prints it.

    Raises:
        InputError: not a case; one that is too large; one that holds an object that no case file can describe, or that
            is about a table of rods.
    """
    instance("case", case, Case, "the case of a job: job.case")
    text = json.dumps(page_case(case)[0], separators=(",", ":"))
    require_small(len(text))
    packer = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    packed = packer.compress(text.encode()) + packer.flush()
    return f"{address}#case={urlsafe_b64encode(packed).decode().rstrip('=')}"


def require_small(size: int) -> None:
    """InputError for a case of so many bytes as JSON that the studio does not read it."""
    if size > limit(LARGEST):
        raise InputError(
            f"the case has {size / 1e6:.3g} MB and the studio reads {limit(LARGEST) / 1e6:.3g} MB at most: "
            f"make it smaller, {raised(LARGEST, size)}"
        )


def page_case(case: Case) -> tuple[dict[str, Any], dict[str, Path]]:
    """What differs from a case without keys, in tables as in a case file; files as uploads, with their paths by name.

    Raises:
        InputError: as of `studio_link`; also a file of a kind that the studio does not read.
    """
    if case.of_table:
        raise InputError("the studio finds forms on a target: it does not open a table of rods")
    for name, held in case.held_objects.items():
        if not held.writable:
            raise InputError(f"the studio cannot hold {held.what} ({name}): it opens what a case file can describe")
    rooted = case.absolute()
    tables: dict[str, Any] = {"target": {"kind": rooted.target.kind}} | written(rooted, changed=True)
    paths = dict[str, Path]()
    for table, key in named_files(tables):
        name = upload_name(table[key])
        paths[name] = Path(table[key])
        table[key] = UPLOAD + name
    return tables, paths


def upload_name(name: str) -> str:
    """A plain file name for an upload.

    Args:
        name: as the browser gave it.

    Raises:
        InputError: not the name of a file that the studio reads.
    """
    plain = re.sub(r"[^\w.() -]", "_", name.replace("\\", "/").rpartition("/")[2]).strip(". ")
    plain = plain.encode("utf-8", "replace")[-100:].decode("utf-8", "ignore").strip(". ")  # of bytes, as systems count
    suffix = Path(plain).suffix.lower()
    if suffix == ".gltf":
        raise InputError(
            f"{shown(name)} may name further files, which are not uploaded: save it as .glb, a single file"
        )
    if suffix not in _UPLOADS or not Path(plain).stem:
        raise InputError(f"{shown(name)}: the studio reads {', '.join(_UPLOADS)}")
    return plain
