"""Several simple gridshells joined at seams: a target is cut into patches, each is formed alone, and on the seams the
rod ends of both sides meet at common points [HQK 3.4, the outlook]."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from math import degrees

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError, RodshellError
from rodshell.formfinding.finite_sections import flat_warnings
from rodshell.formfinding.methods import Draped
from rodshell.formfinding.pipeline import Agreement, PatchForm, agreement, find_stages
from rodshell.formfinding.popup import ENDS, Ends, PopUp, pop_up
from rodshell.formfinding.seams import FEWEST, Meeting, PatchNet, lay_patches, patches_of, transported_heading
from rodshell.formfinding.search import HEADINGS
from rodshell.formfinding.trim import Boundary, Footprint, Trimmed, trim
from rodshell.joints import Ball, Joint, require_joint
from rodshell.layout import GridLayout
from rodshell.layout.mesh import SideBySide, side_by_side
from rodshell.progress import Progress, silent
from rodshell.rods.section import Rod
from rodshell.solve.equilibrium import Status
from rodshell.targets import Target
from rodshell.targets.patch import Patch, Seam
from rodshell.targets.patch_layout import PatchLayout
from rodshell.units import shown
from rodshell.validation import choices_of

MANY = 0.1  # of the rods: a larger share left out gives a warning
ASTRAY = 0.005  # of the size: rod ends that are moved further give a warning
GAP = 2.0  # spacings between the flat grids of neighbouring patches


@dataclass(frozen=True)
class PatchedForm:
    """A form in patches.

    Parameters
    ----------
    patch_nets, patches : of each patch by its name: its rods, and every stage of its form.
    popped : all patches as one shell, by end condition; missing where the drape of a patch did not converge.
    meetings : where rods of two patches end at one point.
    moved : of each patch the largest distance between a rod end of its mesh and that point, to which it was moved [m].
    """

    target: Target
    seams: tuple[Seam, ...]
    layout: GridLayout
    rod: Rod
    joint: Joint
    patch_layouts: Mapping[str, PatchLayout]
    patch_nets: dict[str, PatchNet]
    patches: dict[str, PatchForm]
    meetings: tuple[Meeting, ...]
    moved: dict[str, float]
    ends: tuple[Ends, ...]
    popped: dict[Ends, PopUp] = field(default_factory=dict)

    @property
    def status(self) -> str:
        """ "converged", or which patch stopped and what to do."""
        for name, form in self.patches.items():
            if form.status != "converged":
                return form.status if "(patch " in form.status else f"{form.status} (patch {name})"
        return "converged"

    @property
    def warnings(self) -> tuple[str, ...]:
        whole = set(self.target.warnings)  # said once; and a patch may be flat where the shell is not
        whole.update(*(flat_warnings(form.trimmed.positions, self.rod) for form in self.patches.values()))
        words = [
            f"patch {k}: {word}" for k, form in self.patches.items() for word in form.warnings if word not in whole
        ]
        words += [
            f"patch {k}: rod ends were moved by up to {by:.3g} m to the points where they meet others: its net does "
            "not reach these points well; try another heading or anchor"
            for k, by in self.moved.items()
            if by > ASTRAY * self.target.size
        ]
        share = left_out(self.patch_nets)
        if share > MANY:
            words.append(
                f"{100 * share:.0f} % of the rods are left out, because no rod of the next patch can meet them at a "
                "seam: another heading may leave out fewer (layout.rotate, or seams.patches for a single patch)"
            )
        return (*flat_warnings(self.draped, self.rod), *self.target.warnings, *words)

    @property
    def cut_along(self) -> tuple[Seam, ...]:
        """Where the target is cut: along creases that seams are drawn near to."""
        return next(iter(self.patch_nets.values())).patch.seams

    @cached_property
    def flat(self) -> SideBySide:
        """The flat grids of all patches in a row."""
        gap = GAP * max(max(net.layout.spacing) for net in self.patch_nets.values())
        return side_by_side({name: form.footprint.mesh for name, form in self.patches.items()}, gap)

    @property
    def footprint(self) -> Footprint:
        return Footprint(self.flat.mesh)

    @cached_property
    def draped(self) -> Floats:
        """(n, 3) all patches on the target [m]."""
        shapes = [form.boundary.draped for form in self.patches.values()]
        return np.concatenate([shape for shape in shapes if shape is not None])

    @cached_property
    def boundary(self) -> Boundary:
        """Of all patches, rod by rod."""
        return Boundary.of_grids([form.boundary for form in self.patches.values()])

    @property
    def agreement(self) -> dict[Ends, Agreement]:
        forms = list(self.patches.values())
        return {
            ends: merged_agreement([form.agreement[ends] for form in forms])
            for ends in forms[0].agreement
            if all(ends in form.agreement for form in forms)
        }

    @property
    def dropped(self) -> tuple[tuple[str, str], ...]:
        """Rods that are not built, with the reason."""
        return tuple(
            (f"{name}-{rod}", why)
            for name, form in self.patches.items()
            for rod, why in (*self.patch_nets[name].dropped, *form.trimmed.dropped)
        )


def find_patched_stages(
    target: Target,
    seams: Sequence[Seam],
    layout: GridLayout,
    rod: Rod,
    *,
    patch_layouts: Mapping[str, PatchLayout] | None = None,
    joint: Joint | None = None,
    ends: Ends | Sequence[Ends] = ENDS,
    warm_start: PatchedForm | None = None,
    same_drape: bool = False,
    progress: Progress = silent,
) -> PatchedForm:
    """Cut a target into patches, lay their rods such that they meet, and form each; see `rodshell.find_form`.

    Parameters
    ----------
    patch_layouts : settings of single patches, by name.
    warm_start, same_drape : as in `find_stages`; patches are matched by their names.
    """
    ends = choices_of("ends", ends, ENDS)
    require_joint(joint)
    patch_layouts, joint = dict(patch_layouts or {}), joint or Ball()
    earlier = warm_start.patches if warm_start is not None else {}
    if warm_start is not None and same_drape:
        patch_nets, meetings = warm_start.patch_nets, warm_start.meetings
    else:
        patch_nets, meetings = _lay(target, seams, layout, patch_layouts, joint.eccentricity, progress)
    found, moved = dict[str, PatchForm](), dict[str, float]()
    for name, patch in patch_nets.items():
        end_points = {(end.rod, end.side): at.point for at in meetings for end in at.ends if end.patch == name}

        def patch_progress(stage: str, detail: str, residual: float, name: str = name) -> None:
            if stage == "net":
                return  # the net is known and only marched again: no reason to discard what is finished
            progress(stage, f"patch {name}, {detail}", residual)

        found[name] = find_stages(
            patch.patch, patch.layout, rod,
            anchor=patch.anchor, joint=joint, ends=(), warm_start=earlier.get(name), same_drape=same_drape,
            name=name, cut=partial(cut_with_ends, end_points=end_points), progress=patch_progress,
        )  # fmt: skip
        moved[name] = _moved(found[name])
    laid = PatchedForm(
        target, tuple(seams), layout, rod, joint, patch_layouts, patch_nets, found, meetings, moved, ends
    )
    return _popped_up(laid, warm_start, same_drape, progress)


def _popped_up(form: PatchedForm, earlier: PatchedForm | None, same_drape: bool, progress: Progress) -> PatchedForm:
    """The form with its pop-ups: of all patches as one shell, or of those alone whose drape converged."""
    draped = {name: patch for name, patch in form.patches.items() if patch.draped.converged}
    found = {name: dict[Ends, PopUp]() for name in draped}
    popped = dict[Ends, PopUp]()
    before = {} if earlier is None else earlier.popped
    known = dict[Ends, PopUp]()
    if (
        same_drape
        and earlier is not None
        and all(patch.draped is earlier.patches[name].draped for name, patch in form.patches.items())
    ):
        known = {ends: shell for ends, shell in before.items() if shell.report.status is not Status.OUT_OF_TIME}
    for ends in form.ends:
        if earlier is not None and ends in known:
            popped[ends] = known[ends]
            for name, patch in earlier.patches.items():
                found[name][ends] = patch.popped[ends]
            continue
        if len(draped) < len(form.patches):
            for name, patch in draped.items():
                found[name][ends] = pop_up(
                    patch.footprint, patch.boundary, form.rod, ends=ends, joint=form.joint, progress=progress
                )
            continue
        popped[ends] = pop_up(
            form.footprint, form.boundary, form.rod,
            ends=ends, warm_start=before.get(ends), joint=form.joint, like=next(iter(popped.values()), None),
            progress=progress,
        )  # fmt: skip
        for k, (name, patch) in enumerate(draped.items()):
            found[name][ends] = _of_patch(popped[ends], k, patch)
        if popped[ends].report.status is Status.OUT_OF_TIME:
            break
    patches = {name: _compared(patch, form.ends, found.get(name, {})) for name, patch in form.patches.items()}
    return replace(form, patches=patches, popped=popped)


def _of_patch(popped: PopUp, k: int, patch: PatchForm) -> PopUp:
    """The shell of the k-th patch, of all that were popped up together, on the patch's own mesh."""
    footprint, found = patch.footprint, popped.alone[k]
    shell = replace(found.shell, mesh=footprint.mesh)
    return replace(found, footprint=footprint, boundary=patch.boundary, shell=shell)


