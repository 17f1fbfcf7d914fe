"""From the stages of a job to what is kept of it: the records of result.json and the arrays of states.npz.

This is the only file of the folder that knows the forms: in one piece, in patches, and from a table of rods.
"""

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from math import degrees
from platform import python_version
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Floats
from rodshell.checks import Checks
from rodshell.formfinding import Agreement as FoundAgreement
from rodshell.formfinding import Footprint, PatchForm, Trimmed
from rodshell.formfinding.bound_drape import shape_of_net
from rodshell.formfinding.finite_sections import is_flat
from rodshell.formfinding.patches import PatchedForm
from rodshell.formfinding.seams import End
from rodshell.formfinding.trim import ends_past_net
from rodshell.joints import joint_parameters
from rodshell.kernels import description
from rodshell.layout import FlatGrid, Profile
from rodshell.nets import ChebyshevNet
from rodshell.results.records import (
    Agreement,
    Drape,
    Dropped,
    GapBefore,
    Gate,
    Joint,
    Layout,
    Meeting,
    Net,
    NetDeviation,
    Patch,
    PopUp,
    Refinement,
    Rest,
    Rod,
    RodJoint,
    RodType,
    Seam,
    SeamForces,
    Solve,
    Stiffness,
    StrongBending,
    Target,
    plain,
)
from rodshell.results.results import Results
from rodshell.rods.joints import Joint as JointModel
from rodshell.rods.materials import PRESETS
from rodshell.rods.section import Rod as RodModel
from rodshell.rods.varied import sizes
from rodshell.solve.equilibrium import SolveReport
from rodshell.targets import Target as TargetSurface
from rodshell.targets.surface_mesh import surface_mesh
from rodshell.version import __version__, version_of

if TYPE_CHECKING:
    from rodshell.refining.acceptance import Refined

States = dict[str, NDArray[Any]]


def results_of(stages: PatchForm | PatchedForm) -> Results:
    """The results of a form, before it is checked.

    Parameters
    ----------
    stages : of a form in one piece, in patches, or from a table of rods.
    """
    if isinstance(stages, PatchedForm):
        return patches_results(stages)
    return table_results(stages, "rods") if stages.from_table else form_results(stages)


def states_of(stages: PatchForm | PatchedForm) -> States:
    """The states of a form, before it is checked.

    Parameters
    ----------
    stages : as of `results_of`.
    """
    if isinstance(stages, PatchedForm):
        return patches_states(stages)
    return table_states(stages) if stages.from_table else form_states(stages)


def form_results(form: PatchForm) -> Results:
    """The results of a form in one piece, before it is checked."""
    found = Results(
        **_head(form.target.name, form.status, form.warnings),
        target=_target(form.target, flat=is_flat(form.trimmed.positions, form.rod)),
        layout=Layout.model_validate(form.layout.parameters()),
        rod=rod_type(form.rod),
        joint=_joint(form.joint),
        **_grid(form.footprint, form.boundary.points, form.dropped, form.rod),
        crossings_without_joint=_without_joint(form.footprint.mesh.grid),
        end_tangents=form.boundary.tangents.tolist(),
        agreement={ends: _agreement(gap) for ends, gap in form.agreement.items()},
        drape=_drape(form.trimmed),
        pop_up={ends: _pop_up(shell.report, shell.start) for ends, shell in form.popped.items()},
    )
    return found if form.draped.net is None else found.changed(net=_net(form.draped.net))


def form_states(form: PatchForm) -> States:
    """The states of a form in one piece."""
    states = _mesh_states(form.footprint)
    if (draped := form.boundary.draped) is not None:
        states["draped"] = draped
        states["gap_draped"] = form.target.gap(draped).distance - form.footprint.mesh.heights
        states |= _target_states(form.target, draped)
    for ends, shell in form.popped.items():
        states[f"popped_{ends}"] = shell.positions
        if ends in form.agreement:
            states[f"gap_{ends}"] = form.agreement[ends].gaps
    return states


def _target_states(target: TargetSurface, around: Floats) -> States:
    """Triangles of the target under a shell, for pictures."""
    points, faces = surface_mesh(target, around)
    return {"target_points": points.astype(np.float32), "target_faces": faces.astype(np.uint32)}


