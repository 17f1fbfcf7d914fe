"""From checks and fabrication to what is kept of them: the records of result.json and the arrays of states.npz."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Floats
from rodshell.checks import Bending as BendingCheck
from rodshell.checks import Checks, Elsewhere, JointLoads
from rodshell.checks import Contact as ContactCheck
from rodshell.checks import OtherShape as FoundShape
from rodshell.checks import OtherShapes as ShapeSearch
from rodshell.checks import Reactions as SupportReactions
from rodshell.fabrication.fabricate import Fabricated
from rodshell.layout import GridMesh
from rodshell.loads.strength import Limits
from rodshell.results.laths import lath_name
from rodshell.results.loaded import DesignStrength
from rodshell.results.records import Bent, Ends, Rod
from rodshell.results.results import (
    Bar,
    Bending,
    Brace,
    ClampedDeployment,
    Clearance,
    Contact,
    Deployment,
    Drawings,
    Fabrication,
    JointLoad,
    OtherShape,
    OtherShapes,
    Piece,
    Reactions,
    Results,
    SelfWeight,
    Stage,
    Stock,
    WorstBent,
)
from rodshell.results.supports import in_the_air
from rodshell.results.verdict import verdict

PREFERRED: tuple[Ends, Ends] = ("clamped", "pinned")  # the final shape is the first of these that is there


def sharpest(checks: Checks) -> Floats | None:
    """(k,) sharpest bend [1/m] of each entry of `rod_nodes` in any shape; None: nothing was checked."""
    known = [bent.curvature for bent in (*checks.bending.values(), *checks.deployment_bending)]
    return np.max(known, axis=0) if known else None


def final_ends(checks: Checks) -> Ends | None:
    """The end condition of the final shape: clamped if that was checked, else pinned; None: neither was."""
    return next((ends for ends in PREFERRED if ends in checks.bending), None)


def checked_results(
    results: Results,
    mesh: GridMesh,
    checks: Checks,
    fabricated: Fabricated,
    *,
    strength: float | None,
    limits: Limits = Limits(bending={}),
    net: Floats | None = None,
    shear_strength: float | None = None,
    strength_of: str | None = None,
) -> Results:
    """The results of a form with all that was checked and made: more of each rod, and tables of the checks.

    Parameters
    ----------
    results : of the form, before it was checked.
    mesh : of the flat grid, its rods in the order of the results.
    strength : of the rods' material [Pa]; None: not known.
    limits : design strengths of the rods, by which utilisation is counted where they are known.
    net : (k,) stress of the net section over that of the full one, at each entry of `rod_nodes`; None: all is full.
    shear_strength : of the rods' material [Pa]; None: not known.
    strength_of : the preset material that the strengths are of, where they were not given.
    """
    material = results.rod.material if results.rod else None
    anisotropic = material is not None and material.shear is not None  # as timber is
    torsion = checks.shear_unknown(strength) if anisotropic and shear_strength is None else ()
    withstood = _Withstood.of(limits, strength, np.ones(len(mesh.rod_nodes)) if net is None else net)
    bending = _bending(checks, mesh, withstood)
    found = results.changed(
        warnings=(*checks.warnings, *torsion, *results.warnings, *fabricated.warnings),
        rods=_rods(results.rods, mesh, checks, fabricated, withstood),
        bending=bending.changed(shear_strength=shear_strength, strength_of=None if withstood.given else strength_of),
        strength=_design_strength(limits, bending),
        reactions={ends: _reactions(held) for ends, held in checks.reactions.items()},
        joint_loads={ends: _joint_loads(mesh, loads) for ends, loads in checks.joints.items()},
        self_weight={
            ends: SelfWeight(load_factor=found.load_factor, deflection=found.deflection, limit=found.limit)
            for ends, found in checks.self_weight.items()
        },
        contact=_contact(checks),
        other_shapes={ends: _other_shapes(searched) for ends, searched in checks.other_shapes.items()},
        fabrication=_fabrication(results, mesh, fabricated),
    )
    if checks.deployment is not None:
        found = found.changed(deployment=_deployment(checks))
    if checks.out_of_time and found.status == "converged":
        found = found.changed(status=checks.out_of_time)
    return found


def judged(results: Results, *, drawings: Mapping[str, Any], name: str = "", rod_chosen: Iterable[str] = ()) -> Results:
    """The results with what their drawings say, and with their verdict.

    Parameters
    ----------
    drawings : paper, project and the like, see `Drawings`.
    name : of the result, if not its target's.
    rod_chosen : which of the rod's "material" and "section" were chosen to fit.
    """
    found = results.changed(drawings=Drawings(**drawings), name=name or results.name)
    chosen = dict.fromkeys(rod_chosen, True)
    if chosen and found.rod:
        found = found.changed(rod=found.rod.changed(chosen=chosen))
    found = found.changed(ends_in_the_air=in_the_air(found))
    return found.changed(verdict=verdict(found))


def checked_states(checks: Checks, stretch_stiffness: float) -> dict[str, NDArray[Any]]:
    """States of the checks: curvature, stress and normal force at each entry of `rod_nodes`, and the deployment.

    Parameters
    ----------
    checks : of all shells; states that were not checked are left out.
    stretch_stiffness : EA of the rods [N].
    """
    states: dict[str, NDArray[Any]] = {}
    for ends, bent in checks.bending.items():
        states[f"curvature_{ends}"] = bent.curvature
        states[f"force_{ends}"] = stretch_stiffness * bent.axial_strain
        if bent.stress is not None:
            states[f"stress_{ends}"] = bent.stress
    if checks.deployment is not None:
        states["history_share"] = checks.deployment.share
        states["history"] = checks.deployment.positions
        states["history_curvature"] = _stacked([bent.curvature for bent in checks.deployment_bending])
        if all(bent.stress is not None for bent in checks.deployment_bending):
            states["history_stress"] = _stacked([bent.stress for bent in checks.deployment_bending])
    return states


def _stacked(rows: list[Any]) -> NDArray[np.float32]:
    return np.array(rows, dtype=np.float32)  # for colours: single precision is plenty


_PARTS = {
    "max_bending_strain": "bending_strain",
    "normal_curvature": "normal_curvature",
    "geodesic_curvature": "geodesic_curvature",
    "twist_rate": "twist_rate",
    "torsion_stress": "torsion_stress",
}


class _Withstood(NamedTuple):
    """By what the utilisation of the final shapes and that of the deployment are counted [Pa], and by which factors
    (k,) their stresses."""

    net: Floats
    standing: float | None
    erection: float | None
    given: bool = False

    @classmethod
    def of(cls, limits: Limits, strength: float | None, net: Floats) -> "_Withstood":
        """Design strengths where they are known; then a final shape has to withstand its stress permanently."""
        if limits.bending:
            return cls(net, limits.bending.get("permanent"), limits.erection, limits.given)
        return cls(net, strength, limits.erection or strength)

    def stressed(self, bent: BendingCheck) -> Floats:
        """The stress at each entry of `rod_nodes`, or the curvature where the stress is not known."""
        return self.net * (bent.curvature if bent.stress is None else bent.stress)

    def worst_place(self, bent: BendingCheck, mesh: GridMesh) -> dict[str, Any]:
        """The most stressed place: the rod, and how far along it [m]."""
        at = int(np.argmax(self.stressed(bent)))
        rod = mesh.grid.rods[int(np.searchsorted(mesh.rod_start, at, side="right")) - 1]
        return {"rod": rod.name, "at": float(mesh.stations[at]) - rod.start}

    def worst(self, final: Sequence[BendingCheck], stages: Sequence[BendingCheck], where: slice) -> dict[str, Any]:
        """Worst figures over a part of the rods' nodes, in any of the shapes."""
        figures = _worst([*final, *stages], where)
        judged = ((final, self.standing), (stages, self.erection))
        shares = [
            float((self.net * shape.stress)[where].max()) / strength
            for shapes, strength in judged
            for shape in shapes
            if strength is not None and shape.stress is not None
        ]
        return figures | ({"utilisation": max(shares)} if shares else {})


