"""The main job: drape, trim, map back, pop up, compare; and the pop-up of a table of rods on its own.

The last stage is the agreement: how far the popped-up shell is from the target, and where.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from math import sqrt

import numpy as np

from rodshell.arrays import Floats, largest_at
from rodshell.errors import InputError
from rodshell.formfinding.drape import drape
from rodshell.formfinding.finite_sections import flat_warnings
from rodshell.formfinding.form_warnings import grid_warnings, pop_up_warnings
from rodshell.formfinding.methods import Bound, Draped, FlatState, Method
from rodshell.formfinding.popup import PopUp, pop_up
from rodshell.formfinding.seams import Seams
from rodshell.formfinding.trim import (
    FEWEST_JOINTS,
    NEAREST_JOINT,
    Boundary,
    Footprint,
    Trimmed,
    map_back,
    trim,
    untrimmed,
)
from rodshell.geometry.curves import on_curve
from rodshell.joints import Ball, Joint, require_joint
from rodshell.layout import FlatGrid, GridMesh, Layout, mesh_grid
from rodshell.layout.flatgrid import TOGETHER
from rodshell.layout.lattices import EDGES_A_SPAN
from rodshell.progress import Progress, silent
from rodshell.rods.section import Rod
from rodshell.rods.supports import BOTH, PINNED, Asked, Support, supports_of
from rodshell.solve.equilibrium import Status
from rodshell.targets import Target
from rodshell.units import length_text, percent_text
from rodshell.validation import Ends, instance


@dataclass(frozen=True, eq=False)
class Agreement:
    """Distance between rods and target, over nodes and the middles of edges; of rods in layers from their own layer.

    Args:
        gaps: (n,) signed distance of each node, positive outside [m].
        max, rms: of all nodes and edge middles [m].
        where: the point of the rods with the largest distance [m].
        size: the target's size, by which the relative figures are divided [m].
    """

    gaps: Floats
    max: float
    rms: float
    where: tuple[float, float, float]
    size: float

    @staticmethod
    def of_all(parts: "Sequence[Agreement]") -> "Agreement":
        """Of several patches; each counts by its nodes."""
        worst = max(parts, key=lambda part: part.max)
        count = np.array([len(part.gaps) for part in parts])
        square = np.array([part.rms for part in parts]) ** 2
        rms = float(np.sqrt(np.average(square, weights=count)))
        return replace(worst, gaps=np.concatenate([part.gaps for part in parts]), rms=rms)

    @property
    def max_relative(self) -> float:
        return self.max / self.size

    @property
    def rms_relative(self) -> float:
        return self.rms / self.size

    def __repr__(self) -> str:
        return f"<Agreement: {self}>"

    def __str__(self) -> str:
        x, y, z = (1e3 * value for value in self.where)
        return (
            f"gap to the target: max {1e3 * self.max:.3f} mm ({100 * self.max_relative:.3f} % of its size) at "
            f"({x:.1f}, {y:.1f}, {z:.1f}) mm, rms {1e3 * self.rms:.3f} mm ({100 * self.rms_relative:.3f} %)"
        )


def agreement(popped: PopUp, target: Target) -> Agreement:
    """Distance of the popped-up rods to the target, continued smoothly past its end."""
    instance("popped", popped, PopUp, "what rodshell.pop_up returned")
    instance("target", target, Target)
    nodes, mesh = popped.positions, popped.footprint.mesh
    points = np.concatenate([nodes, _edge_middles(mesh, nodes)])
    gaps = target.distance(points) - np.concatenate([mesh.heights, mesh.heights[mesh.edges[:, 0]]])
    k = largest_at(np.abs(gaps))
    x, y, z = points[k].tolist()
    return Agreement(gaps[: len(nodes)], abs(float(gaps[k])), sqrt((gaps * gaps).mean()), (x, y, z), target.size)


def _edge_middles(mesh: GridMesh, positions: Floats) -> Floats:
    """(e, 3) points of the rods halfway along each edge, on the cubic through the nearest nodes of the rod."""
    middles = list[Floats]()
    for k in range(len(mesh.rod_start)):
        s = mesh.stations[mesh.rod_slice(k)]
        middles.append(on_curve(s, positions[mesh.nodes_of(k)], 0.5 * (s[:-1] + s[1:])))
    return np.concatenate(middles)


@dataclass(frozen=True)
class Stages:
    """Every stage of one shell: of one grid, of several that are joined at seams, or of a table of rods.

    Args:
        name: of a patch of a form; else "".
        rod, joint, ends: as they were given; `ends` are the requested end conditions.
        footprint: the flat grids, ready to be cut; of several patches in a row.
        boundary: where the rod ends go.
        dropped: rods that are not built, with the reason.
        lying: the draped grid, cut to its target; None for a table of rods, and for several patches.
        popped, agreement: by end condition; missing where an earlier stage did not converge.
        patches: the stages of each patch by its name, its shells being parts of the whole; none of a single grid.
        seams: how the patches are joined; None for a single grid.
    """

    name: str
    rod: Rod
    joint: Joint
    ends: tuple[Ends, ...]
    footprint: Footprint
    boundary: Boundary
    dropped: tuple[tuple[str, str], ...]
    lying: Trimmed | None = None
    popped: dict[Ends, PopUp] = field(default_factory=dict)
    agreement: dict[Ends, Agreement] = field(default_factory=dict)
    patches: dict[str, "Stages"] = field(default_factory=dict)
    seams: Seams | None = None

    @property
    def parts(self) -> "tuple[Stages, ...]":
        """The stages of each grid: of all patches, or of the only one."""
        return tuple(self.patches.values()) or (self,)

    @property
    def from_table(self) -> bool:
        """Whether the form is that of a table of rods, which has no target."""
        return self.lying is None and self.seams is None

    @property
    def trimmed(self) -> Trimmed:
        """The draped grid cut to its target.

        Raises:
            InputError: this is a table of rods, or there are several patches.
        """
        if self.patches:
            raise InputError(f"this form has {len(self.patches)} patches: take patches[k].draped or .trimmed")
        if self.lying is None:
            raise InputError("a table of rods has no target, and so it was never draped on one")
        return self.lying

    @property
    def on_target(self) -> Floats:
        """(n, 3) nodes of all grids as they were draped and trimmed [m]; a table of rods raises as `trimmed` does."""
        return np.concatenate([part.trimmed.positions for part in self.parts])

    @property
    def draped(self) -> Draped:
        """The grid on its target; raises as `trimmed` does."""
        return self.trimmed.draped

    @property
    def target(self) -> Target:
        """The target, which for a patch ends at its seams; a table of rods raises as `trimmed` does."""
        return self.seams.target if self.seams else self.draped.target

    @property
    def layout(self) -> Layout:
        """The layout of the flat grid; a table of rods raises as `trimmed` does."""
        return self.seams.layout if self.seams else self.draped.layout

    @property
    def drape_out_of_time(self) -> bool:
        """Whether a time limit stopped the drape."""
        return self.lying is not None and self.draped.report.status is Status.OUT_OF_TIME

    @property
    def flat_state(self) -> FlatState | None:
        """Where the rods lie in the plane, where they follow curves of the target."""
        return None if self.lying is None else self.draped.flat_state

    def lies_as(self, other: "Stages") -> bool:
        """Whether all grids are the same and lie on the same targets; a table of rods lies on none."""
        if self.from_table or other.from_table:
            return self is other
        if list(self.patches) != list(other.patches):
            return False
        return all(part.draped is there.draped for part, there in zip(self.parts, other.parts, strict=True))

    def finished_pop_ups(self, supports: Sequence[Support]) -> dict[Ends, PopUp]:
        """The pop-ups on these supports that were not stopped by a time limit."""
        return {
            ends: shell
            for ends, shell in self.popped.items()
            if shell.support in supports and shell.report.status is not Status.OUT_OF_TIME
        }

    @property
    def status(self) -> str:
        """ "converged", or which stage stopped, of which patch, and what to do."""
        for name, patch in self.patches.items():
            if patch.status != "converged":
                return patch.status if "(patch " in patch.status else f"{patch.status} (patch {name})"
        if self.lying is not None and self.draped.report.reason:
            return self.draped.report.reason
        if self.lying is not None and not self.draped.converged:
            sentence = self.draped.report.status.sentence_on(self.layout)
            weighed = not isinstance(self.draped.method, Bound) and "bound" not in sentence
            other = ', or use method = "bound", which needs no weight' if weighed else ""
            return f"drape {sentence}{other}"
        for ends, shell in self.popped.items():
            if not shell.report.converged:
                return shell.report.reason or f"pop-up ({ends}) {self._lost(shell)}"
        return "converged"

    def _lost(self, shell: PopUp) -> str:
        """How a pop-up ended that did not converge, and what to do. A table of rods has neither spacing nor target."""
        if not self.from_table:
            return shell.report.status.sentence_on(self.layout)
        return (
            f"could be followed from flat only up to {percent_text(shell.followed)} of the way of the rods' ends; rods "
            "of another section may be followed further (rod.section), and rodshell form starts from a target instead"
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences that a user should read before anything else."""
        if self.seams is not None:
            return self._warnings_of_patches(self.seams)
        of_grid = () if self.lying is None else grid_warnings(self.lying, self.rod)
        return (*of_grid, *pop_up_warnings(self.popped))

    def _warnings_of_patches(self, seams: Seams) -> tuple[str, ...]:
        whole = set(seams.target.warnings)  # said once; and a patch may be flat where the shell is not
        whole.update(*(flat_warnings(patch.trimmed.positions, self.rod) for patch in self.parts))
        each = [
            f"patch {name}: {word}"
            for name, patch in self.patches.items()
            for word in patch.warnings
            if word not in whole
        ]
        return (*flat_warnings(self.on_target, self.rod), *seams.target.warnings, *each, *seams.warnings)