def _compared(patch: PatchForm, ends: tuple[Ends, ...], popped: dict[Ends, PopUp]) -> PatchForm:
    """A patch with its shells, and how far they are from its target."""
    gaps = {
        end: patch.agreement.get(end) or agreement(shell, patch.target)
        for end, shell in popped.items()
        if shell.report.converged
    }
    return replace(patch, ends=ends, popped=popped, agreement=gaps)


def best_heading(
    target: Target,
    seams: Sequence[Seam],
    layout: GridLayout,
    patch_layouts: Mapping[str, PatchLayout],
    *,
    eccentricity: float = 0.0,
    progress: Progress = silent,
) -> float:
    """The heading at the target's summit [rad] that leaves out the smallest share of the rods; a few are tried.

    Raises
    ------
    RodshellError : every heading fails; the error is that of the first heading.
    """
    shares, reasons = dict[float, float](), list[RodshellError]()
    for heading in HEADINGS:
        progress("seams", f"trying {degrees(heading):.0f} deg", 0.0)
        try:
            patch_nets, _ = _lay(target, seams, replace(layout, rotate=heading), patch_layouts, eccentricity, silent)
            shares[heading] = left_out(patch_nets)
        except RodshellError as reason:
            reasons.append(reason)
    if not shares:
        raise reasons[0]
    return min(shares, key=lambda heading: round(shares[heading], 2))


