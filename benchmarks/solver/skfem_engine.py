"""scikit-fem with PARDISO (pypardiso): forms in numpy, integrated over all elements at once, in two threads."""

import numpy as np
import skfem
from adapter import run
from measuring import Solution
from newton import newton
from problem import BULK_KPA, SHEAR_KPA, WEIGHT_MN_MM3, Problem
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree
from skfem.assembly.form.form import FormExtraParams
from skfem.helpers import ddot, det, grad, inv, mul, transpose

_THREADS = 2


@skfem.LinearForm
def _internal(v: skfem.DiscreteField, w: FormExtraParams) -> np.ndarray:
    return ddot(w.stress, grad(v))


@skfem.LinearForm
def _weight(v: skfem.DiscreteField, w: FormExtraParams) -> np.ndarray:
    return -WEIGHT_MN_MM3 * v[2]


class _Body:
    def __init__(self, problem: Problem, mesh: skfem.MeshTet) -> None:
        element = skfem.ElementTetP1() if problem.order == 1 else skfem.ElementTetP2()
        # The rule that suffices, as all engines have it.
        basis = skfem.Basis(mesh, skfem.ElementVector(element), intorder=1 if problem.order == 1 else 2)
        self._basis = basis
        numbers = np.hstack([basis.nodal_dofs, basis.edge_dofs.reshape(3, -1)]).T  # three of each place
        _, ours = cKDTree(basis.doflocs[:, numbers[:, 0]].T).query(problem.nodes)
        self._unknowns = numbers[ours].ravel()
        self._pattern: tuple[np.ndarray, np.ndarray] | None = None

    def forces(self, displacement: np.ndarray) -> np.ndarray:
        values = np.zeros(self._basis.N)
        values[self._unknowns] = displacement.ravel()
        gradient = np.asarray(grad(self._basis.interpolate(values)))
        self._deformation = gradient + np.eye(3)[:, :, None, None]
        self._inverse = transpose(inv(self._deformation))
        volume = det(self._deformation)
        self._shear = SHEAR_KPA * volume ** (-2.0 / 3.0)
        self._trace = ddot(self._deformation, self._deformation)
        self._pressure = BULK_KPA * (volume - 1.0) * volume
        self._stiffening = BULK_KPA * (2.0 * volume - 1.0) * volume
        stress = self._shear * (self._deformation - self._trace / 3.0 * self._inverse) + self._pressure * self._inverse
        return _internal.assemble(self._basis, stress=stress)[self._unknowns]

    def stiffness(self, displacement: np.ndarray) -> csr_matrix:
        # The change of stress with each shape function, once and not anew for each pair of them.
        changes = {id(u): self._change(np.asarray(grad(u))) for (u,) in self._basis.basis}
        form = skfem.BilinearForm(lambda u, v, w: ddot(changes[id(u)], grad(v)), nthreads=_THREADS)
        made = form.coo_data(self._basis)
        if self._pattern is None:
            self._take_pattern(made.indices)
        columns, starts = self._pattern
        data = np.bincount(self._slots, made.data, minlength=len(columns))
        return csr_matrix((data, columns, starts), shape=(self._basis.N, self._basis.N))

    def weight(self) -> np.ndarray:
        return _weight.assemble(self._basis)[self._unknowns]

    def _change(self, du: np.ndarray) -> np.ndarray:
        """∂P/∂F : ∇u for P = s (F − I1/3 G) + p G with G = F⁻ᵀ, s = µ J^(−2/3), p = κ (J − 1) J."""
        inverse, shear = self._inverse, self._shear
        along = ddot(inverse, du)
        pull = shear * ddot(self._deformation, du)
        turned = mul(mul(inverse, transpose(du)), inverse)
        spread = (2.0 / 9.0 * shear * self._trace + self._stiffening) * along - 2.0 / 3.0 * pull
        return (
            shear * du
            - 2.0 / 3.0 * shear * along * self._deformation
            + spread * inverse
            + (shear * self._trace / 3.0 - self._pressure) * turned
        )

    def _take_pattern(self, indices: np.ndarray) -> None:
        """Where each element's entries go; scikit-fem itself sorts them anew for each matrix."""
        number = np.argsort(self._unknowns)  # ours, of each of scikit-fem's
        keys = number[indices[0]] * np.int64(self._basis.N) + number[indices[1]]
        unique, self._slots = np.unique(keys, return_inverse=True)
        rows, columns = np.divmod(unique, self._basis.N)
        starts = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=self._basis.N))])
        self._pattern = (columns.astype(np.int32), starts.astype(np.int32))


def _read(problem: Problem) -> skfem.MeshTet:
    corners = problem.tetrahedra[:, :4]
    return skfem.MeshTet(problem.nodes[: corners.max() + 1].T.copy(), corners.T.copy())


def _solve(problem: Problem, mesh: skfem.MeshTet) -> Solution:
    return newton(problem, _Body(problem, mesh))


if __name__ == "__main__":
    run(skfem.__version__, _read, _solve)
