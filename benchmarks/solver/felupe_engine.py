"""FElupe with PARDISO (pypardiso): assembly by numpy in threads, into a pattern that is kept."""

import felupe
import numpy as np
from adapter import run
from measuring import Solution
from newton import newton
from problem import BULK_KPA, SHEAR_KPA, WEIGHT_MN_MM3, Problem
from scipy.sparse import csr_matrix


class _Body:
    def __init__(self, problem: Problem, mesh: felupe.Mesh) -> None:
        kind = felupe.RegionTetra if problem.order == 1 else felupe.RegionQuadraticTetra
        region = kind(mesh)
        self._displacement = felupe.Field(region, dim=3)
        self._field = felupe.FieldContainer([self._displacement])
        law = felupe.NeoHooke(mu=SHEAR_KPA, bulk=BULK_KPA, parallel=True)
        self._solid = felupe.SolidBody(law, self._field)

    def forces(self, displacement: np.ndarray) -> np.ndarray:
        self._displacement.values[:] = displacement
        return self._solid.assemble.vector(self._field, parallel=True).toarray().ravel()

    def stiffness(self, displacement: np.ndarray) -> csr_matrix:
        return self._solid.assemble.matrix(parallel=True)

    def weight(self) -> np.ndarray:
        load = felupe.SolidBodyForce(self._field, values=[0.0, 0.0, -WEIGHT_MN_MM3])
        return load.assemble.vector(parallel=True).toarray().ravel()


def _read(problem: Problem) -> felupe.Mesh:
    return felupe.Mesh(problem.nodes, problem.tetrahedra, "tetra" if problem.order == 1 else "tetra10")


def _solve(problem: Problem, mesh: felupe.Mesh) -> Solution:
    return newton(problem, _Body(problem, mesh))


if __name__ == "__main__":
    run(felupe.__version__, _read, _solve)
