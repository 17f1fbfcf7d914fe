"""A file format of one's own: rods as polylines of a PLY file, each node with its stress as a colour.

Written with the package's own files: all of them are made, or none.
"""

import tempfile
from pathlib import Path

import numpy as np

import rodshell as rs


def ply(archive: rs.Archive, ends: str) -> str:
    """The popped-up rods; from blue without stress to red where it is largest."""
    states = archive.states
    points, start = states[f"popped_{ends}"][states["rod_nodes"]], states["rod_start"]
    red = 255 * states[f"stress_{ends}"] / states[f"stress_{ends}"].max()
    edges = [(k, k + 1) for k in range(len(points) - 1) if k + 1 not in start]
    columns = [f"property float {axis}" for axis in "xyz"] + [f"property uchar {c}" for c in ("red", "green", "blue")]
    head = ["ply", "format ascii 1.0", f"element vertex {len(points)}", *columns]
    head += [f"element edge {len(edges)}", "property int vertex1", "property int vertex2", "end_header"]
    nodes = ["{:.6f} {:.6f} {:.6f} {:.0f} 0 {:.0f}".format(*node) for node in np.column_stack([points, red, 255 - red])]
    return "\n".join([*head, *nodes, *(f"{a} {b}" for a, b in edges), ""])


rod = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=25e9, density=1900))
layout = rs.GridLayout.orthogonal(rods=(9, 9), spacing=0.045, length="auto", edge=0.015)
form = rs.find_form(rs.Hemisphere(radius=0.2), layout, rod, ends="pinned")
with tempfile.TemporaryDirectory() as folder:
    out = rs.save(
        form.archive(), Path(folder) / "dome", "csv", more={"model/stress.ply": ply(form.archive(), "pinned")}
    )
    lines = (out / "model" / "stress.ply").read_text().splitlines()
    assert "model/stress.ply" in (out / "manifest.json").read_text()
count = len(form.footprint.mesh.rod_nodes)
print(f"{count} nodes and {count - len(form.footprint.rods)} edges written")
read = np.array([line.split() for line in lines[lines.index("end_header") + 1 :][:count]], dtype=float)
assert np.allclose(read[:, :3], form.popped["pinned"].positions[form.footprint.mesh.rod_nodes], atol=1e-6)
