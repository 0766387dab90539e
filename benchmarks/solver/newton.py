"""Newton's method for engines that assemble and leave the rest to their user, with PARDISO as the linear solver.

Plain full steps: the peers' own examples do the same. In the first iteration of a load step the held nodes' motion
goes into the right-hand side, so that no element is crushed by it.
"""

from typing import Protocol

import numpy as np
from measuring import Failed, Solution
from numpy.typing import NDArray
from problem import STEPS, TOLERANCE, Problem
from pypardiso import PyPardisoSolver
from pypardiso.pardiso_wrapper import PyPardisoError
from scipy.sparse import csr_matrix

_ITERATION_LIMIT = 30


class Assembly(Protocol):
    """An engine: forces and stiffness at a displacement (n, 3); unknowns are numbered 3 · node + axis."""

    def forces(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Internal forces (3n,) in mN."""

    def stiffness(self, displacement: NDArray[np.float64]) -> csr_matrix:
        """Their derivative (3n, 3n), always with the same pattern; the displacement is that of the last `forces`."""

    def weight(self) -> NDArray[np.float64]:
        """External forces (3n,) in mN at full load."""


def newton(problem: Problem, assembly: Assembly) -> Solution:
    """Equilibrium at the end of each load step."""
    free = np.repeat(problem.free, 3)
    solver = Cholesky(free)
    displacement = np.zeros_like(problem.nodes)
    weight = assembly.weight()
    internal = assembly.forces(displacement)
    iterations = 0
    for step in range(1, STEPS + 1):
        external = weight * (step / STEPS)
        motion = problem.step().ravel()
        for _ in range(_ITERATION_LIMIT):
            stiffness = assembly.stiffness(displacement)
            unbalanced = external - internal
            if motion.any():
                unbalanced -= stiffness @ motion
            change = motion + solver.solve(stiffness, unbalanced)
            displacement = displacement + change.reshape(-1, 3)
            motion = np.zeros_like(motion)
            internal = assembly.forces(displacement)
            iterations += 1
            largest = max(np.linalg.norm(internal), np.linalg.norm(external))
            if np.linalg.norm((external - internal)[free]) <= TOLERANCE * largest:
                break
        else:
            raise Failed(f"load step {step} did not converge in {_ITERATION_LIMIT} iterations")
    return Solution(displacement, iterations)


class Cholesky:
    """PARDISO on the free unknowns: the upper triangle only, analysed once.

    Where a matrix is not positive definite, its symmetric indefinite factorisation goes on from there.
    """

    def __init__(self, free: NDArray[np.bool_]) -> None:
        self._free = free
        self._solver = PyPardisoSolver(mtype=2)
        self._solver.set_iparm(1, 1)
        self._solver.set_iparm(2, 2)  # METIS
        self._solver.set_iparm(10, 13)
        self._solver.set_iparm(24, 1)  # two-level, scales to more cores
        self._upper: csr_matrix | None = None
        self._slots = np.zeros(0, dtype=np.int64)

    def solve(self, stiffness: csr_matrix, right: NDArray[np.float64]) -> NDArray[np.float64]:
        """The change (3n,) of the free unknowns; zero on the others."""
        if self._upper is None:
            self._take_pattern(stiffness)
            phases = (12, 33)
        else:
            phases = (22, 33)
        self._upper.data = stiffness.data[self._slots]
        try:
            solution = self._phases(phases, right[self._free])
        except PyPardisoError as error:
            if error.value != -4 or self._solver.mtype != 2:
                raise
            self._solver.free_memory(everything=True)
            self._solver.set_matrix_type(-2)
            solution = self._phases((12, 33), right[self._free])
        change = np.zeros(len(right))
        change[self._free] = solution
        return change

    def _phases(self, phases: tuple[int, ...], right: NDArray[np.float64]) -> NDArray[np.float64]:
        for phase in phases:
            self._solver.set_phase(phase)
            solution = self._solver._call_pardiso(self._upper, right)
        return solution

    def _take_pattern(self, stiffness: csr_matrix) -> None:
        """Which entries of the full matrix make up the free unknowns' upper triangle."""
        rows = np.repeat(np.arange(stiffness.shape[0]), np.diff(stiffness.indptr))
        columns = stiffness.indices
        kept = (columns >= rows) & self._free[rows] & self._free[columns]
        self._slots = np.flatnonzero(kept)
        number = np.cumsum(self._free) - 1
        size = int(self._free.sum())
        starts = np.concatenate([[0], np.cumsum(np.bincount(number[rows[kept]], minlength=size))])
        data = stiffness.data[self._slots]
        self._upper = csr_matrix((data, number[columns[kept]].astype(np.int32), starts), shape=(size, size))
