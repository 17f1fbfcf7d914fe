"""From checks under loads to what is kept of them: the records of result.json and the arrays of states.npz."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Floats, Ints
from rodshell.figures.loads import Governs, LoadedShell, Utilisations
from rodshell.layout import GridMesh
from rodshell.loads.check import LoadChecks
from rodshell.loads.check import LoadedShell as CheckedShell
from rodshell.results.from_checks import joint_names, support_names
from rodshell.results.results import Results


def loaded_results(results: Results, mesh: GridMesh, checks: LoadChecks) -> Results:
    """The results of a form with those under loads.

    Parameters
    ----------
    mesh : of the flat grid, its rods in the order of the results.
    """
    found = results.changed(
        loads={
            name: {
                ends: _record(
                    mesh,
                    shell,
                    _in_order(results, mesh, checks.braced, shell.bracing_forces),
                    checks.frequencies.get(ends, np.zeros(0)),
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
    late = f"the loads were not checked: {checks.refused}" if checks.refused else checks.stopped
    return found.changed(status=late) if late and found.status == "converged" else found


def loaded_states(checks: LoadChecks) -> dict[str, NDArray[Any]]:
    """What states.npz holds of them: node positions (n, 3) [m] and stress (k,) [Pa], the mode at the limit and the
    lowest linear buckling modes (n, 3), by end condition and combination, as "loaded_pinned_winter".
    """
    states: dict[str, NDArray[Any]] = {}
    for name, by_ends in checks.shells.items():
        for ends, shell in by_ends.items():
            states[f"loaded_{ends}_{name}"] = shell.positions
            if shell.stress is not None:
                states[f"loaded_stress_{ends}_{name}"] = shell.stress
            if shell.mode is not None:
                states[f"loaded_mode_{ends}_{name}"] = shell.mode
            for k, mode in enumerate(shell.modes):
                states[f"loaded_buckling_{ends}_{name}_{k + 1}"] = mode
    return states


_KINDS: dict[str, str] = {"lost": "not followed"}


def _in_order(results: Results, mesh: GridMesh, braced: Ints, forces: Floats) -> tuple[float | None, ...]:
    """The force of each brace of the fabrication; None of those that are left out."""
    names = [*joint_names(mesh), *support_names(mesh)]
    known = {
        frozenset((names[a], names[b])): force for (a, b), force in zip(braced.tolist(), forces.tolist(), strict=True)
    }
    rows = results.fabrication.bracing if results.fabrication else ()
    return tuple(known.get(frozenset((brace.start, brace.end))) for brace in rows) if known else ()


def _record(mesh: GridMesh, shell: CheckedShell, bracing: tuple[float | None, ...], frequencies: Floats) -> LoadedShell:
    governs = None if shell.governs is None else _place(mesh, shell.governs[1], shell.governs[0])
    names = joint_names(mesh)
    return LoadedShell(
        at_factor=shell.at_factor,
        load_sum=shell.load_sum.tolist(),
        reaction_sum=shell.reaction_sum.tolist(),
        max_deflection=shell.max_deflection,
        linear_factor=shell.linear_factor,
        limit_factor=shell.limit_factor,
        limit_kind=_KINDS.get(shell.limit_kind, shell.limit_kind),
        imperfect_factor=shell.imperfect_factor,
        imperfect_kind=None if shell.imperfect_kind is None else _KINDS.get(shell.imperfect_kind, shell.imperfect_kind),
        duration=shell.duration,
        utilisation=shell.utilisation,
        utilisations=Utilisations(**shell.used.largest),
        euler=float(shell.used.euler.max()),
        euler_at=_place(mesh, int(np.argmax(shell.used.euler))),
        max_stress=None if shell.stress is None else float(shell.stress.max()),
        governs=governs,
        uplift=float(max(0.0, -shell.support_forces.forces[:, 2].min())),
        reactions=shell.reactions.forces.tolist(),
        support_forces=shell.support_forces.forces.tolist(),
        support_moments=shell.support_forces.moments.tolist(),
        bracing=bracing,
        bracing_utilisation=shell.bracing_utilisation,
        joint_moments=tuple(shell.joint_moments.tolist()),
        joint_moment_at=names[int(np.argmax(np.abs(shell.joint_moments)))] if len(shell.joint_moments) else None,
        slipping=tuple(names[k] for k in _slipping(mesh, shell)),
        mode_factors=tuple(shell.mode_factors.tolist()),
        frequencies=tuple(frequencies.tolist()),
    )


def _slipping(mesh: GridMesh, shell: CheckedShell) -> Ints:
    """The crossings at which a joint slips."""
    used = shell.used.uses.get("slip")
    if used is None:
        return np.empty(0, dtype=np.intp)
    entries = mesh.at_crossings
    return np.flatnonzero((used[entries] > 1).any(axis=1))


def _place(mesh: GridMesh, entry: int, by: str | None = None) -> Governs:
    """The place of an entry of the mesh's `rod_nodes`."""
    line = mesh.grid.rods[int(np.searchsorted(mesh.rod_start, entry, side="right")) - 1]
    return Governs(rod=line.name, at=float(mesh.stations[entry]) - line.start, by=by)
