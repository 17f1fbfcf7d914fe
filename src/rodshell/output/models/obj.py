"""Wavefront OBJ: the rods as polylines."""

from rodshell.output.archive import Archive
from rodshell.output.rods import rods_of


def obj_text(archive: Archive, state: str) -> str:
    """All nodes [m], then one object with one polyline for each rod."""
    lines = [
        f"# rodshell, {state}, metres",
        *(f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in archive.states[state]),
    ]
    for rod in rods_of(archive):
        if len(rod.nodes) > 1:
            lines += [f"o {' '.join(rod.id.split()) or 'rod'}", "l " + " ".join(map(str, rod.nodes + 1))]
    return "\n".join(lines) + "\n"
