"""From checks under loads to what is kept of them: the records of result.json and the arrays of states.npz."""

from typing import Any

from numpy.typing import NDArray

from rodshell.arrays import Floats, Ints
from rodshell.layout import GridMesh
from rodshell.loads.check import LoadChecks
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
                ends: shell.changed(bracing=_in_order(results, mesh, checks.braced, shell.bracing_forces))
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


def _in_order(results: Results, mesh: GridMesh, braced: Ints, forces: Floats) -> tuple[float | None, ...]:
    """The force of each brace of the fabrication; None of those that are left out."""
    names = [*mesh.grid.joint_names, *mesh.grid.support_names]
    known = {
        frozenset((names[a], names[b])): force for (a, b), force in zip(braced.tolist(), forces.tolist(), strict=True)
    }
    rows = results.fabrication.bracing if results.fabrication else ()
    return tuple(known.get(frozenset((brace.start, brace.end))) for brace in rows) if known else ()
