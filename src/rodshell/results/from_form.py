"""From the stages of a job to what is kept of it: the records of result.json and the arrays of states.npz.

This is the only file of the folder that knows the forms: in one piece, in patches, and from a table of rods.
"""

from collections.abc import Iterable, Iterator
from dataclasses import asdict
from importlib.metadata import version
from math import degrees
from platform import python_version
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Floats
from rodshell.checks import Checks
from rodshell.figures import form as figures
from rodshell.figures.findings import said
from rodshell.figures.records import Ends, plain
from rodshell.formfinding import Footprint, Stages, Trimmed
from rodshell.formfinding.finite_sections import is_flat
from rodshell.formfinding.seams import Seams
from rodshell.formfinding.trim import ends_past_net
from rodshell.joints import joint_parameters
from rodshell.kernels import description
from rodshell.layout import Profile
from rodshell.loads.edge_beams import used_beams
from rodshell.loads.settings import Strength
from rodshell.nets import ChebyshevNet
from rodshell.results.results import Results
from rodshell.rods.materials import PRESETS
from rodshell.rods.section import Rod
from rodshell.rods.varied import sizes
from rodshell.targets import Target
from rodshell.targets.surface_mesh import surface_mesh
from rodshell.version import __version__

if TYPE_CHECKING:
    from rodshell.refining.acceptance import Refined

States = dict[str, NDArray[Any]]


def results_of(stages: Stages) -> Results:
    """The results of a form, before it is checked; those of patches are of one shell, with `patches` and `seams`."""
    known = {
        "rod": rod_type(stages.rod),
        "joint": figures.Joint.model_validate(plain(joint_parameters(stages.joint))),
        **_grid(stages.footprint, stages.boundary.points, stages.dropped, stages.rod),
        "pop_up": _pop_ups(stages),
    }
    if beams := tuple(_edge_beams(stages)):
        known["edge_beams"] = beams
    if stages.from_table:
        return Results(**_head("rods", stages.status, stages.warnings), **known)
    known |= {
        "layout": figures.Layout.model_validate(stages.layout.parameters()),
        "end_tangents": stages.boundary.tangents.tolist(),
        "agreement": _agreements(stages),
        "target": _target(stages.target, flat=is_flat(stages.on_target, stages.rod)),
        "drape": _drape_of_all([_drape(part.trimmed) for part in stages.parts]),
    }
    if nets := [part.draped.net for part in stages.parts if part.draped.net is not None]:
        tightest = min(nets, key=lambda net: net.min_angle)
        error = max(net.error_estimate for net in nets)
        known["net"] = _net(tightest).changed(error_estimate=error)
    if stages.seams is None:
        grid = stages.footprint.mesh.grid
        known["crossings_without_joint"] = len(grid.meetings()) - len(grid.crossings)
    else:
        known["patches"] = tuple(_patch(stages, stages.seams, k) for k in range(len(stages.patches)))
        known["seams"] = tuple(_seam(stages.seams, k) for k in range(len(stages.seams.lines)))
    return Results(**_head(stages.target.name, stages.status, stages.warnings), **known)


def states_of(stages: Stages) -> States:
    """The states of a form, before it is checked."""
    mesh = stages.footprint.mesh
    states: States = {"flat": mesh.flat, "rod_nodes": mesh.rod_nodes, "rod_start": mesh.rod_start}
    if (draped := stages.boundary.draped) is not None and not stages.from_table:
        on_target = [(part.target, part.boundary.draped) for part in stages.parts]
        gaps = [target.gap(there).distance for target, there in on_target if there is not None]
        states["gap_draped"] = np.concatenate(gaps) - mesh.heights
        points, faces = surface_mesh(stages.target, draped)  # of the whole target, for pictures
        states |= {
            "draped": draped,
            "target_points": points.astype(np.float32),
            "target_faces": faces.astype(np.uint32),
        }
    for ends, shell in stages.popped.items():
        states[f"popped_{ends}"] = shell.positions
        if ends in stages.agreement:
            states[f"gap_{ends}"] = stages.agreement[ends].gaps
    return states


def with_seam_forces(results: Results, seams: Seams, checks: Checks) -> Results:
    """The same results, the seams with what they carry: at each meeting the sum of both rods' support forces."""
    first = {rod.id: 2 * k for k, rod in enumerate(results.rods)}  # row of a rod's start among all ends
    forced = list[figures.Seam]()
    for k, seam in enumerate(results.seams):
        met = [meeting.ends for meeting in seams.meetings if meeting.seam == k]
        ends = [[first[f"{end.patch}-{end.rod}"] + end.side for end in both] for both in met]
        index = np.array(ends, dtype=np.intp).reshape(-1, 2)
        forces = {support: _seam_forces(held.forces[index].sum(axis=1)) for support, held in checks.reactions.items()}
        forced.append(seam.changed(forces=forces))
    return results.changed(seams=tuple(forced))


