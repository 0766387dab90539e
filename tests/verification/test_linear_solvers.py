"""Solvers of the symmetric stiffness against SciPy's, and what multigrid promises."""

import numpy as np
import pytest
from scipy.sparse import triu
from scipy.sparse.linalg import spsolve

from glisson.core import Material
from glisson.geometry.boxes import box_mesh
from glisson.mechanics.linear_solvers import make_direct_solver, make_iterative_solver
from glisson.mechanics.linear_solvers.multigrid import Multigrid
from glisson.mechanics.linear_solvers.superlu import SuperLU
from glisson.mechanics.numbering import numbering
from glisson.verification.bodies import body_of, distorted

MAKERS = {"direct": make_direct_solver, "superlu": SuperLU, "iterative": make_iterative_solver}


def _stiffness(cells: int, quadratic: bool = False, shift: float = 0.0, poisson_ratio: float = 0.45):
    """A block of cells³ cubes of 5 mm, held at one end and, along y only, at another."""
    size = 5.0 * cells
    mesh = distorted(box_mesh((size, size, size), (cells, cells, cells)), 1.0)
    mesh = mesh.as_quadratic() if quadratic else mesh
    order = numbering(mesh.nodes)
    mesh = type(mesh)(mesh.nodes[order.old], order.new[mesh.tetrahedra])
    fixed = np.zeros(mesh.nodes.shape, dtype=bool)
    fixed[mesh.nodes[:, 0] < 1e-9] = True
    fixed[mesh.nodes[:, 2] > size - 1e-9, 1] = True
    body = body_of(mesh, Material("neo-hookean", 7.0, poisson_ratio), fixed)
    blocks = body.stiffness(mesh.nodes, body.touches(mesh.nodes), project=False)
    if shift:
        body.add_shift(shift, blocks)
    return body.tangent(mesh.nodes, blocks)


@pytest.mark.parametrize("quadratic", [False, True], ids=["T4", "T10"])
@pytest.mark.parametrize("kind", MAKERS)
def test_solutions_are_those_of_scipy(kind: str, quadratic: bool) -> None:
    matrix = _stiffness(5, quadratic)
    right = np.random.default_rng(2).normal(size=matrix.positions.shape)
    whole = matrix.upper + triu(matrix.upper, 1).T
    expected = matrix.system.extend(spsolve(whole.tocsc(), matrix.system.restrict(right)))
    solver = MAKERS[kind]()
    assert solver.factor(matrix)
    found = solver.solve(right, 1e-10)
    assert np.linalg.norm(found - expected) < 1e-7 * np.linalg.norm(expected)
    assert not found[matrix.held].any()


@pytest.mark.parametrize("kind", MAKERS)
def test_a_matrix_that_is_not_definite_is_told(kind: str) -> None:
    matrix = _stiffness(4, shift=-0.5)
    solver = MAKERS[kind]()
    assert not solver.factor(matrix) or solver.solve(np.ones(matrix.positions.shape), 1e-6) is None


def test_the_preconditioner_is_symmetric_and_positive() -> None:
    """As the theory of conjugate gradients asks for; the sweeps in single precision leave 1e-6."""
    matrix = _stiffness(6)
    grid = Multigrid()
    grid.build(matrix)
    a, b = np.random.default_rng(3).normal(size=(2, *matrix.positions.shape))
    a[matrix.held] = b[matrix.held] = 0.0
    left, right = float(np.vdot(grid.apply(a), b)), float(np.vdot(a, grid.apply(b)))
    size = np.sqrt(float(np.vdot(a, grid.apply(a))) * float(np.vdot(b, grid.apply(b))))
    assert abs(left - right) < 1e-5 * size
    assert float(np.vdot(a, grid.apply(a))) > 0.0


def _reduction(cells: int, quadratic: bool) -> float:
    """How much of the energy error eight cycles alone leave, on average per cycle (a random start)."""
    matrix = _stiffness(cells, quadratic)
    grid = Multigrid()
    grid.build(matrix)
    error = np.random.default_rng(4).normal(size=matrix.positions.shape)
    error[matrix.held] = 0.0
    sizes = []
    for _ in range(9):
        sizes.append(float(np.vdot(error, matrix.product(error))))
        error = error - grid.apply(matrix.product(error))
    return float((sizes[-1] / sizes[2]) ** (0.5 / 6))


@pytest.mark.parametrize("quadratic", [False, True], ids=["T4", "T10"])
def test_cycles_contract_and_do_so_at_every_size(quadratic: bool) -> None:
    """Multigrid's promise: the rate does not go to one as the mesh gets finer."""
    rates = [_reduction(cells, quadratic) for cells in ((5, 10) if quadratic else (8, 16))]
    assert max(rates) < (0.9 if quadratic else 0.8)
    assert rates[1] < rates[0] + 0.1