def find_stages(
    target: Target,
    layout: Layout,
    rod: Rod,
    *,
    method: Method = Bound(),
    anchor: tuple[float, float] | None = None,
    joint: Joint | None = None,
    ends: Asked = BOTH,
    name: str = "",
    warm_start: Stages | None = None,
    same_drape: bool = False,
    cut: Callable[[Draped], Trimmed] = trim,
    progress: Progress = silent,
) -> Stages:
    """Drape, trim, map back, pop up and compare; see `rodshell.find_form`.

    Args:
        warm_start: stages found before, from whose net and shells the new ones start.
        same_drape: whether nothing that the drape depends on has changed since: then drape and footprint of
            `warm_start` are taken over, and so are its pop-ups with the same ends, except those that a time limit
            stopped.
        cut: how the draped shell is trimmed.
    """
    supports = supports_of(ends)
    require_joint(joint)
    joint = joint or Ball()
    if warm_start is not None and same_drape and not warm_start.drape_out_of_time:
        trimmed, footprint = warm_start.trimmed, warm_start.footprint
    else:
        draped = drape(
            layout, rod, target,
            method=method, anchor=anchor, joint=joint,
            warm_start=warm_start.draped if warm_start else None, progress=progress,
        )  # fmt: skip
        trimmed = cut(draped) if draped.converged or isinstance(draped.method, Bound) else untrimmed(draped)
        footprint = map_back(trimmed)
    names = tuple(support.name for support in supports)
    lying = Stages(name, rod, joint, names, footprint, trimmed.boundary, trimmed.dropped, trimmed)
    return with_pop_ups(lying, supports, warm_start, progress)


