"""From the patches of a sewn form to one result: result.json and states.npz."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from rodshell.checks import Checks
from rodshell.formfinding.bound_drape import shape_of_net
from rodshell.formfinding.patches import PatchedForm
from rodshell.formfinding.seams import End
from rodshell.formfinding.section_limits import is_flat
from rodshell.joints import joint_parameters
from rodshell.output.result import (
    States,
    agreement_table,
    drape_table,
    grid_table,
    head,
    popped_table,
    rod_table,
    target_table,
)


def sewn_result(form: PatchedForm) -> dict[str, Any]:
    """result.json of a sewn form, SI units: that of one shell, with `patches` and `seams`."""
    nets = [one.net for one in form.laid.values()]
    tightest = min(nets, key=lambda net: net.min_angle)
    return {
        **head(form.target.name, form.status, form.warnings),
        "target": target_table(form.target, is_flat(form.draped, form.rod)),
        "layout": form.layout.parameters(),
        "rod": rod_table(form.rod),
        "joint": joint_parameters(form.joint),
        "patches": [_patch(form, name) for name in form.found],
        "seams": [_seam(form, k) for k in range(len(form.seams))],
        "net": {**shape_of_net(tightest), "error_estimate": max(net.error_estimate for net in nets)},
        **grid_table(form.footprint, form.boundary.points, form.dropped),
        "end_tangents": form.boundary.tangents,
        "agreement": {ends: agreement_table(gap) for ends, gap in form.agreement.items()},
        "drape": _drape([drape_table(one.draped) for one in form.found.values()]),
        "pop_up": {ends: popped_table(shell.report, shell.start) for ends, shell in form.popped.items()},
    }


def sewn_states(form: PatchedForm) -> States:
    """states.npz of a sewn form."""
    mesh = form.footprint.mesh
    states: States = {"flat": mesh.flat, "rod_nodes": mesh.rod_nodes, "rod_start": mesh.rod_start}
    states["draped"] = form.draped
    states["gap_draped"] = form.target.gap(form.draped).distance
    for ends, shell in form.popped.items():
        states[f"popped_{ends}"] = shell.positions
        if ends in form.agreement:
            states[f"gap_{ends}"] = form.agreement[ends].gaps
    return states


def with_seam_forces(result: Mapping[str, Any], form: PatchedForm, checks: Checks) -> dict[str, Any]:
    """The same result, its seams with what they carry: at each meeting the sum of both rods' support forces [N]."""
    row = {rod.name: k for k, rod in enumerate(form.footprint.rods)}
    seams = [{**seam, "forces": {}} for seam in result["seams"]]
    for ends, held in checks.reactions.items():
        for k, seam in enumerate(seams):
            at = [[_index(row, end) for end in one.ends] for one in form.meetings if one.seam == k]
            carried = held.forces[np.array(at, dtype=np.intp).reshape(-1, 2)].sum(axis=1)
            seam["forces"][ends] = {
                "each": carried,
                "largest": float(np.linalg.norm(carried, axis=1).max(initial=0.0)),
                "sum": carried.sum(axis=0),
            }
    return {**result, "seams": seams}


def _index(row: Mapping[str, int], end: End) -> int:
    return 2 * row[f"{end.patch}-{end.rod}"] + end.side


def _patch(form: PatchedForm, name: str) -> dict[str, Any]:
    laid, found = form.laid[name], form.found[name]
    return {
        "id": name,
        "status": found.status,
        "rods": len(found.footprint.rods),
        "left_out": len(laid.layout.left_out),
        "anchor": list(laid.anchor),
        "rotate": laid.layout.rotate,
        "spacing": list(laid.layout.spacing),
        "flat_shift": form.flat.shifts[name].tolist(),
        "ends_moved": form.moved[name],
        "net": shape_of_net(laid.net),
        "agreement": {ends: agreement_table(gap) for ends, gap in found.agreement.items()},
        "drape": drape_table(found.draped),
        "pop_up": {ends: popped_table(shell.report, shell.start) for ends, shell in found.popped.items()},
    }


def _seam(form: PatchedForm, k: int) -> dict[str, Any]:
    here = [one for one in form.meetings if one.seam == k]
    return {
        "points": form.seams[k].points,
        "meetings": [{"point": one.point, "ends": [str(end) for end in one.ends]} for one in here],
    }


def _drape(parts: list[dict[str, Any]]) -> dict[str, Any]:
    """Figures of all drapes together: sums, and the worst of each kind."""
    tightest = min(parts, key=lambda one: float(one["min_angle_deg"]))
    joined = {**tightest, "levels": [level for one in parts for level in one["levels"]]}
    joined["status"] = next((one["status"] for one in parts if one["status"] != "converged"), "converged")
    for key in ("dofs", "seconds", "negative_modes", "contact_pulls"):
        joined[key] = sum(one[key] for one in parts)
    for key in ("force_residual", "max_strain", "max_gap"):
        joined[key] = max(one[key] for one in parts)
    strong = [one["strong_bending"] for one in parts if "strong_bending" in one]
    if strong:
        joined["strong_bending"] = max(strong, key=lambda one: (float(one["beyond"]), float(one["moment"])))
    joined["own_ends"] = {key: max(one["own_ends"][key] for one in parts) for key in ("max", "median")}
    return joined
