"""NGSolve with its own sparse Cholesky and task manager; it differentiates the energy itself."""

import netgen.meshing
import ngsolve
import numpy as np
from adapter import run
from measuring import Failed, Solution
from problem import BULK_KPA, SHEAR_KPA, STEPS, TOLERANCE, WEIGHT_MN_MM3, Problem
from scipy.spatial import cKDTree

_ITERATION_LIMIT = 30
_EDGES = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])
_BUBBLE = -0.125  # NGSolve's quadratic edge function at the middle of its edge


def _read(problem: Problem) -> ngsolve.Mesh:
    mesh = netgen.meshing.Mesh(dim=3)
    corners = problem.tetrahedra[:, :4]
    mesh.AddPoints(problem.nodes[: corners.max() + 1].copy())
    region = mesh.AddRegion("organ", dim=3)
    # Netgen's tetrahedra are turned the other way round.
    mesh.AddElements(dim=3, index=region, data=corners[:, [0, 2, 1, 3]].astype(np.int32), base=0)
    return ngsolve.Mesh(mesh)


def _energy(space: ngsolve.FESpace, order: int) -> ngsolve.BilinearForm:
    deformation = ngsolve.Id(3) + ngsolve.Grad(space.TrialFunction())
    volume = ngsolve.Det(deformation)
    first = ngsolve.InnerProduct(deformation, deformation)
    density = SHEAR_KPA / 2 * (volume ** (-2 / 3) * first - 3) + BULK_KPA / 2 * (volume - 1) ** 2
    form = ngsolve.BilinearForm(space, symmetric=True)
    # The rule that suffices, as all engines have it.
    rule = {ngsolve.ET.TET: ngsolve.IntegrationRule(ngsolve.ET.TET, 0 if order == 1 else 2)}
    form += ngsolve.Variation(density.Compile() * ngsolve.dx(intrules=rule))
    return form


def _weight(space: ngsolve.FESpace) -> ngsolve.BaseVector:
    form = ngsolve.LinearForm(space)
    form += -WEIGHT_MN_MM3 * space.TestFunction()[2] * ngsolve.dx
    return form.Assemble().vec


def _solve(problem: Problem, mesh: ngsolve.Mesh) -> Solution:
    with ngsolve.TaskManager():
        return _newton(problem, mesh)


def _newton(problem: Problem, mesh: ngsolve.Mesh) -> Solution:
    space = ngsolve.VectorH1(mesh, order=problem.order)
    state = ngsolve.GridFunction(space)
    values = state.vec.FV().NumPy().reshape(3, -1)
    ours = np.concatenate([np.arange(mesh.nv), mesh.nv + _edges(problem, mesh)])
    free_rows = np.zeros(values.shape[1], dtype=bool)
    free_rows[ours[problem.free]] = True
    free_unknowns = np.tile(free_rows, 3)
    free = ngsolve.BitArray(free_unknowns.tolist())
    form, weight = _energy(space, problem.order), _weight(space)
    internal, external, unbalanced, motion, change = (state.vec.CreateVector() for _ in range(5))
    moved = motion.FV().NumPy().reshape(3, -1)
    inverse = None
    iterations = 0
    form.Apply(state.vec, internal)
    for step in range(1, STEPS + 1):
        external.data = (step / STEPS) * weight
        moved[:, : mesh.nv] = problem.step()[: mesh.nv].T
        for _ in range(_ITERATION_LIMIT):
            form.AssembleLinearization(state.vec)
            unbalanced.data = external - internal - form.mat * motion
            if inverse is None:
                inverse = form.mat.Inverse(free, inverse="sparsecholesky")
            else:
                inverse.Update()
            change.data = motion + inverse * unbalanced
            state.vec.data += change
            moved[:] = 0.0
            form.Apply(state.vec, internal)
            iterations += 1
            unbalanced.data = external - internal
            left = np.linalg.norm(unbalanced.FV().NumPy()[free_unknowns])
            if left <= TOLERANCE * max(internal.Norm(), external.Norm()):
                break
        else:
            raise Failed(f"load step {step} did not converge in {_ITERATION_LIMIT} iterations")
    return Solution(_nodal(problem, values[:, ours].T), iterations)


def _edges(problem: Problem, mesh: ngsolve.Mesh) -> np.ndarray:
    """NGSolve's number of the edge of each middle node."""
    if problem.order == 1:
        return np.zeros(0, dtype=int)
    ends = np.array([[vertex.nr for vertex in edge.vertices] for edge in mesh.edges])
    places = problem.nodes[ends].mean(axis=1)
    return np.asarray(cKDTree(places).query(problem.nodes[mesh.nv :])[1])


def _nodal(problem: Problem, coefficients: np.ndarray) -> np.ndarray:
    """Values at the nodes from NGSolve's hierarchical coefficients, in the order of our nodes."""
    values = coefficients.copy()
    if problem.order == 2:
        ends = problem.tetrahedra[:, _EDGES]
        middles = problem.tetrahedra[:, 4:]
        values[middles] = values[ends].mean(axis=2) + _BUBBLE * coefficients[middles]
    return values


if __name__ == "__main__":
    ngsolve.SetNumThreads(2)
    run(ngsolve.__version__, _read, _solve)