def _design_strength(limits: Limits, bending: Bending) -> DesignStrength:
    """What was judged by, and the deployment judged by it."""
    stages = bending.deployment
    return DesignStrength(
        **limits.bending,
        erection=limits.erection,
        axial=limits.axial,
        shear=1.0 / limits.shear_weight,
        creep=limits.creep,
        erection_utilisation=stages.utilisation if stages and limits.erection is not None else None,
        source=limits.source,
    )


def _worst(bent: Sequence[BendingCheck], where: slice) -> dict[str, Any]:
    """Worst figures over a part of the rods' nodes, in any of the shapes."""
    sharp = max(float(shape.curvature[where].max()) for shape in bent)
    figures: dict[str, Any] = {"min_radius": 1 / sharp if sharp > 0 else None}
    strains = [float(shape.strain[where].max()) for shape in bent if shape.strain is not None]
    stresses = [float(shape.stress[where].max()) for shape in bent if shape.stress is not None]
    figures["max_strain"] = max(strains, default=None)
    figures["max_stress"] = max(stresses, default=None)
    for key, name in _PARTS.items():
        parts = [float(np.abs(part[where]).max()) for shape in bent if (part := getattr(shape, name)) is not None]
        figures[key] = max(parts, default=None)
    return figures


def _rods(
    rods: Sequence[Rod], mesh: GridMesh, checks: Checks, fabricated: Fabricated, withstood: _Withstood
) -> tuple[Rod, ...]:
    """The rods with how they are cut, and with their bending in the final shape and in all shapes."""
    final, found = final_ends(checks), list[Rod]()
    for k, rod in enumerate(rods):
        bent: dict[str, Any] = {}
        if final is not None:
            here = mesh.rod_slice(k)
            bent = Bent(**withstood.worst([checks.bending[final]], (), here)).plain()
            bent["pop_up"] = Bent(**withstood.worst([*checks.bending.values()], checks.deployment_bending, here))
        made = {
            "cut_length": float(fabricated.cut_length[k]),
            "mass": float(fabricated.mass[k]),
            "layer": int(fabricated.layer[k]),
            "splices": tuple(fabricated.splices[k]),
        }
        beyond = tuple(lath.splices for lath in fabricated.laths if lath.rod == k and lath.number > 1)
        if rod.stiffness is not None and any(beyond):
            made["stiffness"] = rod.stiffness.changed(splices=beyond)
        found.append(rod.changed(**made, **bent))
    return tuple(found)


