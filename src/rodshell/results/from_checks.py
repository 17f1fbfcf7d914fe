"""From checks, fabrication and loads to what is kept of them: records of result.json and arrays of states.npz."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Floats, Ints, largest_at
from rodshell.checks import Checks
from rodshell.checks.bending import Bending as BendingCheck
from rodshell.checks.bending import worst
from rodshell.fabrication.fabricate import Fabricated
from rodshell.figures.checks import Bending, Contact, WorstBent
from rodshell.figures.form import Bent, Rod, RodType
from rodshell.figures.records import Ends
from rodshell.layout import GridMesh
from rodshell.loads.check import LoadChecks
from rodshell.loads.settings import Cables
from rodshell.loads.strength import Limits
from rodshell.results.judged.supports import in_the_air
from rodshell.results.results import Drawings, Results
from rodshell.results.states import ACTING
from rodshell.results.verdict import verdict
from rodshell.rods.supports import finals_first


def sharpest(checks: Checks) -> Floats | None:
    """(k,) sharpest bend [1/m] of each entry of `rod_nodes` in any shape; None: nothing was checked."""
    known = [bent.curvature for bent in (*checks.bending.values(), *checks.deployment_bending)]
    return np.max(known, axis=0) if known else None


def final_ends(checks: Checks) -> Ends | None:
    """The support of the final shape; None: none was checked."""
    return next(iter(finals_first(checks.bending)), None)


def checked_results(
    results: Results,
    mesh: GridMesh,
    checks: Checks,
    fabricated: Fabricated,
    *,
    limits: Limits = Limits(),
    net: Floats | None = None,
    positions: Mapping[Ends, Floats] = {},
) -> Results:
    """The results of a form with all that was checked and made: more of each rod, and tables of the checks.

    Args:
        mesh: of the flat grid, its rods in the order of the results.
        limits: design strengths of the rods, by which utilisation is counted where they are known.
        net: (k,) stress of the net section over that of the full one, at each entry of `rod_nodes`; None: all is full.
        positions: (n, 3) of the mesh's nodes in each final shape [m].
    """
    material = results.rod.material if results.rod else None
    anisotropic = material is not None and material.shear is not None  # as timber is
    torsion = checks.shear_unknown(limits.counted) if anisotropic and limits.shear_strength is None else ()
    withstood = _Withstood(limits, mesh, np.ones(len(mesh.rod_nodes)) if net is None else net)
    bending = _bending(checks, withstood, positions)
    joint = (results.joint.mass if results.joint else None) or 0.0
    way, known = bending.deployment, limits.erection is not None
    erected = way.utilisation if way and known else None
    found = results.changed(
        warnings=(*checks.warnings, *torsion, *results.warnings, *fabricated.warnings),
        rods=_rods(results, mesh, checks, fabricated, withstood),
        bending=bending.changed(shear_strength=limits.shear_strength, strength_of=limits.strength_of),
        strength=limits.changed(erection_utilisation=erected),
        reactions=dict(checks.reactions),
        joint_loads={ends: loads.records(mesh.grid) for ends, loads in checks.joints.items()},
        self_weight=dict(checks.self_weight),
        snow=dict(checks.snow),
        contact=Contact(**checks.contact, **({"deployment": stage} if (stage := checks.closest_stage) else {})),
        other_shapes=dict(checks.other_shapes),
        fabrication=fabricated.changed(total_mass=(fabricated.total_mass or 0.0) + len(mesh.grid.crossings) * joint),
    )
    if checks.deployment is not None:
        found = found.changed(deployment=checks.deployment)
    if checks.out_of_time and found.status == "converged":
        found = found.changed(status=checks.out_of_time)
    return found


def judged(results: Results, *, drawings: Mapping[str, Any], name: str = "", rod_chosen: Iterable[str] = ()) -> Results:
    """The results with what their drawings say, and with their verdict; `rod_chosen` is which of the rod's "material"
    and "section" were chosen to fit."""
    found = results.changed(drawings=Drawings(**drawings), name=name or results.name)
    chosen = dict.fromkeys(rod_chosen, True)
    if chosen and found.rod:
        found = found.changed(rod=found.rod.changed(chosen=chosen))
    found = found.changed(ends_in_the_air=in_the_air(found))
    return found.changed(verdict=verdict(found))


def checked_states(checks: Checks, stretch_stiffness: float) -> dict[str, NDArray[Any]]:
    """States of the checks: curvature, stress and normal force at each entry of `rod_nodes`, and the deployment.

    Args:
        stretch_stiffness: EA of the rods [N].
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


