"""From the stages of a job to what is kept of it: result.json and states.npz."""

from dataclasses import asdict
from importlib.metadata import version
from math import degrees
from platform import python_version
from typing import Any

import numba
import numpy as np
import scipy
from numpy.typing import NDArray

from rodshell.arrays import Floats
from rodshell.formfinding import Agreement, Draped, Footprint, PatchForm
from rodshell.formfinding.bound_drape import shape_of_net
from rodshell.formfinding.section_limits import is_flat
from rodshell.joints import joint_parameters
from rodshell.rods.materials import PRESETS
from rodshell.rods.section import Rod
from rodshell.solve.report import SolveReport
from rodshell.targets import Target

States = dict[str, NDArray[Any]]


def form_result(form: PatchForm) -> dict[str, Any]:
    """result.json of a form, SI units; the keys are those of the documentation's page on files."""
    return {
        **head(form.target.name, form.status, form.warnings),
        "target": target_table(form.target, is_flat(form.trimmed.positions, form.rod)),
        "layout": form.layout.parameters(),
        "rod": rod_table(form.rod),
        "joint": joint_parameters(form.joint),
        **({"net": shape_of_net(form.draped.net)} if form.draped.net is not None else {}),
        **grid_table(form.footprint, form.trimmed.boundary.points, form.trimmed.dropped),
        "end_tangents": form.trimmed.boundary.tangents,
        "agreement": {ends: agreement_table(gap) for ends, gap in form.agreement.items()},
        "drape": drape_table(form.draped),
        "pop_up": {ends: popped_table(shell.report, shell.start) for ends, shell in form.popped.items()},
    }


def target_table(target: Target, flat: bool) -> dict[str, Any]:
    """The target's parameters, its size, and whether it is too flat for its rods to bend."""
    return {**target.parameters(), "reference_size": target.size, **({"flat": True} if flat else {})}


def drape_table(draped: Draped) -> dict[str, Any]:
    """Figures of a drape."""
    drape: dict[str, Any] = {
        "method": draped.method.name,
        "status": draped.report.status.value,
        "dofs": draped.report.dofs,
        "levels": [_level(level) for level in draped.levels],
        "seconds": sum(level.seconds for level in draped.levels),
        "force_residual": draped.report.force_residual,
        "max_strain": draped.report.max_strain,
        "max_gap": draped.figures.max_gap,
        "negative_modes": draped.report.negative_modes,
        "min_angle_deg": degrees(draped.figures.min_angle),
        "min_angle_at": list(draped.figures.min_angle_at),
        "contact_pulls": draped.figures.contact_pulls,
    }
    if draped.rest is not None:
        drape["fall"] = asdict(draped.rest)
    if draped.eccentricity:
        drape["eccentricity"] = draped.eccentricity
    if draped.figures.strong_bending is not None:
        drape["strong_bending"] = asdict(draped.figures.strong_bending)
    if draped.figures.net_deviation is not None:
        off = np.abs(draped.figures.net_deviation)
        drape["own_ends"] = {"max": float(off.max()), "median": float(np.median(off))}
    return drape


def form_states(form: PatchForm) -> States:
    """states.npz of a form."""
    target = form.target
    states = _mesh_states(form.footprint)
    states["draped"] = form.trimmed.positions
    states["gap_draped"] = target.gap(form.trimmed.positions).distance - form.trimmed.mesh.heights
    for ends, shell in form.popped.items():
        states[f"popped_{ends}"] = shell.positions
        if ends in form.agreement:
            states[f"gap_{ends}"] = form.agreement[ends].gaps
    return states


def _mesh_states(footprint: Footprint) -> States:
    mesh = footprint.mesh
    return {"flat": mesh.flat, "rod_nodes": mesh.rod_nodes, "rod_start": mesh.rod_start}


def table_result(table: PatchForm, name: str) -> dict[str, Any]:
    """result.json of a popped-up table of rods."""
    return {
        **head(name, table.status, table.warnings),
        "rod": rod_table(table.rod),
        "joint": joint_parameters(table.joint),
        **grid_table(table.footprint, table.boundary.points, table.dropped),
        "pop_up": {ends: popped_table(shell.report, shell.start) for ends, shell in table.popped.items()},
    }


def table_states(table: PatchForm) -> States:
    """states.npz of a popped-up table of rods."""
    return _mesh_states(table.footprint) | {f"popped_{ends}": shell.positions for ends, shell in table.popped.items()}


def head(name: str, status: str, warnings: tuple[str, ...]) -> dict[str, Any]:
    """What every result begins with."""
    return {
        "format": "rodshell-result",
        "version": 1,
        "units": "SI",
        "version_rodshell": version("rodshell"),
        "versions": {"python": python_version()} | {one.__name__: one.__version__ for one in (np, scipy, numba)},
        "name": name,
        "status": status,
        "warnings": list(warnings),
    }


def grid_table(footprint: Footprint, boundary: Floats, dropped: tuple[tuple[str, str], ...]) -> dict[str, Any]:
    """Rods, joints and rod ends."""
    rods: list[dict[str, Any]] = [
        {
            "id": rod.name,
            "family": rod.family,
            "offset": rod.offset,
            "start": rod.start,
            "end": rod.end,
            "length": rod.length,
            "joints": [],
        }
        for rod in footprint.rods
    ]
    crossings = footprint.mesh.grid.crossings
    for (a, b), (at_a, at_b) in zip(crossings.rods.tolist(), crossings.at.tolist(), strict=True):
        rods[a]["joints"].append({"with": footprint.rods[b].name, "at": at_a - footprint.rods[a].start})
        rods[b]["joints"].append({"with": footprint.rods[a].name, "at": at_b - footprint.rods[b].start})
    for rod in rods:
        rod["joints"].sort(key=lambda joint: joint["at"])
    return {
        "rods": rods,
        "dropped": [{"id": name, "reason": reason} for name, reason in dropped],
        "footprint": footprint.points.tolist(),
        "boundary": boundary.tolist(),
    }


def rod_table(rod: Rod) -> dict[str, Any]:
    """Section, material and stiffnesses."""
    first, second = rod.bend_stiffnesses
    known = PRESETS[rod.material.name] if rod.material is not None and rod.material.name is not None else None
    return {
        **rod.parameters(),
        **({"preset": {"name": rod.material.name, **asdict(known)}} if known is not None and rod.material else {}),
        "EA": rod.stretch_stiffness,
        **({"EI": first} if first == second else {"EI1": first, "EI2": second}),
        "GJ": rod.twist_stiffness,
        "mass_per_length": rod.mass_per_length,
    }


def _level(report: SolveReport) -> dict[str, Any]:
    return {
        "dofs": report.dofs,
        "status": report.status.value,
        "iterations": report.iterations,
        "factorizations": report.factorizations,
        "seconds": report.seconds,
    }


def popped_table(report: SolveReport, start: str) -> dict[str, Any]:
    """Figures of a pop-up that began from the shape `start`."""
    return {
        **_level(report),
        "start": start,
        "force_residual": report.force_residual,
        "max_strain": report.max_strain,
        "negative_modes": report.negative_modes,
        "stable": report.stable,
    }


def agreement_table(gap: Agreement) -> dict[str, Any]:
    """Gap to the target."""
    return {
        "max": gap.max,
        "rms": gap.rms,
        "max_relative": gap.max_relative,
        "rms_relative": gap.rms_relative,
        "where": list(gap.where),
    }
