"""PyMFEM (serial MFEM) with PARDISO (pypardiso): MFEM's hyperelastic integrator into its own sparse matrix."""

from importlib.metadata import version

import mfem.ser as mfem
import numpy as np
from adapter import run
from measuring import Solution
from newton import newton
from problem import BULK_KPA, SHEAR_KPA, WEIGHT_MN_MM3, Problem
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree


class _Body:
    def __init__(self, problem: Problem, mesh: mfem.Mesh) -> None:
        self._collection = mfem.H1_FECollection(problem.order, 3)
        # VDIM ordering: unknown 3 · node + axis.
        self._space = mfem.FiniteElementSpace(mesh, self._collection, 3, mfem.Ordering.byVDIM)
        places = mfem.GridFunction(self._space)
        mesh.GetNodes(places)
        _, ours = cKDTree(places.GetDataArray().reshape(-1, 3)).query(problem.nodes)
        self._places = places.GetDataArray().copy()
        self._unknowns = (3 * ours[:, None] + np.arange(3)).ravel()  # MFEM's number of each of our unknowns
        self._law = mfem.NeoHookeanModel(SHEAR_KPA, BULK_KPA)
        integrator = mfem.HyperelasticNLFIntegrator(self._law)
        # The rule that suffices, as all engines have it; MFEM's default has 14 points on T4.
        self._rule = mfem.IntRules.Get(mfem.Geometry.TETRAHEDRON, 0 if problem.order == 1 else 2)
        integrator.SetIntRule(self._rule)
        integrator.thisown = False
        self._form = mfem.NonlinearForm(self._space)
        self._form.AddDomainIntegrator(integrator)
        self._state = mfem.Vector(self._space.GetVSize())
        self._pulls = mfem.Vector(self._space.GetVSize())
        self._order: np.ndarray | None = None

    def forces(self, displacement: np.ndarray) -> np.ndarray:
        state = self._places.copy()
        state[self._unknowns] += displacement.ravel()
        self._state.Assign(state)
        self._form.Mult(self._state, self._pulls)
        return self._pulls.GetDataArray()[self._unknowns]

    def stiffness(self, displacement: np.ndarray) -> csr_matrix:
        gradient = mfem.Opr2SparseMat(self._form.GetGradient(self._state))
        starts, columns, data = gradient.GetIArray(), gradient.GetJArray(), gradient.GetDataArray()
        size = len(starts) - 1
        if self._order is None:
            # Sort and renumber once: the positions of the entries stay the same from here on.
            numbers = np.arange(len(data), dtype=np.float64)
            positions = csr_matrix((numbers, columns, starts), shape=(size, size))
            positions = positions[self._unknowns][:, self._unknowns].tocsr()
            positions.sort_indices()
            self._order = positions.data.astype(np.int64)
            self._pattern = (positions.indices, positions.indptr)
        return csr_matrix((data[self._order], *self._pattern), shape=(size, size))

    def weight(self) -> np.ndarray:
        load = mfem.LinearForm(self._space)
        density = mfem.VectorConstantCoefficient(mfem.Vector([0.0, 0.0, -WEIGHT_MN_MM3]))
        load.AddDomainIntegrator(mfem.VectorDomainLFIntegrator(density))
        load.Assemble()
        return load.GetDataArray()[self._unknowns]


def _read(problem: Problem) -> mfem.Mesh:
    corners = problem.tetrahedra[:, :4]
    count = int(corners.max()) + 1
    mesh = mfem.Mesh(3, count, len(corners))
    for x, y, z in problem.nodes[:count]:
        mesh.AddVertex(x, y, z)
    for a, b, c, d in corners.tolist():
        mesh.AddTet(a, b, c, d, 1)
    mesh.FinalizeTopology()
    mesh.Finalize(False, True)
    return mesh


def _solve(problem: Problem, mesh: mfem.Mesh) -> Solution:
    return newton(problem, _Body(problem, mesh))


if __name__ == "__main__":
    run(version("mfem"), _read, _solve)