def left_out(patch_nets: Mapping[str, PatchNet]) -> float:
    """The share of the rods that is left out because no rod of the next patch meets them at a seam."""
    missing = sum(len(net.layout.left_out) for net in patch_nets.values())
    return missing / (missing + sum(len(net.rods) for net in patch_nets.values()))


def _lay(
    target: Target,
    seams: Sequence[Seam],
    layout: GridLayout,
    patch_layouts: Mapping[str, PatchLayout],
    eccentricity: float,
    progress: Progress,
) -> tuple[dict[str, PatchNet], tuple[Meeting, ...]]:
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
    return lay_patches(patches, layouts, anchors, eccentricity=eccentricity, progress=progress)


def _layout_of(patch: Patch, layout: GridLayout, overrides: PatchLayout) -> GridLayout:
    spacing, rotate = overrides.spacing or layout.spacing, overrides.rotate
    if rotate is None:
        rotate = transported_heading(patch.whole, overrides.anchor or patch.middle, layout.rotate)
    return replace(layout, spacing=spacing, edge=min(layout.edge, *spacing), rotate=rotate)


def cut_with_ends(draped: Draped, end_points: Mapping[tuple[str, int], Floats]) -> Trimmed:
    """Trim a draped grid, and move the rod ends at seams to the points where they meet others.

    Parameters
    ----------
    draped : a grid on its patch.
    end_points : (3,) the point of each of these ends, by rod and side [m]; the ends of rods in layers are put above or
        below it.
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


def _moved(form: PatchForm) -> float:
    """Largest distance by which rod ends of a patch were moved from their draped positions [m]."""
    draped, mesh = trim(form.draped, fewest=FEWEST), form.trimmed.mesh
    return float(
        np.linalg.norm(draped.positions[mesh.ends] - form.trimmed.positions[mesh.ends], axis=2).max(initial=0.0)
    )


def merged_agreement(parts: Sequence[Agreement]) -> Agreement:
    """Of several patches; each counts by its nodes."""
    worst = max(parts, key=lambda part: part.max)
    count = np.array([len(part.gaps) for part in parts])
    square = np.array([part.rms for part in parts]) ** 2
    rms = float(np.sqrt(np.average(square, weights=count)))
    return replace(worst, gaps=np.concatenate([part.gaps for part in parts]), rms=rms)