def _bending(checks: Checks, mesh: GridMesh, withstood: _Withstood) -> Bending:
    everywhere, shapes = slice(None), dict[str, Any]()
    for ends, bent in checks.bending.items():
        shapes[ends] = WorstBent(**withstood.worst([bent], (), everywhere), **withstood.worst_place(bent, mesh))
    if checks.deployment is not None:
        stages = list(zip(checks.deployment.share.tolist(), checks.deployment_bending, strict=True))
        stage = int(np.argmax([bent.curvature.max() for bent in checks.deployment_bending]))
        final = [bent for share, bent in stages if share >= 1]
        figures = withstood.worst(final, [bent for share, bent in stages if share < 1], everywhere)
        shapes["pop_up"] = WorstBent(**figures, share=float(checks.deployment.share[stage]))
    if checks.stages_below_final:
        share, worst = max(checks.stages_below_final, key=lambda stage: float(withstood.stressed(stage[1]).max()))
        figures = withstood.worst((), [bent for _, bent in checks.stages_below_final], everywhere)
        shapes["deployment"] = WorstBent(**figures, share=share, **withstood.worst_place(worst, mesh))
    return Bending(strength=withstood.standing, erection_strength=withstood.erection, **shapes)


def _contact(checks: Checks) -> Contact:
    shapes: dict[str, Any] = {ends: Clearance(**_clearance(found)) for ends, found in checks.contact.items()}
    if checks.closest_stage is None:
        return Contact(**shapes)
    share, found = checks.closest_stage
    return Contact(**shapes, deployment=Clearance(**_clearance(found), share=share))


def _clearance(found: ContactCheck) -> dict[str, Any]:
    return {"clearance": found.clearance, "pairs": found.pairs, "rods": found.rods, "where": found.where}


def _reactions(held: SupportReactions) -> Reactions:
    return Reactions(
        force_sum=held.sum_of_forces.tolist(),
        moment_sum=held.sum_of_moments.tolist(),
        force_imbalance=held.force_imbalance,
        moment_imbalance=held.moment_imbalance,
        largest_force=float(np.linalg.norm(held.forces, axis=1).max(initial=0.0)),
        largest_moment=float(np.linalg.norm(held.moments, axis=1).max(initial=0.0)),
        forces=held.forces.tolist(),
        moments=held.moments.tolist(),
    )


