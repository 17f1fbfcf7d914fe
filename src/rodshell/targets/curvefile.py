"""Closed curves in files: polylines of an OBJ or DXF, which bound a shell or open it."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.targets.meshfile import cause, file_bytes, recoded

CURVE_FILES = (".obj", ".dxf")
SAG = 1e-4  # of a curve's extent: how finely arcs and splines of a DXF are divided
TOUCH = 1e-6  # of the extent: ends this close are one


def read_curves(path: Path, unit: float) -> list[Floats]:
    """Closed polylines (n, 3) [m], the longest first: the edge of the shell, then its openings.

    Raises
    ------
    InputError : no such file, damaged, or without a closed curve.
    """
    loops = closed_loops(_strokes(path, unit))
    if not loops or not all(np.isfinite(loop).all() for loop in loops):
        raise InputError(f"{path} holds no closed curve of finite coordinates: draw one polyline around the shell")
    return loops


def read_lines(path: Path, unit: float) -> list[Floats]:
    """Polylines (n, 3) [m], open or closed, those that touch end to end joined.

    Raises
    ------
    InputError : no such file, damaged, or without a line.
    """
    lines = joined(_strokes(path, unit))
    if not lines or not all(np.isfinite(line).all() for line in lines):
        raise InputError(f"{path} holds no line of finite coordinates: draw a polyline along each seam")
    return lines


def _strokes(path: Path, unit: float) -> list[Floats]:
    """Polylines (n, 3) [m] as they stand in a file."""
    data = file_bytes(path)
    if path.suffix.lower() not in CURVE_FILES:
        raise InputError(f"{path}: curves are read from {' or '.join(CURVE_FILES)}")
    try:
        strokes = _of_dxf(path) if path.suffix.lower() == ".dxf" else _of_obj(data)
    except Exception as reason:  # a damaged file can break a reader anywhere
        raise InputError(
            f"{path} cannot be read as a drawing of curves: it is damaged or of another format; export it anew "
            f"(the reader says: {cause(reason)})"
        ) from None
    return [np.asarray(stroke, dtype=float) * unit for stroke in strokes if len(stroke) > 1]


def _of_obj(data: bytes) -> list[Floats]:
    """The `l` elements of an OBJ."""
    points, lines = list[list[float]](), list[list[int]]()
    for words in map(str.split, recoded(data).decode("utf-8").splitlines()):
        if words[:1] == ["v"]:
            points.append([float(word) for word in words[1:4]])
        elif words[:1] == ["l"]:
            lines.append([int(word.split("/")[0]) for word in words[1:]])
    x = np.array(points)
    return [x[[k - 1 if k > 0 else k for k in line]] for line in lines]


def _of_dxf(path: Path) -> list[Floats]:
    import ezdxf
    from ezdxf import path as curves

    space = ezdxf.readfile(path).modelspace()
    kinds = "LINE LWPOLYLINE POLYLINE ARC CIRCLE ELLIPSE SPLINE"
    found = [curves.make_path(entity) for entity in space.query(kinds)]
    strokes = list[Floats]()
    for curve in found:
        rough = np.array([tuple(p) for p in curve.flattening(1e9)])
        sag = SAG * max(float(np.ptp(rough, axis=0).max()), 1e-12)
        strokes.append(np.array([tuple(p) for p in curve.flattening(sag)]))
    return strokes


def closed_loops(strokes: Iterable[Floats]) -> list[Floats]:
    """Strokes (n, 3) joined end to end into closed loops, the longest first; what stays open is left out."""
    loops = [line[:-1] for line in joined(strokes) if len(line) > 3 and np.array_equal(line[0], line[-1])]
    return sorted(loops, key=lambda x: -float(np.linalg.norm(np.roll(x, -1, axis=0) - x, axis=1).sum()))


def joined(strokes: Iterable[Floats]) -> list[Floats]:
    """Strokes (n, 3) joined end to end; of what closes, the last point is the first again."""
    left = list(strokes)
    if not left:
        return []
    tiny = TOUCH * float(np.ptp(np.vstack(left), axis=0).max())
    lines = list[Floats]()
    while left:
        chain, turned = left.pop(), 0
        while np.linalg.norm(chain[-1] - chain[0]) > tiny:
            near = [(k, flip) for k, s in enumerate(left) for flip in (False, True)
                    if np.linalg.norm((s[-1] if flip else s[0]) - chain[-1]) <= tiny]  # fmt: skip
            if near:
                k, flip = near[0]
                stroke = left.pop(k)
                chain = np.vstack([chain, (stroke[::-1] if flip else stroke)[1:]])
            elif turned:
                break
            else:
                chain, turned = chain[::-1], 1
        lines.append(np.vstack([chain[:-1], chain[:1]]) if np.linalg.norm(chain[-1] - chain[0]) <= tiny else chain)
    return lines