def table_results(table: PatchForm, name: str) -> Results:
    """The results of a table of rods that was popped up, before it is checked.

    Parameters
    ----------
    table : the stages; name : of the result, since a table has no target.
    """
    return Results(
        **_head(name, table.status, table.warnings),
        rod=rod_type(table.rod),
        joint=_joint(table.joint),
        **_grid(table.footprint, table.boundary.points, table.dropped, table.rod),
        pop_up={ends: _pop_up(shell.report, shell.start) for ends, shell in table.popped.items()},
    )


def table_states(table: PatchForm) -> States:
    """The states of a table of rods that was popped up."""
    return _mesh_states(table.footprint) | {f"popped_{ends}": shell.positions for ends, shell in table.popped.items()}


def patches_results(form: PatchedForm) -> Results:
    """The results of a form in patches, before it is checked: those of one shell, with `patches` and `seams`."""
    nets = [laid.net for laid in form.patch_nets.values()]
    tightest = min(nets, key=lambda net: net.min_angle)
    return Results(
        **_head(form.target.name, form.status, form.warnings),
        target=_target(form.target, flat=is_flat(form.draped, form.rod)),
        layout=Layout.model_validate(form.layout.parameters()),
        rod=rod_type(form.rod),
        joint=_joint(form.joint),
        patches=tuple(_patch(form, name) for name in form.patches),
        seams=tuple(_seam(form, k) for k in range(len(form.seams))),
        net=_net(tightest).changed(error_estimate=max(net.error_estimate for net in nets)),
        **_grid(form.footprint, form.boundary.points, form.dropped, form.rod),
        end_tangents=form.boundary.tangents.tolist(),
        agreement={ends: _agreement(gap) for ends, gap in form.agreement.items()},
        drape=_drape_of_all([_drape(found.trimmed) for found in form.patches.values()]),
        pop_up={ends: _pop_up(shell.report, shell.start) for ends, shell in form.popped.items()},
    )


def patches_states(form: PatchedForm) -> States:
    """The states of a form in patches."""
    states = _mesh_states(form.footprint)
    states["draped"] = form.draped
    gaps = [found.target.gap(found.trimmed.positions).distance for found in form.patches.values()]
    states["gap_draped"] = np.concatenate(gaps)
    states |= _target_states(form.target, form.draped)
    for ends, shell in form.popped.items():
        states[f"popped_{ends}"] = shell.positions
        if ends in form.agreement:
            states[f"gap_{ends}"] = form.agreement[ends].gaps
    return states


def with_seam_forces(results: Results, form: PatchedForm, checks: Checks) -> Results:
    """The same results, the seams with what they carry: at each meeting the sum of both rods' support forces.

    Parameters
    ----------
    checks : with the reactions of all patches, rod by rod.
    """
    row = {rod.name: k for k, rod in enumerate(form.footprint.rods)}
    seams = []
    for k, seam in enumerate(results.seams):
        ends = [[_end_index(row, end) for end in meeting.ends] for meeting in form.meetings if meeting.seam == k]
        index = np.array(ends, dtype=np.intp).reshape(-1, 2)
        forces = {support: _seam_forces(held.forces[index].sum(axis=1)) for support, held in checks.reactions.items()}
        seams.append(seam.changed(forces=forces))
    return results.changed(seams=tuple(seams))


def with_refinement(results: Results, found: "Refined") -> Results:
    """The same results, with how their form was refined; a refusal is a warning.

    Parameters
    ----------
    results : of the form after it.
    """
    gates: tuple[Gate, ...] = get_args(Gate)
    before, after = (
        GapBefore(rms_relative=gap.rms_relative, max_relative=gap.max_relative)
        for gap in (found.gap_before, found.gap_after)
    )
    said = [] if found.changed else [f"the form is not refined: {found.refused}"]
    if found.stopped:
        said.append(f"{found.stopped}: the refinement was stopped at what it had found")
    return results.changed(
        warnings=(*results.warnings, *said),
        refinement=Refinement(
            vary=found.vary,
            ends=found.ends,
            before=before,
            after=after,
            factorizations=found.factorizations,
            gate_factorizations=found.gate_factorizations,
            gates={gate: found.gates[gate] for gate in gates},
            refused=found.refused or None,
        ),
    )