def with_refinement(results: Results, found: "Refined") -> Results:
    """The same results, with how their form was refined; a refusal is a warning."""
    gates: tuple[figures.Gate, ...] = get_args(figures.Gate)
    refused = [] if found.changed else [said("not_refined", found.ends, why=found.refused)]
    if found.stopped:
        refused.append(said("not_refined: late", found.ends, when=found.stopped))
    return results.changed(
        warnings=(*results.warnings, *refused),
        refinement=figures.Refinement.taken_from(
            found,
            before=figures.GapBefore.taken_from(found.gap_before),
            after=figures.GapBefore.taken_from(found.gap_after),
            gates={gate: found.gates[gate] for gate in gates},
            refused=found.refused or None,
        ),
    )


def _edge_beams(stages: Stages) -> Iterator[figures.EdgeBeam]:
    for popped in stages.popped.values():
        names = popped.shell.mesh.grid.support_names
        unloaded = used_beams(popped.shell, popped.equilibrium, Strength(), None)
        for beam, used in zip(popped.shell.beams, unloaded, strict=True):
            yield figures.EdgeBeam(
                name=beam.along.name,
                kind=beam.along.kind,
                ends=tuple(names[end] for end in beam.along.ends),
                length=beam.length,
                mass=beam.length * beam.rod.mass_per_length,
                rod=rod_type(beam.rod),
                unloaded=used,
            )


def rod_type(rod: Rod) -> figures.RodType:
    """Section, material and stiffnesses."""
    first, second = rod.bend_stiffnesses
    name = rod.material.name if rod.material is not None else None
    known: dict[str, Any] = {**rod.parameters()}
    if name is not None:
        known["preset"] = {"name": name, **asdict(PRESETS[name])}
    known |= {"EI": first} if first == second else {"EI1": first, "EI2": second}
    return figures.RodType.model_validate(
        known | {"EA": rod.stretch_stiffness, "GJ": rod.twist_stiffness, "mass_per_length": rod.mass_per_length}
    )


def _head(name: str, status: str, warnings: Iterable[str]) -> dict[str, Any]:
    """What every result begins with."""
    versions = {"numpy": np.__version__, "scipy": version("scipy")}  # whose import most forms do not need
    return {
        **{key: Results.model_fields[key].default for key in ("format", "version", "units")},
        "version_rodshell": __version__,
        "versions": {"python": python_version(), **versions, "kernels": description()},
        "name": name,
        "status": status,
        "warnings": tuple(warnings),
    }


def _target(target: Target, *, flat: bool) -> figures.Target:
    """The target's parameters, its size, and whether it is too flat for its rods to bend."""
    known = {**plain(target.parameters()), "reference_size": target.size}
    known |= {"deviation": target.deviation._asdict()} if target.deviation else {}
    return figures.Target.model_validate(known | ({"flat": True} if flat else {}))


def _drape(trimmed: Trimmed) -> figures.Drape:
    """Figures of a drape; of one that did not converge nothing was trimmed."""
    draped, off = trimmed.draped, trimmed.draped.figures.net_deviation
    if off is None and draped.converged:
        off = ends_past_net(trimmed)
    more: dict[str, Any] = {}
    if draped.rest is not None:
        more["fall"] = figures.Rest.taken_from(draped.rest)
    if draped.eccentricity:
        more["eccentricity"] = draped.eccentricity
    if draped.figures.strong_bending is not None:
        more["strong_bending"] = figures.StrongBending.taken_from(draped.figures.strong_bending)
    if off is not None:
        more["net_deviation"] = figures.NetDeviation(max=float(np.abs(off).max()), median=float(np.median(np.abs(off))))
    return figures.Drape.taken_from(
        draped.report,
        method=draped.method.name,
        status=draped.report.status.value,
        levels=tuple(figures.Solve.taken_from(level, status=level.status.value) for level in draped.levels),
        seconds=sum(level.seconds for level in draped.levels),
        max_gap=draped.figures.max_gap,
        min_angle_deg=degrees(draped.figures.min_angle),
        min_angle_at=draped.figures.min_angle_at,
        contact_pulls=draped.figures.contact_pulls,
        **more,
    )


