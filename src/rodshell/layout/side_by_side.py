"""Several meshed grids as one, laid out side by side."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from rodshell.arrays import Floats
from rodshell.layout.flatgrid import Crossings, FlatGrid, FlatRod
from rodshell.layout.mesh import GridMesh


@dataclass(frozen=True, eq=False)
class SideBySide:
    """Grids in a row along x, each moved but not rotated.

    Parameters
    ----------
    mesh : all grids: rods, nodes and joints, one grid after the other; rod U01 of grid A is A-U01.
    shifts : for each grid the displacement (2,) [m].
    """

    mesh: GridMesh
    shifts: dict[str, Floats]


def side_by_side(meshes: Mapping[str, GridMesh], gap: float) -> SideBySide:
    """Lay grids out in a row, each centred on the x axis, and the row on the origin.

    Parameters
    ----------
    meshes : the grids by name.
    gap : between two grids [m].
    """
    low = {name: mesh.flat[:, :2].min(axis=0) for name, mesh in meshes.items()}
    high = {name: mesh.flat[:, :2].max(axis=0) for name, mesh in meshes.items()}
    width = sum(float(high[name][0] - low[name][0]) + gap for name in meshes) - gap
    left, shifts = -0.5 * width, dict[str, Floats]()
    for name in meshes:
        shifts[name] = np.array([left - low[name][0], -0.5 * (low[name][1] + high[name][1])])
        left += float(high[name][0] - low[name][0]) + gap
    moved = [_moved(name, mesh, shifts[name]) for name, mesh in meshes.items()]
    return SideBySide(_merged(moved), shifts)


def _moved(name: str, mesh: GridMesh, shift: Floats) -> GridMesh:
    """A mesh displaced in the plane, with `name` before the names of its rods."""
    along = np.array([_along(rod, shift) for rod in mesh.grid.rods])
    rods = tuple(_moved_rod(name, rod, shift) for rod in mesh.grid.rods)
    crossings = Crossings(mesh.grid.crossings.rods, mesh.grid.crossings.at + along[mesh.grid.crossings.rods])
    lengths = np.diff(np.append(mesh.rod_start, len(mesh.rod_nodes)))
    return replace(
        mesh,
        grid=FlatGrid(rods, crossings),
        flat=mesh.flat + np.append(shift, 0.0),
        stations=mesh.stations + np.repeat(along, lengths),
    )


def _along(rod: FlatRod, shift: Floats) -> float:
    """Change of a rod's material coordinates: those of families u and v are measured from the middle of the layout."""
    return 0.0 if rod.family == "free" else float(shift @ np.array(rod.direction))


def _moved_rod(name: str, rod: FlatRod, shift: Floats) -> FlatRod:
    label, by = f"{name}-{rod.name}", _along(rod, shift)
    if rod.family == "free":
        x, y = np.array(rod.origin) + shift
        return replace(rod, name=label, origin=(float(x), float(y)))
    make, across = (FlatRod.u, shift[1]) if rod.family == "u" else (FlatRod.v, shift[0])
    return make(label, rod.offset + float(across), rod.start + by, rod.end + by)


def _merged(meshes: list[GridMesh]) -> GridMesh:
    """One mesh of several that have nothing in common."""
    rods = np.cumsum([0, *(len(mesh.grid.rods) for mesh in meshes)])
    nodes = np.cumsum([0, *(mesh.node_count for mesh in meshes)])
    entries = np.cumsum([0, *(len(mesh.rod_nodes) for mesh in meshes)])
    crossings = Crossings(
        np.concatenate([mesh.grid.crossings.rods + by for mesh, by in zip(meshes, rods, strict=False)]),
        np.concatenate([mesh.grid.crossings.at for mesh in meshes]),
    )
    return GridMesh(
        FlatGrid(tuple(rod for mesh in meshes for rod in mesh.grid.rods), crossings),
        np.concatenate([mesh.flat for mesh in meshes]),
        np.concatenate([mesh.rod_nodes + by for mesh, by in zip(meshes, nodes, strict=False)]),
        np.concatenate([mesh.rod_start + by for mesh, by in zip(meshes, entries, strict=False)]),
        np.concatenate([mesh.stations for mesh in meshes]),
        np.concatenate([mesh.joint_nodes + by for mesh, by in zip(meshes, nodes, strict=False)]),
        np.concatenate([mesh.joint_pairs[:, 1] + by for mesh, by in zip(meshes, nodes, strict=False)])
        if any(mesh.layered for mesh in meshes)
        else None,
    )