def rod_type(rod: RodModel) -> RodType:
    """Section, material and stiffnesses."""
    first, second = rod.bend_stiffnesses
    name = rod.material.name if rod.material is not None else None
    known: dict[str, Any] = {**rod.parameters()}
    if name is not None:
        known["preset"] = {"name": name, **asdict(PRESETS[name])}
    known |= {"EI": first} if first == second else {"EI1": first, "EI2": second}
    return RodType.model_validate(
        known | {"EA": rod.stretch_stiffness, "GJ": rod.twist_stiffness, "mass_per_length": rod.mass_per_length}
    )


def _head(name: str, status: str, warnings: Iterable[str]) -> dict[str, Any]:
    """What every result begins with."""
    versions = {"numpy": np.__version__, "scipy": version_of("scipy")}  # whose import most forms do not need
    return {
        **{key: Results.model_fields[key].default for key in ("format", "version", "units")},
        "version_rodshell": __version__,
        "versions": {"python": python_version(), **versions, "kernels": description()},
        "name": name,
        "status": status,
        "warnings": tuple(warnings),
    }


def _target(target: TargetSurface, *, flat: bool) -> Target:
    """The target's parameters, its size, and whether it is too flat for its rods to bend."""
    known = {**plain(target.parameters()), "reference_size": target.size}
    known |= {"deviation": target.deviation._asdict()} if target.deviation else {}
    return Target.model_validate(known | ({"flat": True} if flat else {}))


def _joint(joint: JointModel) -> Joint:
    return Joint.model_validate(plain(joint_parameters(joint)))


def _net(net: ChebyshevNet) -> Net:
    return Net.model_validate(shape_of_net(net))


def _drape(trimmed: Trimmed) -> Drape:
    """Figures of a drape; of one that did not converge nothing was trimmed."""
    draped, off = trimmed.draped, trimmed.draped.figures.net_deviation
    if off is None and draped.converged:
        off = ends_past_net(trimmed)
    more: dict[str, Any] = {}
    if draped.rest is not None:
        more["fall"] = Rest(**asdict(draped.rest))
    if draped.eccentricity:
        more["eccentricity"] = draped.eccentricity
    if draped.figures.strong_bending is not None:
        more["strong_bending"] = StrongBending(**asdict(draped.figures.strong_bending))
    if off is not None:
        more["net_deviation"] = NetDeviation(max=float(np.abs(off).max()), median=float(np.median(np.abs(off))))
    return Drape(
        method=draped.method.name,
        status=draped.report.status.value,
        dofs=draped.report.dofs,
        levels=tuple(Solve(**_effort(level)) for level in draped.levels),
        seconds=sum(level.seconds for level in draped.levels),
        force_residual=draped.report.force_residual,
        max_strain=draped.report.max_strain,
        max_gap=draped.figures.max_gap,
        negative_modes=draped.report.negative_modes,
        min_angle_deg=degrees(draped.figures.min_angle),
        min_angle_at=draped.figures.min_angle_at,
        contact_pulls=draped.figures.contact_pulls,
        **more,
    )


def _drape_of_all(parts: list[Drape]) -> Drape:
    """Figures of the drapes of all patches: sums, and the worst of each kind."""
    tightest = min(parts, key=lambda part: part.min_angle_deg or 0.0)
    figures: dict[str, Any] = {
        "levels": tuple(level for part in parts for level in part.levels),
        "status": next((part.status for part in parts if part.status != "converged"), "converged"),
    }
    totals = ("dofs", "seconds", "negative_modes", "contact_pulls")
    for name in (*totals, "force_residual", "max_strain", "max_gap"):
        values = [getattr(part, name) for part in parts]
        whole = sum if name in totals else max
        figures[name] = None if None in values else whole(values)
    if strong := [part.strong_bending for part in parts if part.strong_bending is not None]:
        figures["strong_bending"] = max(strong, key=lambda found: (found.beyond or 0.0, found.moment or 0.0))
    off = [part.net_deviation for part in parts if part.net_deviation is not None]
    figures["net_deviation"] = NetDeviation(
        max=max(found.max or 0.0 for found in off), median=max(found.median or 0.0 for found in off)
    )
    return tightest.changed(**figures)


def _mesh_states(footprint: Footprint) -> States:
    mesh = footprint.mesh
    return {"flat": mesh.flat, "rod_nodes": mesh.rod_nodes, "rod_start": mesh.rod_start}


