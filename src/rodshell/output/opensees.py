"""The popped-up shell for finite-element programs: a neutral JSON, and a script that replays it in OpenSees.

The JSON holds what a beam model needs, in SI units: the nodes of each rod by itself, flat and final, the stages of the
deployment between them, the section's stiffnesses, joints, supports, cables and the nodal forces of each combination.
A program that starts from the flat grid, free of stress, moves all nodes through the stages, and then lets go of all
but the supports, arrives at the final shape with its bending prestress. The script does so with openseespy.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.output import grid
from rodshell.results import Archive, Results
from rodshell.results.states import ACTING, POPPED, shells_among
from rodshell.rods.supports import CLAMPED, PINNED

FORMAT, VERSION = "rodshell-structure", 1
JOINTS = "ball", "pin", "rigid"
SCRIPT = Path(__file__).parent / "templates" / "replay_opensees.py"


def opensees_files(archive: Archive) -> Iterator[tuple[str, str]]:
    """The JSON of each popped-up shape that was found, and the script.

    Raises:
        InputError: something of the shell cannot be said in the format; or there is no such shape.
    """
    states = [name for name in shells_among(archive.states) if name.startswith(POPPED) and not archive.is_lost(name)]
    for reason in _left_out(archive, states):
        raise InputError(f"no OpenSees model is written: {reason}")
    for state in states:
        yield f"opensees/{state}.json", json.dumps(_structure(archive, state), ensure_ascii=False) + "\n"
    yield "opensees/replay.py", SCRIPT.read_text(encoding="utf-8")


def _kind(results: Results) -> str:
    """Of the joints; results that say nothing of them have ball joints."""
    return (results.joint.kind if results.joint else None) or "ball"


def _left_out(archive: Archive, states: list[str]) -> Iterator[str]:
    """What of a shell the format does not hold."""
    results = archive.results
    kind = _kind(results)
    if not states or "rod_nodes" not in archive.states or results.rod is None:
        yield "the result has no popped-up shape: run its case until one is found"
    if results.flat_state is not None:
        yield "rods along curves of the target are bent in the flat grid, which must be free of stress: use a lattice"
    if any(rod.rest_curvature or rod.stiffness for rod in results.rods):
        yield "its rods are curved at rest or change their section, and the format holds straight and even ones"
    if kind not in JOINTS:
        yield f"its joints are of the kind {kind}, and the format holds {', '.join(JOINTS)}"
    if other := [state for state in states if state.removeprefix(POPPED) not in (PINNED.name, CLAMPED.name)]:
        yield f"its supports ({other[0].removeprefix(POPPED)}) are neither pinned nor clamped"
    if f"{POPPED}{CLAMPED}" in states and not results.end_tangents:
        yield "the directions of its clamped ends are not in the result"
    braced = any(shell.bracing for by_ends in results.loads.values() for shell in by_ends.values())
    if braced and results.fabrication and results.fabrication.cable_stiffness is None:
        yield "it is braced by laths, and the format holds cables"


def _structure(archive: Archive, state: str) -> dict[str, Any]:
    """The JSON of a state; nodes are the entries of `rod_nodes`, so that each belongs to one rod."""
    results, states, rods = archive.results, archive.states, grid.meshed_rods(archive)
    assert results.rod
    ends, nodes = state.removeprefix(POPPED), states["rod_nodes"]
    first = np.cumsum([0, *(len(rod.nodes) for rod in rods)])
    stages = [grid.deployed_shape(archive, name).positions for name in ["flat", *_stages(archive)]] + [states[state]]
    joints = [(joint.id, entries) for joint, entries in grid.joint_entries(archive)]
    outer = states["flat"][nodes, 2]
    named = {name: max(entries, key=lambda entry: float(outer[entry])) for name, entries in joints}
    named |= {f"{rod.id}.{k + 1}": int(at) for rod, a, b in zip(rods, first, first[1:], strict=False)
               for k, at in enumerate((a, b - 1))}  # fmt: skip
    cables = list(_cables(archive, named))
    mass = _mass(archive, rods, joints, cables, len(nodes))
    return {
        "format": FORMAT,
        "version": VERSION,
        "units": "SI: m, N, kg, rad",
        "name": archive.name,
        "state": state,
        "section": {
            "EA": results.rod.EA,
            "EI_out_of_grid": results.rod.EI1 or results.rod.EI,
            "EI_within_grid": results.rod.EI2 or results.rod.EI,
            "GJ": results.rod.GJ,
        },
        "stages": [positions[nodes].round(9).tolist() for positions in stages],
        "mass": mass.tolist(),
        "rods": [{"id": rod.id, "nodes": [*range(a, b)]} for rod, a, b in zip(rods, first, first[1:], strict=False)],
        "joints": [{"id": name, "nodes": entries, "kind": _kind(results)} for name, entries in joints],
        "supports": [
            {"id": f"{rod.id}.{k + 1}", "node": named[f"{rod.id}.{k + 1}"]}
            | ({"tangent": results.end_tangents[2 * index + k]} if ends == CLAMPED.name else {})
            for index, rod in enumerate(rods)
            for k in range(2)
        ],
        "cables": cables,
        "loads": {
            name: [[entry, *force] for entry, force in _forces(archive, states[f"{ACTING}{ends}_{name}"])]
            for name in results.loads
            if f"{ACTING}{ends}_{name}" in states
        },
    }


def _stages(archive: Archive) -> list[str]:
    return [name for name in grid.shape_names(archive) if name.startswith(grid.STAGE)]


def _cables(archive: Archive, named: dict[str, int]) -> Iterator[dict[str, Any]]:
    """Cables of a braced shell; without loads on it none is put in."""
    made = archive.results.fabrication
    if made is None or made.cable_stiffness is None:
        return
    for brace in made.bracing:
        if brace.cut is not None:
            between = [named[brace.start], named[brace.end]]
            yield {"nodes": between, "EA": made.cable_stiffness, "length": brace.cut}


def _mass(
    archive: Archive, rods: list[grid.GridRod], joints: list[tuple[str, list[int]]], cables: list[Any], count: int
) -> Floats:
    """(count,) lumped mass of each node [kg]: of rods, joints and cables."""
    results, mass, start = archive.results, np.zeros(count), 0
    per_length, of_joint = results.rod.mass_per_length if results.rod else 0.0, results.joint and results.joint.mass
    for rod in rods:
        half = 0.5 * (per_length or 0.0) * np.diff(grid.node_stations(archive, rod))
        mass[start : start + len(half)] += half
        mass[start + 1 : start + 1 + len(half)] += half
        start += len(rod.nodes)
    np.add.at(mass, [entries for _, entries in joints], 0.5 * (of_joint or 0.0))
    of_cables = (results.fabrication.cable_mass_per_length if results.fabrication else None) or 0.0
    for cable in cables:
        mass[cable["nodes"]] += 0.5 * of_cables * cable["length"]
    return mass


def _forces(archive: Archive, acting: Floats) -> Iterator[tuple[int, list[float]]]:
    """The force on each node that has one; that of a node which rods share is at the first of its entries."""
    nodes, entries = np.unique(archive.states["rod_nodes"], return_index=True)
    for node, entry in zip(nodes.tolist(), entries.tolist(), strict=True):
        if acting[node].any():
            yield entry, acting[node].tolist()