@dataclass(frozen=True, eq=False)
class _Withstood:
    """By what utilisation is counted, and by which factors (k,) stresses; `known` are those of shapes, by their id."""

    limits: Limits
    mesh: GridMesh
    net: Floats
    known: dict[int, Floats] = field(default_factory=dict)

    @property
    def standing(self) -> float | None:
        """Strength that the final shapes are judged by [Pa], which have to withstand their stress permanently."""
        return self.limits.staying if self.limits.bending else self.limits.counted

    @property
    def erection(self) -> float | None:
        """Of the deployment [Pa]."""
        return self.limits.erection if self.limits.bending else self.limits.erection or self.limits.counted

    def stressed(self, bent: BendingCheck) -> Floats:
        """The stress at each entry of `rod_nodes`, or the curvature where the stress is not known."""
        if id(bent) not in self.known:  # it is asked for rod by rod
            stress = self.limits.standing(bent, self.mesh)
            self.known[id(bent)] = self.net * (bent.curvature if stress is None else stress)
        return self.known[id(bent)]

    def worst_place(self, bent: BendingCheck, positions: Floats | None = None) -> dict[str, Any]:
        """The most stressed place: the rod, how far along it [m], and by the positions (n, 3) of the mesh's nodes where
        that is [m]."""
        at = largest_at(self.stressed(bent))
        placed = dict[str, Any](zip(("rod", "at"), self.mesh.place(at), strict=True))
        return placed if positions is None else placed | {"where": tuple(positions[self.mesh.rod_nodes[at]].tolist())}

    def worst(self, final: Sequence[BendingCheck], stages: Sequence[BendingCheck], where: slice) -> dict[str, Any]:
        """Worst figures over a part of the rods' nodes, in any of the shapes."""
        figures: dict[str, Any] = worst([*final, *stages], where)
        judged = ((final, self.standing), (stages, self.erection))
        shares = [
            float(self.stressed(shape)[where].max()) / strength
            for shapes, strength in judged
            for shape in shapes
            if strength is not None and shape.stress is not None
        ]
        return figures | ({"utilisation": max(shares)} if shares else {})


def _rods(
    results: Results, mesh: GridMesh, checks: Checks, fabricated: Fabricated, withstood: _Withstood
) -> tuple[Rod, ...]:
    """The rods with how they are cut, and with their bending in the final shape and in all shapes."""
    final, found = final_ends(checks), list[Rod]()
    for k, rod in enumerate(results.rods):
        bent: dict[str, Any] = {}
        if final is not None:
            here = mesh.rod_slice(k)
            bent = Bent(**withstood.worst([checks.bending[final]], (), here)).plain()
            bent |= _at_splices(results.rod, rod, checks.bending[final], mesh, k, fabricated.splices[k])
            bent["pop_up"] = Bent(**withstood.worst([*checks.bending.values()], checks.deployment_bending, here))
        made = {
            "cut_length": float(fabricated.cut_length[k]),
            "mass": float(fabricated.mass[k]),
            "layer": int(fabricated.layer[k]),
            "splices": tuple(fabricated.splices[k]),
        }
        if len(fabricated.slots):
            joint, side = np.nonzero(mesh.grid.crossings.rods == k)
            slots = fabricated.slots[joint][np.argsort(mesh.grid.crossings.at[joint, side])].tolist()
            made["joints"] = tuple(on.changed(slot=slot) for on, slot in zip(rod.joints, slots, strict=True))
        beyond = tuple(lath.splices for lath in fabricated.laths if lath.rod == k and lath.number > 1)
        if rod.stiffness is not None and any(beyond):
            made["stiffness"] = rod.stiffness.changed(splices=beyond)
        found.append(rod.changed(**made, **bent))
    return tuple(found)


def _at_splices(
    kind: RodType | None, rod: Rod, bent: BendingCheck, mesh: GridMesh, k: int, splices: Sequence[float]
) -> dict[str, tuple[float, ...]]:
    """What a rod of one section passes on at its splices: bending moments and axial forces."""
    if not splices or kind is None or kind.EA is None or rod.stiffness is not None:
        return {}
    if kind.EI is not None:
        moment = kind.EI * bent.curvature
    elif kind.EI1 is not None and kind.EI2 is not None and bent.normal_curvature is not None:
        assert bent.geodesic_curvature is not None
        moment = np.hypot(kind.EI1 * bent.normal_curvature, kind.EI2 * bent.geodesic_curvature)
    else:
        return {}
    here = mesh.rod_slice(k)
    at = mesh.stations[here] - mesh.grid.rods[k].start
    every = {"splice_moments": moment, "splice_forces": kind.EA * bent.axial_strain}
    return {name: tuple(np.interp(splices, at, values[here]).tolist()) for name, values in every.items()}