def _drape_of_all(parts: list[figures.Drape]) -> figures.Drape:
    """Figures of the drapes of all patches: sums, and the worst of each kind."""
    if len(parts) == 1:
        return parts[0]
    tightest = min(parts, key=lambda part: part.min_angle_deg or 0.0)
    worst: dict[str, Any] = {
        "levels": tuple(level for part in parts for level in part.levels),
        "status": next((part.status for part in parts if part.status != "converged"), "converged"),
    }
    totals = ("dofs", "seconds", "negative_modes", "contact_pulls")
    for name in (*totals, "force_residual", "max_strain", "max_gap"):
        values = [getattr(part, name) for part in parts]
        whole = sum if name in totals else max
        worst[name] = None if None in values else whole(values)
    if strong := [part.strong_bending for part in parts if part.strong_bending is not None]:
        worst["strong_bending"] = max(strong, key=lambda found: (found.beyond or 0.0, found.moment or 0.0))
    off = [part.net_deviation for part in parts if part.net_deviation is not None]
    worst["net_deviation"] = figures.NetDeviation(
        max=max(found.max or 0.0 for found in off), median=max(found.median or 0.0 for found in off)
    )
    return tightest.changed(**worst)


def _grid(footprint: Footprint, boundary: Floats, dropped: Iterable[tuple[str, str]], kind: Rod) -> dict[str, Any]:
    """Rods with their joints, and rod ends."""
    joints: list[list[figures.RodJoint]] = [[] for _ in footprint.rods]
    crossings = footprint.mesh.grid.crossings
    for pair, at in zip(crossings.rods.tolist(), crossings.at.tolist(), strict=True):
        for (k, other), distance in zip((pair, pair[::-1]), at, strict=True):
            name, start = footprint.rods[other].name, footprint.rods[k].start
            joints[k].append(figures.RodJoint(other=name, at=distance - start))
    rods = list[figures.Rod]()
    for rod, on_rod in zip(footprint.rods, joints, strict=True):
        more: dict[str, Any] = {"joints": tuple(sorted(on_rod, key=lambda joint: joint.at))}
        if rod.profile is not None:
            more["stiffness"] = _stiffness(rod.profile, rod.length, kind)
        if rod.curve is not None:
            at, curvatures = rod.curve.between(rod.start, rod.end)
            more["rest_curvature"] = figures.RestCurvature(at=at, curvatures=curvatures)
        rods.append(figures.Rod.taken_from(rod, id=rod.name, **more))
    return {
        "rods": tuple(rods),
        "dropped": tuple(figures.Dropped(id=name, reason=reason) for name, reason in dropped),
        "footprint": footprint.points.tolist(),
        "boundary": boundary.tolist(),
    }


def _stiffness(profile: Profile, length: float, kind: Rod) -> figures.Stiffness:
    """Of a rod of this length [m] and kind."""
    cut = sizes(kind, profile.varies, np.array(profile.factors))
    return figures.Stiffness(
        at=tuple(length * share for share in profile.stations),
        factors=profile.factors,
        varies=profile.varies,
        **({} if cut is None else {"sizes": tuple(cut.tolist())}),
    )


def _net(net: ChebyshevNet) -> figures.Net:
    angle, where = degrees(net.min_angle), net.min_angle_at
    return figures.Net(error_estimate=net.error_estimate, min_angle_deg=angle, min_angle_at=where)


def _pop_ups(stages: Stages) -> dict[Ends, figures.PopUp]:
    """Figures of the pop-up with each kind of ends."""
    return {
        ends: figures.PopUp.taken_from(
            shell.report,
            status=shell.report.status.value,
            start=shell.start,
            stable=shell.report.stable if shell.report.converged else None,
        )
        for ends, shell in stages.popped.items()
    }


def _agreements(stages: Stages) -> dict[Ends, figures.Agreement]:
    return {ends: figures.Agreement.taken_from(gap) for ends, gap in stages.agreement.items()}


def _patch(stages: Stages, seams: Seams, k: int) -> figures.Patch:
    """The k-th patch."""
    name, found = list(stages.patches.items())[k]
    laid, moved = seams.nets[name], stages.footprint.mesh.grids[k].flat[0] - found.footprint.mesh.flat[0]
    return figures.Patch(
        id=name,
        status=found.status,
        rods=len(found.footprint.rods),
        left_out=len(laid.layout.left_out),
        anchor=laid.anchor,
        rotate=laid.layout.rotate,
        spacing=laid.layout.spacing,
        flat_shift=moved[:2].tolist(),
        ends_moved=seams.moved[name],
        net=_net(laid.net),
        agreement=_agreements(found),
        drape=_drape(found.trimmed),
        pop_up=_pop_ups(found),
    )


def _seam(seams: Seams, index: int) -> figures.Seam:
    meetings = [
        figures.Meeting(point=plain(meeting.point), ends=(str(meeting.ends[0]), str(meeting.ends[1])))
        for meeting in seams.meetings
        if meeting.seam == index
    ]
    return figures.Seam(points=seams.lines[index].points.tolist(), meetings=tuple(meetings))


def _seam_forces(forces: Floats) -> figures.SeamForces:
    """Of the forces (k, 3) [N] at a seam's meetings."""
    largest = float(np.linalg.norm(forces, axis=1).max(initial=0.0))
    return figures.SeamForces(each=forces.tolist(), largest=largest, sum=forces.sum(axis=0).tolist())