def _without_joint(grid: FlatGrid) -> int:
    """At how many crossings the rods have no joint."""
    return len(FlatGrid.of(grid.rods).crossings) - len(grid.crossings)


def _grid(footprint: Footprint, boundary: Floats, dropped: Iterable[tuple[str, str]], kind: RodModel) -> dict[str, Any]:
    """Rods with their joints, and rod ends."""
    joints: list[list[RodJoint]] = [[] for _ in footprint.rods]
    crossings = footprint.mesh.grid.crossings
    for pair, at in zip(crossings.rods.tolist(), crossings.at.tolist(), strict=True):
        for (k, other), distance in zip((pair, pair[::-1]), at, strict=True):
            name, start = footprint.rods[other].name, footprint.rods[k].start
            joints[k].append(RodJoint(other=name, at=distance - start))
    rods = [
        Rod(
            id=rod.name,
            family=rod.family,
            offset=rod.offset,
            start=rod.start,
            end=rod.end,
            length=rod.length,
            joints=tuple(sorted(on_rod, key=lambda joint: joint.at)),
        )
        for rod, on_rod in zip(footprint.rods, joints, strict=True)
    ]
    for k, rod in enumerate(footprint.rods):
        if rod.profile is not None:
            rods[k] = rods[k].changed(stiffness=_stiffness(rod.profile, rod.length, kind))
    return {
        "rods": tuple(rods),
        "dropped": tuple(Dropped(id=name, reason=reason) for name, reason in dropped),
        "footprint": footprint.points.tolist(),
        "boundary": boundary.tolist(),
    }


def _stiffness(profile: Profile, length: float, kind: RodModel) -> Stiffness:
    """Of a rod of this length [m] and kind."""
    cut = sizes(kind, profile.varies, np.array(profile.factors))
    return Stiffness(
        at=tuple(length * share for share in profile.stations),
        factors=profile.factors,
        varies=profile.varies,
        **({} if cut is None else {"sizes": tuple(cut.tolist())}),
    )


def _effort(report: SolveReport) -> dict[str, Any]:
    return {
        "dofs": report.dofs,
        "status": report.status.value,
        "iterations": report.iterations,
        "factorizations": report.factorizations,
        "seconds": report.seconds,
    }


def _pop_up(report: SolveReport, start: str) -> PopUp:
    """Figures of a pop-up that began from the shape `start`."""
    return PopUp(
        **_effort(report),
        start=start,
        force_residual=report.force_residual,
        max_strain=report.max_strain,
        negative_modes=report.negative_modes,
        stable=report.stable if report.converged else None,
    )


def _agreement(gap: FoundAgreement) -> Agreement:
    return Agreement(
        max=gap.max, rms=gap.rms, max_relative=gap.max_relative, rms_relative=gap.rms_relative, where=gap.where
    )


def _patch(form: PatchedForm, name: str) -> Patch:
    laid, found = form.patch_nets[name], form.patches[name]
    return Patch(
        id=name,
        status=found.status,
        rods=len(found.footprint.rods),
        left_out=len(laid.layout.left_out),
        anchor=laid.anchor,
        rotate=laid.layout.rotate,
        spacing=laid.layout.spacing,
        flat_shift=form.flat.shifts[name].tolist(),
        ends_moved=form.moved[name],
        net=_net(laid.net),
        agreement={ends: _agreement(gap) for ends, gap in found.agreement.items()},
        drape=_drape(found.trimmed),
        pop_up={ends: _pop_up(shell.report, shell.start) for ends, shell in found.popped.items()},
    )


def _seam(form: PatchedForm, index: int) -> Seam:
    meetings = [
        Meeting(point=plain(meeting.point), ends=(str(meeting.ends[0]), str(meeting.ends[1])))
        for meeting in form.meetings
        if meeting.seam == index
    ]
    return Seam(points=form.cut_along[index].points.tolist(), meetings=tuple(meetings))


def _seam_forces(forces: Floats) -> SeamForces:
    """Of the forces (k, 3) [N] at a seam's meetings."""
    largest = float(np.linalg.norm(forces, axis=1).max(initial=0.0))
    return SeamForces(each=forces.tolist(), largest=largest, sum=forces.sum(axis=0).tolist())


def _end_index(row: Mapping[str, int], end: End) -> int:
    """Row of a rod end among all, start and end of each rod in turn."""
    return 2 * row[f"{end.patch}-{end.rod}"] + end.side
