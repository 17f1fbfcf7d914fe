"""What the rods' banded systems cost by themselves: a bare solve, in which a step of the paper's scheme is counted.

A bare solve factorises the banded matrices of all rods once, the matrix of Newton's method in the flat grid, and
solves once; it is given as a band, and nothing is summed. Done by LAPACK (`scipy.linalg.solveh_banded`, all rods in one
call, which is faster than a call for each) and by our own `solve.banded`. Processor time of one thread.
"""

from statistics import median
from time import process_time

import numpy as np
from scipy.linalg import solveh_banded
from threadpoolctl import threadpool_limits

from rodshell.joints import ExplicitPenalty
from rodshell.layout import mesh_grid
from rodshell.model import Shell
from rodshell.paper.drapes import LENGTH, ROD, Case
from rodshell.solve.implicit_euler import Motion
from rodshell.solve.newton_matrix import Banded
from rodshell.solve.problem import NO_CURVATURE


class BareSolves:
    """Bare solves of a case's rods, in turns with a fall of theirs: what else the machine does slows both alike.

    Attributes
    ----------
    spent : processor time [s] of all of them.
    """

    def __init__(self, case: Case, coupling: ExplicitPenalty, step: float) -> None:
        shell = Shell.of(mesh_grid(case.layout.flat_grid(case.rods, LENGTH), case.edge), ROD, coupling=coupling)
        motion, self._free = Motion.of(shell), shell.freedom()
        state = shell.state(shell.mesh.flat)
        self._matrix = Banded([element.blocks for element in motion.elements], self._free)
        self._matrix.clear()
        for which, element in enumerate(motion.elements):
            width = 3 * element.blocks.shape[1]
            hessians = np.zeros((len(element.blocks), width, width))
            element.evaluate(state, np.zeros_like(state), hessians)
            self._matrix.add(which, hessians, element.blocks, self._free)
        self._matrix.add_blocks(motion.mass / step**2, NO_CURVATURE, self._free)
        self._summed, self._field = self._matrix.values.copy(), np.ones_like(state)
        self._band = np.asfortranarray(self._summed[: self._matrix.size, : self._matrix.half_bandwidth + 1].T)
        self._by_lapack, self._by_own, self.spent = list[float](), list[float](), 0.0
        self.once()
        self.spent = 0.0

    def once(self) -> None:
        """Solve by both, the second time of each counts."""
        begun = process_time()
        for times, solve in ((self._by_lapack, self._lapack), (self._by_own, self._own)):
            solve()
            times.append(solve())
        self.spent += process_time() - begun

    @property
    def times(self) -> tuple[float, float]:
        """Processor time [s] of a bare solve by LAPACK, and by our own band: the middle of those measured."""
        return median(self._by_lapack), median(self._by_own)

    @threadpool_limits.wrap(limits=1)
    def _lapack(self) -> float:
        begun = process_time()
        solveh_banded(self._band, self._field.ravel(), lower=True, check_finite=False)
        return process_time() - begun

    def _own(self) -> float:
        self._matrix.values[:] = self._summed
        begun = process_time()
        self._matrix.factor()
        self._matrix.solve(self._field, self._free)
        return process_time() - begun