def with_pop_ups(stages: Stages, supports: Sequence[Support], earlier: Stages | None, progress: Progress) -> Stages:
    """Draped grids popped up as one shell on each of their supports, and compared.

    Where the drape of a patch did not converge the others are popped up alone.

    Args:
        earlier: whose finished pop-ups are taken over where the grids lie as before, and are first guesses elsewhere.
    """
    if not all(part.draped.converged for part in stages.parts):
        each = {name: with_pop_ups(patch, supports, None, progress) for name, patch in stages.patches.items()}
        return replace(stages, patches=each)
    known = earlier.finished_pop_ups(supports) if earlier is not None and stages.lies_as(earlier) else {}
    before, popped = {} if earlier is None else earlier.popped, dict(known)
    for support in supports:
        end = support.name
        if end in popped:
            continue
        popped[end] = pop_up(
            stages.footprint, stages.boundary, stages.rod,
            ends=support, warm_start=before.get(end), joint=stages.joint, like=next(iter(popped.values()), None),
            progress=progress,
        )  # fmt: skip
        if popped[end].report.status is Status.OUT_OF_TIME:
            break
    return compared(replace(stages, popped={end: popped[end] for end in stages.ends if end in popped}), earlier)


def compared(stages: Stages, earlier: Stages | None = None) -> Stages:
    """Stages with the shells of their patches, and with the gaps of all that converged; those of earlier shells are
    taken over."""
    shells, patches, gaps = stages.popped, dict[str, Stages](), dict[Ends, Agreement]()
    for k, (name, patch) in enumerate(stages.patches.items()):
        of_patch = {end: _of_patch(shell, k, patch) for end, shell in shells.items()}
        patches[name] = compared(replace(patch, popped=of_patch))
    for end in [end for end, shell in shells.items() if shell.report.converged]:
        if patches:
            gaps[end] = Agreement.of_all([patch.agreement[end] for patch in patches.values()])
        elif earlier is not None and earlier.popped.get(end) is shells[end]:
            gaps[end] = earlier.agreement[end]
        else:
            gaps[end] = agreement(shells[end], stages.target)
    return replace(stages, patches=patches, agreement=gaps)


