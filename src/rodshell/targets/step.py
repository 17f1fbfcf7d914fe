"""Faces in STEP files, trimmed or not: points of the surface of one face, and its trims as curves."""

import json
import re
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.targets.curvefile import closed_loops
from rodshell.targets.meshfile import file_bytes
from rodshell.targets.nurbs import FINEST, GRID, PER_SPAN, grid_triangles
from rodshell.units import shown

STEP_FILES = (".step", ".stp")
UNIT = 1e-3  # m: OpenCASCADE turns every unit into millimetres
LAST = b"END-ISO-10303-21"  # line of a whole file
ABSURD = re.compile(rb"-?\d\.\d*E\+?\d{3,}")  # OpenCASCADE searches infinity without end
READER = Path(__file__).with_name("opencascade.py")
LONGEST = 120.0  # seconds that reading may take
SAMPLES = {"grid": GRID, "per_span": PER_SPAN, "finest": FINEST, "along_edges": 400}
LISTED = 12  # faces named in a message


def read_step(path: Path, name: str | None = None) -> tuple[Floats, Ints, list[Floats]]:
    """Vertices (n, 3), triangles and trims (closed polylines) of a face [m].

    Parameters
    ----------
    name : of the face, or of its shell or solid, or the face's number from 1 on, where there are several.

    Raises
    ------
    InputError : no such file, damaged, without OpenCASCADE, without one single face.
    """
    if find_spec("OCP") is None:
        raise InputError(f'{path}: STEP files need OpenCASCADE: pip install "rodshell[step]"')
    data = file_bytes(path)
    if LAST not in data[-1000:]:
        raise InputError(f"{path} is no whole STEP file: its last line is missing; export it anew")
    if far := ABSURD.search(data):
        raise InputError(f"{path} is damaged: {far[0].decode()} is no coordinate; export it anew")
    with tempfile.TemporaryDirectory() as folder:
        result = Path(folder) / "face.npz"
        request = json.dumps({"path": str(path), "name": name, **SAMPLES})
        program = [sys.executable, "-P", str(READER), request, str(result)]
        try:
            subprocess.run(program, capture_output=True, timeout=LONGEST, check=True)
            with np.load(result) as found:
                parts = {key: found[key] for key in found.files}
        except subprocess.TimeoutExpired:
            raise InputError(f"{path} cannot be read within {LONGEST:.0f} s: export the one face alone") from None
        except (subprocess.CalledProcessError, OSError):
            raise InputError(f"{path} cannot be read as STEP: it is damaged; export it anew") from None
    if "points" not in parts:
        raise _not_one(path, json.loads(str(parts["names"])), name)
    rows, columns, _ = parts["points"].shape
    vertices, triangles = UNIT * parts["points"].reshape(-1, 3), grid_triangles(rows, columns)
    return vertices, triangles, closed_loops(UNIT * parts["trims"])


def _not_one(path: Path, faces: list[list[str]], name: str | None) -> InputError:
    if not faces:
        return InputError(f"{path} holds no face: export the surface, not its edges or its mesh, as STEP")
    what = f"{len(faces)} faces"
    if name is not None:
        what = f"{sum(name in names for names in faces)} faces named {shown(name)}"
    listed = [", ".join([str(k), *map(shown, names)]) for k, names in enumerate(faces[:LISTED], start=1)]
    there = "; ".join(listed) + ("; ..." if len(faces) > LISTED else "")
    return InputError(f"{path} has {what}: choose one by its name or number (there: {there})")
