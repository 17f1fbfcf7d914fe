"""What is kept of checks and fabrication in result.json and states.npz."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Floats
from rodshell.checks import (
    Bending,
    Checks,
    Elsewhere,
    JointLoads,
    OtherShape,
    OtherShapes,
    Reactions,
    SelfWeight,
)
from rodshell.fabrication import Fabricated
from rodshell.layout import GridMesh

PREFERRED = ("clamped", "pinned")  # the shell that the schedules tell of


def sharpest(checks: Checks) -> Floats | None:
    """(k,) sharpest bend [1/m] of each entry of `rod_nodes` in any shell and on the way up; None: nothing checked."""
    known = [bent.curvature for bent in (*checks.bending.values(), *checks.deployment_bending)]
    return np.max(known, axis=0) if known else None


def workshop_result(
    result: Mapping[str, Any], mesh: GridMesh, checks: Checks, made: Fabricated, strength: float | None,
    shear_strength: float | None = None,
) -> dict[str, Any]:  # fmt: skip
    """`result` with all that was checked and made: more of each rod, and tables of their own."""
    torsion = checks.shear_unknown(strength) if _anisotropic(result) and shear_strength is None else ()
    rods = [dict(entry) for entry in result["rods"]]
    final = next((ends for ends in PREFERRED if ends in checks.bending), None)
    for k, entry in enumerate(rods):
        here = mesh.rod_slice(k)
        entry |= {
            "cut_length": made.cut_length[k],
            "mass": made.mass[k],
            "layer": made.layer[k],
            "splices": list(made.splices[k]),
        }
        if final is not None:
            entry |= _bent([checks.bending[final]], here, strength)
            entry["pop_up"] = _bent([*checks.bending.values(), *checks.deployment_bending], here, strength)
    return {
        **result,
        "warnings": [
            *result["warnings"],
            *torsion,
            *checks.warnings,
            *made.warnings,
        ],
        "rods": rods,
        "bending": {"shear_strength": shear_strength, **_bending(checks, mesh, strength)},
        "reactions": {ends: _reactions(held) for ends, held in checks.reactions.items()},
        "joint_loads": {ends: _joint_loads(mesh, loads) for ends, loads in checks.joints.items()},
        "self_weight": {ends: _self_weight(one) for ends, one in checks.self_weight.items()},
        **({} if checks.deployment is None else {"deployment": _deployment(checks)}),
        "contact": _contact(checks),
        "other_shapes": {ends: _other_shapes(one) for ends, one in checks.other_shapes.items()},
        "fabrication": _fabrication(result, mesh, made),
    }


def _anisotropic(result: Mapping[str, Any]) -> bool:
    """Whether the rods' material has a shear modulus of its own, as timber has."""
    return (result["rod"].get("material") or {}).get("shear") is not None


def workshop_states(checks: Checks) -> dict[str, NDArray[Any]]:
    """States of the checks: curvature and stress at each entry of `rod_nodes`, and the way up from flat."""
    states: dict[str, NDArray[Any]] = {}
    for ends, bent in checks.bending.items():
        states[f"curvature_{ends}"] = bent.curvature
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


def _bent(bent: list[Bending], where: slice, strength: float | None) -> dict[str, float | None]:
    """Worst figures over a part of the rods' nodes, in any of the states."""
    sharp = max(float(one.curvature[where].max()) for one in bent)
    figures: dict[str, float | None] = {"min_radius": 1 / sharp if sharp > 0 else None}
    strains = [float(one.strain[where].max()) for one in bent if one.strain is not None]
    stresses = [float(one.stress[where].max()) for one in bent if one.stress is not None]
    figures["max_strain"] = max(strains, default=None)
    figures["max_stress"] = max(stresses, default=None)
    for key, name in _PARTS.items():
        parts = [float(np.abs(part[where]).max()) for one in bent if (part := getattr(one, name)) is not None]
        figures[key] = max(parts, default=None)
    if strength is not None and stresses:
        figures["utilisation"] = max(stresses) / strength
    return figures


def _bending(checks: Checks, mesh: GridMesh, strength: float | None) -> dict[str, Any]:
    everywhere = slice(None)
    table: dict[str, Any] = {"strength": strength}
    for ends, bent in checks.bending.items():
        table[ends] = {**_bent([bent], everywhere, strength), **_place(bent, mesh)}
    if checks.deployment is not None:
        table["pop_up"] = _bent(list(checks.deployment_bending), everywhere, strength)
        sharpest_stage = int(np.argmax([bent.curvature.max() for bent in checks.deployment_bending]))
        table["pop_up"]["share"] = checks.deployment.share[sharpest_stage]
    if checks.stages_below_final:
        share, worst = max(checks.stages_below_final, key=lambda stage: float(_stressed(stage[1]).max()))
        stages = [bent for _, bent in checks.stages_below_final]
        table["deployment"] = {**_bent(stages, everywhere, strength), "share": share, **_place(worst, mesh)}
    return table


