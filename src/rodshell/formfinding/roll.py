"""How far laths turn about their own axes: what lies flat on the target need not do so when it is let go."""

import numpy as np

from rodshell.arrays import Floats
from rodshell.formfinding.draped import node_normals
from rodshell.formfinding.popup import PopUp
from rodshell.geometry.vectors import dot, unit
from rodshell.rods.bend_twist import BendTwist


def roll(popped: PopUp) -> Floats | None:
    """(b,) angle [rad] of each bend of the mesh, from 0 to pi/2, between a rod's first material director and the
    shell's normal, both seen along the rod; None where rods have no directors, because they bend alike all ways."""
    shell, mesh = popped.shell, popped.shell.mesh
    frames = next((one for one in shell.within if isinstance(one, BendTwist)), None)
    if frames is None or not shell.angles:
        return None
    bends = slice(len(mesh.bends))
    tangents, m1 = frames.source_tangents[bends, 0], frames.material_directors(popped.state)[bends, 0]
    normals = node_normals(mesh, popped.positions)[mesh.bends[:, 1]]
    seen = unit(normals - dot(normals, tangents)[:, None] * tangents)
    return np.asarray(np.arccos(np.clip(np.abs(dot(m1, seen)), 0.0, 1.0)))
