"""Derivatives against central differences of shells that are solved again: every family, round rods and laths."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rodshell.refining.objectives import Gap
from rodshell.solve.sensitivity import Sensitivity
from tests.acceptance.rows import Row
from tests.refining.test_families import EVERY, errors, start

LIMIT = 1e-6


def rows() -> Iterator[Row]:
    for name, family in EVERY:
        for laths in (False, True):
            shell = f"{name}, {'laths with pins' if laths else 'round rods'}"
            for what, error in errors(family, laths).items():
                yield Row(shell, f"derivative of {what}: relative error", error, LIMIT)
            yield from adjoint_rows(shell, family, laths)


def adjoint_rows(shell: str, family, laths: bool) -> Iterator[Row]:  # type: ignore[no-untyped-def]
    """The gradient of the gap by the adjoint: its error against the direct one, and what it costs."""
    _, here, _ = start(family, laths)
    structure, (gaps, normals) = here.structure, here.gaps
    by_state = np.zeros((1, *here.state.shape))
    by_state[0, : structure.mesh.node_count] = structure.sampled.T @ (2 * gaps[:, None] * normals / len(gaps))
    direct = 2.0 * structure.target.size**2 * Gap().slopes(here).T @ Gap().residuals(here)
    factors, solves = here.sensitivity.tangent.factors, list[int]()

    class Counted:
        negative = 0

        def solve(self, right: np.ndarray) -> np.ndarray:
            solves.extend([1] * len(np.atleast_2d(right)))
            return factors.solve(right)

    counted = Sensitivity(here.equilibrium, here.edges)
    counted.tangent = replace(here.sensitivity.tangent, factors=Counted())
    gradient = counted.by_adjoint(by_state, here.parameters)[0]
    error = float(np.abs(gradient - direct).max() / np.abs(direct).max())
    yield Row(shell, "gradient by the adjoint: relative error", error, LIMIT)
    yield Row(shell, "gradient by the adjoint: solves", len(solves), 1, note=f"{len(direct)} variables")
