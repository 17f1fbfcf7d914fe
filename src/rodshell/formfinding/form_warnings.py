"""Sentences on a grid as it lies on its target and on its pop-ups that a user should read before anything else."""

from math import degrees, pi, sqrt

import numpy as np

from rodshell.arrays import largest_at
from rodshell.formfinding.finite_sections import flat_warnings, section_rotation
from rodshell.formfinding.methods import Bound, Draped
from rodshell.formfinding.popup import PopUp
from rodshell.formfinding.trim import NEAREST_JOINT, Trimmed
from rodshell.rods.section import Rod
from rodshell.units import length_text
from rodshell.validation import Ends

STRETCHED = 0.01  # strain under the rods' weight above which a warning is given: rods are cut too short
ROLLED = pi / 4  # rad: a lath that rotates by more bends mostly about its other axis
LONG_TAIL = 3.0  # spacings past a rod's last joint
ON_THE_END, MOST_OFF = 2e-4, 1e-3  # of the size, and m: a support that is further from the target's end gives a warning


def grid_warnings(trimmed: Trimmed, rod: Rod) -> tuple[str, ...]:
    """Of a grid of these rods on its target."""
    draped = trimmed.draped
    tails = (*_off_the_end(trimmed), *_long_tails(trimmed)) if draped.converged else ()
    flat = flat_warnings(trimmed.positions, rod)
    return (*flat, *draped.warnings, *_in_pieces(trimmed), *_stretched(draped), *tails)


def _stretched(draped: Draped) -> tuple[str, ...]:
    """A warning where rods stretch under their weight; in weight over stiffness the section's area cancels out."""
    strain = draped.report.max_strain
    if isinstance(draped.method, Bound) or not draped.converged or strain <= STRETCHED:
        return ()
    return (
        f"on the target the rods stretch by {100 * strain:.2g} % under their own weight, so that they are cut too "
        'short: use a stiffer or lighter material (rod.material; a thicker section does not help), or method "bound"',
    )


def _off_the_end(trimmed: Trimmed) -> tuple[str, ...]:
    """A warning where supports of the net's rods lie off the target's end: edges are straight, rods are bent."""
    draped, points = trimmed.draped, trimmed.boundary.points
    if draped.eccentricity or not isinstance(draped.method, Bound):
        return ()
    off = np.abs(draped.target.margin(points))
    allowed, worst = min(ON_THE_END * draped.target.size, MOST_OFF), largest_at(off)
    if off[worst] <= allowed:
        return ()
    edge = length_text(0.9 * draped.layout.longest_edge * sqrt(allowed / off[worst]))  # the error is of second order
    rod, (x, y, z) = trimmed.mesh.grid.rods[worst // 2].name, points[worst]
    return (
        f"{np.count_nonzero(off > allowed)} supports are off the end of the target, by up to {length_text(off[worst])} "
        f"(of rod {rod} at ({x:.4g}, {y:.4g}, {z:.4g}) m), since the mesh's edges are long for its curvature: use a "
        f"layout.edge of {edge}",
    )


def _long_tails(trimmed: Trimmed) -> tuple[str, ...]:
    """A warning where rods run far past their last joint, since crossings there lie too near to an end."""
    grid = trimmed.mesh.grid
    ends = np.array([(rod.start, rod.end) for rod in grid.rods])
    first, last = ends[:, 1].copy(), ends[:, 0].copy()
    np.minimum.at(first, grid.crossings.rods, grid.crossings.at)
    np.maximum.at(last, grid.crossings.rods, grid.crossings.at)
    tails = np.maximum(first - ends[:, 0], ends[:, 1] - last)
    layout = trimmed.draped.layout
    spacing = layout.most_spacing
    long, worst = int(np.count_nonzero(tails > LONG_TAIL * spacing)), largest_at(tails)
    if not long:
        return ()
    left = len(grid.meetings()) - len(grid.crossings)
    others = f" ({long} rods do so by more than {LONG_TAIL:g} spacings)" if long > 1 else ""
    near = f"no joint is made within {NEAREST_JOINT:g} spacings of a rod's end, here at {left} crossings"
    why = f": {near}" if left else ""
    return (
        f"{grid.rods[worst].name} runs {length_text(tails[worst])} past its last joint{others}{why}; "
        f"{layout.elsewhere} may help, or leave such rods out (layout.left_out)",
    )


def _in_pieces(trimmed: Trimmed) -> tuple[str, ...]:
    """A warning where rods that are built do not run from rim to rim."""
    built, net = {rod.name for rod in trimmed.mesh.grid.rods}, trimmed.draped.net
    names = [] if net is None else [name for name, pieces in net.pieces.items() if not built.isdisjoint(pieces)]
    if not names:
        return ()
    are = "rods are" if len(names) > 1 else "rod is"
    return (
        f"{len(names)} {are} on the target in several pieces, each with its own ends: {', '.join(names)}; where they "
        "end at an opening, it needs a ring that carries their reactions; where they only cross the edge twice, "
        "another offset of the layout may help",
    )


def pop_up_warnings(popped: dict[Ends, PopUp]) -> tuple[str, ...]:
    """A warning where laths on edge lie down, as joints do not hold them, and then bend about their weak axes."""
    for ends, shell in popped.items():
        angles = section_rotation(shell.shell, shell.state) if shell.report.converged else None
        if angles is not None and np.count_nonzero(angles > ROLLED) > 0.5 * len(angles):
            return (
                f"most rods turn by more than {degrees(ROLLED):.0f} degrees about their own axes, up to "
                f"{degrees(angles.max()):.0f} ({ends} ends), and bend about their weak axes, since nothing holds them: "
                'bolted laths keep their orientation, with larger stresses; set joint.kind = "pin", or swap the '
                "width and the height of the section",
            )
    return ()
