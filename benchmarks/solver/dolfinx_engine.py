"""DOLFINx with conjugate gradients and GAMG (PETSc): one process for each core, under `mpiexec`."""

import os
import sys
import time
from pathlib import Path

import dolfinx_solver  # noqa: F401 - must come first: it loads the libraries of MPI

# isort: split
import basix.ufl
import dolfinx
import numpy as np
import ufl
from adapter import tiny_problem
from dolfinx.fem import petsc as assembling
from measuring import Failed, Solution, peak_mb, resident_mb, write
from mpi4py import MPI
from petsc4py import PETSc
from problem import BULK_KPA, SHEAR_KPA, STEPS, TOLERANCE, WEIGHT_MN_MM3, Problem, load_problem
from scipy.spatial import cKDTree

_ITERATION_LIMIT = 30
_ACCURACY = 1e-4  # of each linear solve: Newton's method still takes as few iterations
_SOLVER = {
    "ksp_type": "cg",
    "ksp_rtol": _ACCURACY,
    "ksp_max_it": 500,
    "pc_type": "gamg",
    "pc_gamg_reuse_interpolation": True,
    "mg_levels_ksp_type": "chebyshev",
    "mg_levels_pc_type": "jacobi",
}


def _read(problem: Problem) -> dolfinx.mesh.Mesh:
    """The mesh, given by the first process to all."""
    comm = MPI.COMM_WORLD
    corners = problem.tetrahedra[:, :4]
    count = int(corners.max()) + 1
    cells, places = (corners, problem.nodes[:count]) if comm.rank == 0 else (corners[:0], problem.nodes[:0])
    return dolfinx.mesh.create_mesh(
        comm, cells.astype(np.int64), basix.ufl.element("Lagrange", "tetrahedron", 1, shape=(3,)), places
    )


class _Body:
    """Forms, matrix and multigrid on this process's part."""

    def __init__(self, problem: Problem, mesh: dolfinx.mesh.Mesh, cache: Path) -> None:
        space = dolfinx.fem.functionspace(mesh, ("Lagrange", problem.order, (3,)))
        self.state = dolfinx.fem.Function(space)
        _, self.ours = cKDTree(problem.nodes).query(space.tabulate_dof_coordinates())
        self.owned = space.dofmap.index_map.size_local
        given = np.flatnonzero(~problem.free[self.ours]).astype(np.int32)
        self.target = dolfinx.fem.Function(space)
        self.held = [dolfinx.fem.dirichletbc(self.target, given)]
        self.free = np.repeat(problem.free[self.ours[: self.owned]], 3)
        trial, test = ufl.TrialFunction(space), ufl.TestFunction(space)
        deformation = ufl.Identity(3) + ufl.grad(self.state)
        volume = ufl.det(deformation)
        first = ufl.inner(deformation, deformation)
        density = SHEAR_KPA / 2 * (volume ** (-2 / 3) * first - 3) + BULK_KPA / 2 * (volume - 1) ** 2
        # The rule that suffices, as all engines have it.
        dx = ufl.dx(metadata={"quadrature_degree": 0 if problem.order == 1 else 2})
        internal = ufl.derivative(density * dx, self.state, test)
        weight = ufl.inner(ufl.as_vector([0.0, 0.0, -WEIGHT_MN_MM3]), test) * ufl.dx
        options = {"cache_dir": str(cache), "cffi_extra_compile_args": ["-O3", "-march=native"]}
        forms = (ufl.derivative(internal, self.state, trial), internal, weight)
        self.tangent, self.internal, weight = (dolfinx.fem.form(form, jit_options=options) for form in forms)
        self.matrix = assembling.create_matrix(self.tangent)
        modes = _rigid_modes(space)
        self.matrix.setNearNullSpace(modes)
        self.external = self._vector(weight)
        self.solver = _solver(mesh.comm, self.matrix)

    def _vector(self, form: dolfinx.fem.Form) -> PETSc.Vec:
        made = assembling.assemble_vector(form)
        made.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
        return made

    def pulls(self) -> PETSc.Vec:
        """Internal forces."""
        return self._vector(self.internal)

    def change(self, unbalanced: PETSc.Vec) -> PETSc.Vec:
        """Newton's step, which takes the held nodes to the target."""
        self.matrix.zeroEntries()
        assembling.assemble_matrix(self.matrix, self.tangent, bcs=self.held)
        self.matrix.assemble()
        assembling.apply_lifting(unbalanced, [self.tangent], bcs=[self.held], x0=[self.state.x.petsc_vec])
        unbalanced.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
        assembling.set_bc(unbalanced, self.held, self.state.x.petsc_vec)
        self.solver.setOperators(self.matrix)
        step = unbalanced.duplicate()
        self.solver.solve(unbalanced, step)
        if self.solver.getConvergedReason() < 0:
            raise Failed(f"a linear solve ended with reason {self.solver.getConvergedReason()}")
        return step