def _joint_loads(mesh: GridMesh, loads: JointLoads) -> tuple[JointLoad, ...]:
    """Of each joint, on its second rod."""
    names = [rod.name for rod in mesh.grid.rods]
    rows = zip(
        mesh.grid.crossings.rods.tolist(),
        loads.forces[:, 1].tolist(),
        loads.normal_forces.tolist(),
        loads.shear_moments.tolist(),
        loads.out_of_plane_moments.tolist(),
        np.degrees(loads.scissor).tolist(),
        strict=True,
    )
    return tuple(
        JointLoad(
            rods=(names[a], names[b]),
            force=force,
            normal_force=normal,
            shear_moment=shear,
            out_of_plane_moment=out_of_plane,
            scissor_deg=scissor,
        )
        for (a, b), force, normal, shear, out_of_plane, scissor in rows
    )


def _deployment(checks: Checks) -> Deployment:
    found = checks.deployment
    assert found is not None
    stages = tuple(
        Stage(share=float(share), height=float(np.ptp(positions[:, 2])), **_worst([bent], slice(None)))
        for share, positions, bent in zip(found.share, found.positions, checks.deployment_bending, strict=True)
    )
    return Deployment(
        ends="pinned",
        stages=stages,
        snaps=tuple((snap.start, snap.stop) for snap in found.snaps),
        snapped_by=tuple(snap.moved for snap in found.snaps),
        lost_at=found.lost_at,
        reached_from_flat=found.reached_from_flat,
        elsewhere=None if found.elsewhere is None else _shape(found.elsewhere),
        guided=found.guided,
        clamped=ClampedDeployment(reached_from_flat=checks.clamped_from_flat),
    )


def _shape(shape: Elsewhere | FoundShape) -> OtherShape:
    """All that is known of a shape but its positions."""
    if isinstance(shape, Elsewhere):
        return OtherShape(distance=shape.distance, energy=shape.energy)
    return OtherShape(
        distance=shape.distance, energy=shape.energy, from_flat=shape.from_flat, mirror=bool(shape.mirror)
    )


def _other_shapes(searched: ShapeSearch) -> OtherShapes:
    return OtherShapes(
        tried=searched.tried,
        searched=searched.searched,
        popped_through=searched.popped_through,
        largest_kick=searched.largest_kick,
        found=tuple(_shape(shape) for shape in searched.found),
    )


def joint_names(mesh: GridMesh) -> list[str]:
    """Ids of the joints, the two rods' ids with a slash, in the order of the grid's crossings."""
    names = [rod.name for rod in mesh.grid.rods]
    return ["/".join(names[k] for k in sorted(pair)) for pair in mesh.grid.crossings.rods.tolist()]


def support_names(mesh: GridMesh) -> list[str]:
    """Names of the rod ends, as "U03.1": start (0) and end (1) of each rod in turn."""
    return [f"{rod.name}.{end}" for rod in mesh.grid.rods for end in (0, 1)]


def _fabrication(results: Results, mesh: GridMesh, fabricated: Fabricated) -> Fabrication:
    names, joints = [rod.name for rod in mesh.grid.rods], joint_names(mesh)
    points = [*joints, *support_names(mesh)]
    joint_mass = (results.joint.mass if results.joint else None) or 0.0
    stock = dict[str, Any]()
    if fabricated.nesting is not None:
        pieces = [
            Piece(piece=f"{lath_name(names[rod], lath)}.{number}", length=length)
            for rod, lath, number, length in fabricated.pieces
        ]
        bars = tuple(Bar(pieces=tuple(pieces[k] for k in bar.pieces), left=bar.left) for bar in fabricated.nesting.bars)
        stock["stock"] = Stock(waste=fabricated.nesting.waste, fewest=fabricated.nesting.fewest, bars=bars)
    return Fabrication(
        end_allowance=fabricated.options.end_allowance,
        stock_length=fabricated.options.stock_length,
        kerf=fabricated.options.kerf,
        total_mass=float(fabricated.mass.sum()) + len(joints) * joint_mass,
        bracing=tuple(
            Brace(
                start=points[brace.joints[0]],
                end=points[brace.joints[1]],
                flat=brace.flat,
                final=brace.final,
                **({} if brace.cut is None else {"cut": brace.cut}),
            )
            for brace in fabricated.bracing
        ),
        **stock,
    )