def _stressed(bent: Bending) -> Floats:
    """What rods are judged by at each entry of `rod_nodes`: stress, or where that is not known curvature."""
    return bent.curvature if bent.stress is None else bent.stress


def _place(bent: Bending, mesh: GridMesh) -> dict[str, Any]:
    """The most stressed place: the rod, and how far along it [m]."""
    at = int(np.argmax(_stressed(bent)))
    rod = mesh.grid.rods[int(np.searchsorted(mesh.rod_start, at, side="right")) - 1]
    return {"rod": rod.name, "at": float(mesh.stations[at]) - rod.start}


def _contact(checks: Checks) -> dict[str, Any]:
    table: dict[str, Any] = {ends: asdict(met) for ends, met in checks.contact.items()}
    if checks.closest_stage is not None:
        share, met = checks.closest_stage
        table["deployment"] = {**asdict(met), "share": share}
    return table


def _reactions(held: Reactions) -> dict[str, Any]:
    return {
        "force_sum": held.sum_of_forces,
        "moment_sum": held.sum_of_moments,
        "force_imbalance": held.force_imbalance,
        "moment_imbalance": held.moment_imbalance,
        "largest_force": float(np.linalg.norm(held.forces, axis=1).max(initial=0.0)),
        "largest_moment": float(np.linalg.norm(held.moments, axis=1).max(initial=0.0)),
        "forces": held.forces,
        "moments": held.moments,
    }


def _self_weight(weighed: SelfWeight) -> dict[str, Any]:
    return {"load_factor": weighed.load_factor, "deflection": weighed.deflection, "limit": weighed.limit}


def _joint_loads(mesh: GridMesh, loads: JointLoads) -> list[dict[str, Any]]:
    """Of each joint, on its second rod: SI units, angles in degrees."""
    names = [rod.name for rod in mesh.grid.rods]
    forces, scissor = loads.forces[:, 1], np.degrees(loads.scissor)
    return [
        {
            "rods": [names[a], names[b]],
            "force": forces[k],
            "normal_force": float(loads.normal_forces[k]),
            "shear_moment": float(loads.shear_moments[k]),
            "out_of_plane_moment": float(loads.out_of_plane_moments[k]),
            "scissor_deg": float(scissor[k]),
        }
        for k, (a, b) in enumerate(mesh.grid.crossings.rods.tolist())
    ]


def _deployment(checks: Checks) -> dict[str, Any]:
    way = checks.deployment
    assert way is not None
    stages = [
        {"share": share, "height": float(np.ptp(positions[:, 2])), **_bent([bent], slice(None), None)}
        for share, positions, bent in zip(way.share, way.positions, checks.deployment_bending, strict=True)
    ]
    return {
        "ends": "pinned",
        "stages": stages,
        "snaps": [[snap.start, snap.stop] for snap in way.snaps],
        "snapped_by": [snap.moved for snap in way.snaps],
        "lost_at": way.lost_at,
        "reached_from_flat": way.reached_from_flat,
        "elsewhere": None if way.elsewhere is None else _figures(way.elsewhere),
        "guided": None if way.guided is None else list(way.guided),
        "clamped": {"reached_from_flat": checks.clamped_from_flat},
    }


def _figures(shape: Elsewhere | OtherShape) -> dict[str, Any]:
    """All that is known of a shape but its positions."""
    return {key: value for key, value in vars(shape).items() if key != "positions"}


def _other_shapes(searched: OtherShapes) -> dict[str, Any]:
    found = [_figures(one) for one in searched.found]
    looked = {"popped_through": searched.popped_through, "largest_kick": searched.largest_kick}
    return {"tried": searched.tried, "searched": searched.searched, **looked, "found": found}


def _fabrication(result: Mapping[str, Any], mesh: GridMesh, made: Fabricated) -> dict[str, Any]:
    names = [rod.name for rod in mesh.grid.rods]
    joints = ["/".join(names[k] for k in sorted(pair)) for pair in mesh.grid.crossings.rods.tolist()]
    table: dict[str, Any] = {
        "end_allowance": made.options.end_allowance,
        "stock_length": made.options.stock_length,
        "kerf": made.options.kerf,
        "total_mass": float(made.mass.sum()) + len(joints) * (result.get("joint") or {}).get("mass", 0.0),
        "bracing": [
            {"from": joints[brace.joints[0]], "to": joints[brace.joints[1]], "flat": brace.flat, "final": brace.final}
            for brace in made.bracing
        ],
    }
    if made.nesting is not None:
        label = [f"{names[rod]}.{number}" for rod, number, _ in made.pieces]
        table["stock"] = {
            "waste": made.nesting.waste,
            "fewest": made.nesting.fewest,
            "bars": [
                {
                    "pieces": [{"piece": label[k], "length": made.pieces[k][2]} for k in bar.pieces],
                    "left": bar.left,
                }
                for bar in made.nesting.bars
            ],
        }
    return table