def _bending(checks: Checks, withstood: _Withstood, positions: Mapping[Ends, Floats]) -> Bending:
    everywhere, shapes = slice(None), dict[str, Any]()
    for ends, bent in checks.bending.items():
        placed = withstood.worst_place(bent, positions.get(ends))
        shapes[ends] = WorstBent(**withstood.worst([bent], (), everywhere), **placed)
    if checks.deployment is not None:
        stages = list(zip(checks.deployment.share.tolist(), checks.deployment_bending, strict=True))
        stage = int(np.argmax([bent.curvature.max() for bent in checks.deployment_bending]))
        final = [bent for share, bent in stages if share >= 1]
        figures = withstood.worst(final, [bent for share, bent in stages if share < 1], everywhere)
        shapes["pop_up"] = WorstBent(**figures, share=float(checks.deployment.share[stage]))
    if checks.stages_below_final:
        share, worst = max(checks.stages_below_final, key=lambda stage: float(withstood.stressed(stage[1]).max()))
        figures = withstood.worst((), [bent for _, bent in checks.stages_below_final], everywhere)
        shapes["deployment"] = WorstBent(**figures, share=share, **withstood.worst_place(worst))
    return Bending(strength=withstood.standing, erection_strength=withstood.erection, **shapes)


def loaded_results(results: Results, mesh: GridMesh, checks: LoadChecks) -> Results:
    """The results of a form with those under loads."""
    found = results.changed(
        loads={
            name: {
                ends: shell.changed(
                    bracing=_in_order(results, mesh, checks.braced, shell.bracing_forces),
                    bracing_unloaded=_in_order(results, mesh, checks.braced, shell.bracing_before),
                )
                for ends, shell in by_ends.items()
            }
            for name, by_ends in checks.shells.items()
        },
        warnings=(*checks.warnings, *results.warnings),
        self_weight={
            ends: alone.changed(braced_factor=braced.load_factor, braced_limit=braced.limit)
            if (braced := checks.self_weight.get(ends)) is not None
            else alone
            for ends, alone in results.self_weight.items()
        },
    )
    if isinstance(cables := checks.asked.bracing, Cables) and found.fabrication:
        rod = cables.rod
        made = found.fabrication.changed(
            cable_stiffness=rod.stretch_stiffness, cable_mass_per_length=rod.mass_per_length
        )
        found = found.changed(fabrication=made)
    late = f"the loads were not checked: {checks.refused}" if checks.refused else checks.stopped
    return found.changed(status=late) if late and found.status == "converged" else found


def loaded_states(checks: LoadChecks) -> dict[str, NDArray[Any]]:
    """What states.npz holds of them: node positions (n, 3) [m] and stress (k,) [Pa], the mode at the limit and the
    lowest linear buckling modes (n, 3), by end condition and combination, as "loaded_pinned_winter"; forces that act
    (n, 3) [N], as "acting_pinned_winter"."""
    states: dict[str, NDArray[Any]] = {}
    for name, by_ends in checks.shells.items():
        for ends, shell in by_ends.items():
            found = {"": shell.positions, "stress_": shell.stress, "mode_": shell.mode}
            states |= {f"loaded_{what}{ends}_{name}": each for what, each in found.items() if each is not None}
            if shell.acting is not None:
                states[f"{ACTING}{ends}_{name}"] = shell.acting
            states |= {f"loaded_buckling_{ends}_{name}_{k}": mode for k, mode in enumerate(shell.modes, start=1)}
    return states


def _in_order(results: Results, mesh: GridMesh, braced: Ints, forces: Floats) -> tuple[float | None, ...]:
    """The force of each brace of the fabrication; None of those that are left out."""
    names = [*mesh.grid.joint_names, *mesh.grid.support_names]
    known = {
        frozenset((names[a], names[b])): force for (a, b), force in zip(braced.tolist(), forces.tolist(), strict=True)
    }
    return tuple(known.get(frozenset((brace.start, brace.end))) for brace in results.bracing) if known else ()