def _rigid_modes(space: dolfinx.fem.FunctionSpace) -> PETSc.NullSpace:
    vectors = [dolfinx.la.vector(space.dofmap.index_map, bs=3) for _ in range(6)]
    x, y, z = space.tabulate_dof_coordinates().T
    for axis in range(3):
        vectors[axis].array[axis::3] = 1.0
    for mode, (a, b, along_a, along_b) in enumerate([(0, 1, -y, x), (1, 2, -z, y), (2, 0, -x, z)]):
        vectors[3 + mode].array[a::3], vectors[3 + mode].array[b::3] = along_a, along_b
    dolfinx.la.orthonormalize(vectors)
    owned = [vector.array[: 3 * space.dofmap.index_map.size_local] for vector in vectors]
    return PETSc.NullSpace().create(
        vectors=[PETSc.Vec().createWithArray(part.copy(), bsize=3, comm=space.mesh.comm) for part in owned]
    )


def _solver(comm: MPI.Comm, matrix: PETSc.Mat) -> PETSc.KSP:
    solver = PETSc.KSP().create(comm)
    options = PETSc.Options()
    for name, value in _SOLVER.items():
        options[name] = value
    solver.setFromOptions()
    solver.setOperators(matrix)
    return solver


def _solve(problem: Problem, mesh: dolfinx.mesh.Mesh, cache: Path) -> Solution:
    body = _Body(problem, mesh, cache)
    iterations = 0
    internal = body.pulls()
    lift = problem.step()[body.ours].ravel()
    for step in range(1, STEPS + 1):
        external = (step / STEPS) * body.external
        body.target.x.array[:] = step * lift
        for _ in range(_ITERATION_LIMIT):
            body.state.x.petsc_vec.axpy(1.0, body.change(external - internal))
            body.state.x.scatter_forward()
            internal = body.pulls()
            iterations += 1
            left = np.linalg.norm((external.array - internal.array)[body.free])
            left = np.sqrt(mesh.comm.allreduce(left**2))
            if left <= TOLERANCE * max(internal.norm(), external.norm()):
                break
        else:
            raise Failed(f"load step {step} did not converge in {_ITERATION_LIMIT} iterations")
    parts = mesh.comm.gather((body.ours[: body.owned], body.state.x.array.reshape(-1, 3)[: body.owned]))
    displacement = np.zeros_like(problem.nodes)
    for numbers, values in parts or ():
        displacement[numbers] = values
    return Solution(displacement, iterations)


def _main() -> None:
    comm = MPI.COMM_WORLD
    problem, out = load_problem(Path(sys.argv[1])), Path(sys.argv[2])
    cache = out.parent / "fenics-cache"
    tiny = tiny_problem(problem.order)
    _solve(tiny, _read(tiny), cache)
    mesh = _read(problem)
    before = comm.allreduce(resident_mb())
    comm.barrier()
    start = time.perf_counter()
    solution = _solve(problem, mesh, cache)
    seconds = time.perf_counter() - start
    peak = comm.allreduce(peak_mb())
    if comm.rank == 0:
        write(out, dolfinx.__version__, solution, seconds, before, peak)


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    _main()
