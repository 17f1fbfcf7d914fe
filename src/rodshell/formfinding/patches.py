"""Several simple gridshells joined at seams: a target is cut into patches, each is draped alone, and on the seams the
rod ends of both sides meet at common points [HQK 3.4, the outlook]. All patches pop up as one shell."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from math import degrees

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError, RodshellError
from rodshell.formfinding.methods import Draped
from rodshell.formfinding.pipeline import Stages, compared, find_stages, with_pop_ups
from rodshell.formfinding.popup import pop_up
from rodshell.formfinding.seams import FEWEST, Seams, lay_patches, patches_of, transported_heading
from rodshell.formfinding.search import HEADINGS
from rodshell.formfinding.trim import Boundary, Footprint, Trimmed, trim
from rodshell.joints import Ball, Joint, require_joint
from rodshell.layout import GridLayout, Layout
from rodshell.layout.gridlayout import require_chebyshev
from rodshell.layout.mesh import side_by_side
from rodshell.progress import Progress, silent
from rodshell.rods.section import Rod
from rodshell.rods.supports import BOTH, SUPPORTS, Asked, supports_of
from rodshell.targets import Target
from rodshell.targets.patch import Patch, Seam
from rodshell.targets.patch_layout import PatchLayout
from rodshell.units import shown
from rodshell.validation import Ends, either

GAP = 2.0  # spacings between the flat grids of neighbouring patches


def find_patched_stages(
    target: Target,
    seams: Sequence[Seam],
    layout: Layout,
    rod: Rod,
    *,
    patch_layouts: Mapping[str, PatchLayout] | None = None,
    joint: Joint | None = None,
    ends: Asked = BOTH,
    warm_start: Stages | None = None,
    same_drape: bool = False,
    progress: Progress = silent,
) -> Stages:
    """Cut a target into patches, lay their rods such that they meet, drape each, and pop up all as one shell; see
    `rodshell.find_form`.

    Args:
        patch_layouts: settings of single patches, by name.
        warm_start, same_drape: as in `find_stages`; patches are matched by their names.
    """
    layout, supports = require_chebyshev(layout, "seams"), supports_of(ends)
    names = tuple(support.name for support in supports)
    if others := set(names) - set(SUPPORTS):
        raise InputError(f"patches stand on {either([*SUPPORTS])} supports, not on {others.pop()}: leave out the seams")
    require_joint(joint)
    joint = joint or Ball()
    earlier = {} if warm_start is None else warm_start.patches
    if warm_start is not None and warm_start.seams is not None and same_drape:
        joined = warm_start.seams
    else:
        joined = _lay(target, seams, layout, dict(patch_layouts or {}), joint.eccentricity, progress)
    found, moved = dict[str, Stages](), dict[str, float]()
    for name, net in joined.nets.items():

        def patch_progress(stage: str, detail: str, residual: float, name: str = name) -> None:
            if stage == "net":
                return  # the net is known and only marched again: no reason to discard what is finished
            progress(stage, f"patch {name}, {detail}", residual)

        lying = find_stages(
            net.patch, net.layout, rod,
            anchor=net.anchor, joint=joint, ends=(), warm_start=earlier.get(name), same_drape=same_drape,
            name=name, cut=partial(cut_with_ends, end_points=joined.ends_of(name)), progress=patch_progress,
        )  # fmt: skip
        found[name], moved[name] = replace(lying, ends=names), _moved(lying)
    return with_pop_ups(side_by_side_stages(found, replace(joined, moved=moved)), supports, warm_start, progress)


def best_heading(
    target: Target,
    seams: Sequence[Seam],
    layout: Layout,
    patch_layouts: Mapping[str, PatchLayout],
    *,
    eccentricity: float = 0.0,
    progress: Progress = silent,
) -> float:
    """The heading at the target's summit [rad] that leaves out the smallest share of the rods; a few are tried.

    Raises:
        RodshellError: every heading fails; the error is that of the first heading.
    """
    layout, shares, reasons = require_chebyshev(layout, "seams"), dict[float, float](), list[RodshellError]()
    for heading in HEADINGS:
        progress("seams", f"trying {degrees(heading):.0f} deg", 0.0)
        try:
            joined = _lay(target, seams, replace(layout, rotate=heading), patch_layouts, eccentricity, silent)
            shares[heading] = joined.left_out
        except RodshellError as reason:
            reasons.append(reason)
    if not shares:
        raise reasons[0]
    return min(shares, key=lambda heading: round(shares[heading], 2))


def _lay(
    target: Target,
    seams: Sequence[Seam],
    layout: GridLayout,
    patch_layouts: Mapping[str, PatchLayout],
    eccentricity: float,
    progress: Progress,
) -> Seams:
    if layout.rods != "auto" or layout.length != "auto":
        raise InputError('a target cut by seams counts its rods itself: leave layout rods and length at "auto"')
    progress("seams", "cutting", 0.0)
    patches = patches_of(target, tuple(seams))
    for name in patch_layouts:
        if name not in patches:
            raise InputError(f"there is no patch {shown(name)}: the seams make the patches {', '.join(patches)}")
    layouts = {
        name: _layout_of(patch, layout, patch_layouts.get(name, PatchLayout())) for name, patch in patches.items()
    }
    anchors = {name: patch_layouts[name].anchor if name in patch_layouts else None for name in patches}
    laid = lay_patches(patches, layouts, anchors, eccentricity=eccentricity, progress=progress)
    return Seams(target, layout, *laid)


def _layout_of(patch: Patch, layout: GridLayout, overrides: PatchLayout) -> GridLayout:
    spacing, rotate = overrides.spacing or layout.spacing, overrides.rotate
    if rotate is None:
        rotate = transported_heading(patch.whole, overrides.anchor or patch.middle, layout.rotate)
    return replace(layout, spacing=spacing, edge=min(layout.edge, *spacing), rotate=rotate)


def cut_with_ends(draped: Draped, end_points: Mapping[tuple[str, int], Floats]) -> Trimmed:
    """Trim a draped grid, and move the rod ends at seams to the points where they meet others.

    Args:
        draped: a grid on its patch.
        end_points: (3,) the point of each of these ends, by rod and side [m]; the ends of rods in layers are put above
            or below it.
    """
    trimmed = trim(draped, fewest=FEWEST)
    mesh, positions = trimmed.mesh, trimmed.positions.copy()
    for k, rod in enumerate(mesh.grid.rods):
        for side in (0, 1):
            if (rod.name, side) in end_points:
                node, point = mesh.ends[k, side], end_points[rod.name, side]
                lift = mesh.heights[node] * draped.target.on_surface(point[None]).normal[0] if mesh.layered else 0.0
                positions[node] = point + lift
    boundary = replace(trimmed.boundary, points=positions[mesh.ends.ravel()], draped=positions)
    return replace(trimmed, positions=positions, boundary=boundary)


def _moved(form: Stages) -> float:
    """Largest distance by which rod ends of a patch were moved from their draped positions [m]."""
    draped, mesh = trim(form.draped, fewest=FEWEST), form.trimmed.mesh
    return float(
        np.linalg.norm(draped.positions[mesh.ends] - form.trimmed.positions[mesh.ends], axis=2).max(initial=0.0)
    )


def joined_again(patches: dict[str, Stages], seams: Seams, ends: Ends) -> Stages:
    """Patches that were popped up with one end condition, each alone, as one form: its shell begins where they are."""
    joined = side_by_side_stages(patches, seams)
    there = np.concatenate([patch.popped[ends].positions for patch in patches.values()])
    start = replace(joined.boundary, draped=there)
    popped = pop_up(joined.footprint, start, joined.rod, ends=ends, joint=joined.joint)
    return compared(replace(joined, popped={ends: replace(popped, boundary=joined.boundary)}))


def side_by_side_stages(patches: dict[str, Stages], seams: Seams) -> Stages:
    """Patches as one form, before they are popped up."""
    first = next(iter(patches.values()))
    meshes = {name: patch.footprint.mesh for name, patch in patches.items()}
    gap = GAP * max(max(net.layout.spacing) for net in seams.nets.values())
    dropped = tuple(
        (f"{name}-{rod}", why)
        for name, patch in patches.items()
        for rod, why in (*seams.nets[name].dropped, *patch.dropped)
    )
    return Stages(
        "", first.rod, first.joint, first.ends, Footprint(side_by_side(meshes, gap)),
        Boundary.of_grids([patch.boundary for patch in patches.values()]), dropped, patches=patches, seams=seams,
    )  # fmt: skip