def _of_patch(popped: PopUp, k: int, patch: Stages) -> PopUp:
    """The shell of the k-th patch, of all that were popped up together, on the patch's own mesh."""
    shell = replace(popped.alone[k].shell, mesh=patch.footprint.mesh)
    return replace(popped.alone[k], footprint=patch.footprint, boundary=patch.boundary, shell=shell)


def popped_again(
    form: Stages, footprint: Footprint, boundary: Boundary, ends: Ends, *, progress: Progress = silent
) -> Stages:
    """The form of another flat grid on the same target: popped up and compared.

    Args:
        form: whose target, rods and joints are kept.
        footprint, boundary: the other grid, and where its rod ends go.
        ends: the only end condition of the other form.
    """
    support = form.popped[ends].support if ends in form.popped else ends
    popped = pop_up(footprint, boundary, form.rod, ends=support, joint=form.joint, progress=progress)
    compared = {ends: agreement(popped, form.target)} if popped.report.converged else {}
    return replace(
        form, ends=(ends,), footprint=footprint, boundary=boundary, popped={ends: popped}, agreement=compared
    )


def meshed_again(form: Stages, ends: Ends) -> Stages:
    """The same rods on a new mesh with the same longest edge, popped up from the shape that they had.

    Args:
        form: of a target, with a pop-up.
    """
    old, positions, boundary = form.footprint.mesh, form.popped[ends].positions, form.boundary
    mesh = mesh_grid(old.grid, form.layout.longest_edge)
    if old.layered:
        mesh = mesh.in_layers(2 * float(np.abs(old.heights).max()))
    elif form.flat_state is not None:  # not straight in the plane
        mesh = replace(mesh, flat=old.prolong(old.flat, mesh))
    normals = None if boundary.normals is None else old.prolong(boundary.normals, mesh)
    draped = None if boundary.draped is None else old.prolong(boundary.draped, mesh)
    start = replace(boundary, draped=old.prolong(positions, mesh), normals=normals)
    again = popped_again(form, Footprint(mesh), start, ends)
    kept = replace(start, draped=draped)
    popped = {end: replace(shell, boundary=kept) for end, shell in again.popped.items()}
    return replace(again, boundary=kept, popped=popped)


def pop_up_stages(
    grid: FlatGrid,
    finals: Floats,
    rod: Rod,
    *,
    joint: Joint | None = None,
    edge: float | None = None,
    progress: Progress = silent,
) -> Stages:
    """Pop up rods given by their flat lines and the final positions of their ends.

    Args:
        finals: (m, 2, 3) where the two ends of each rod of `grid` go [m].
        joint: the connection of rods where they cross, without eccentricity; ball joints by default.
        edge: longest edge of the mesh [m]; default: a sixth of the usual distance between joints.

    Raises:
        InputError: no rod has three joints; the joint is eccentric.
    """
    require_joint(joint)
    joint = joint or Ball()
    if joint.eccentricity:
        raise InputError(
            f"the joints' eccentricity {length_text(joint.eccentricity)} would lay the rods in two layers, and a "
            "table's rods are joined at one point: leave it out"
        )
    progress("pop-up", "meshing the rods", 0.0)
    joined = FlatGrid.of(grid.rods, margin=NEAREST_JOINT * grid.span).with_common_joints()
    kept, swinging = joined.without(lambda some: some.joint_counts() < FEWEST_JOINTS)
    if not kept.rods:
        raise InputError(
            f"no rod of the table has {FEWEST_JOINTS} joints with others: such rods swing; give a denser grid"
        )
    row = {rod.name: k for k, rod in enumerate(grid.rods)}
    rows = [row[rod.name] for rod in kept.rods]
    even = (1 + TOGETHER) * grid.span / EDGES_A_SPAN  # equal spans have as many edges, however they are rounded
    footprint = Footprint(mesh_grid(kept, edge or even))
    points = finals[rows].reshape(-1, 3)
    boundary = Boundary(points, np.zeros_like(points))
    popped = pop_up(footprint, boundary, rod, ends=PINNED, start="flat", joint=joint, progress=progress)
    dropped = tuple((name, f"it has fewer than {FEWEST_JOINTS} joints and would swing") for name in swinging)
    return Stages("", rod, joint, (popped.ends,), footprint, boundary, dropped, popped={popped.ends: popped})
