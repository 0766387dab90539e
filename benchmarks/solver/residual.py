"""The neutral judge: `python residual.py MESH OUT DISPLACEMENT…` writes a JSON list with an entry for each.

The residual of any engine's displacement, by numpy alone and no engine's code: the forces of the law in `problem.py`
on straight T4 (one quadrature point) or T10 (four points, degree 2, the rule that all engines are given).
"""

import json
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from problem import BULK_KPA, SHEAR_KPA, WEIGHT_MN_MM3, Problem, load_problem

_CHUNK = 20_000  # elements at a time: the memory for a million stays small


def residual(problem: Problem, displacement: NDArray[np.float64]) -> float:
    """Norm of the unbalanced forces on the free nodes over the larger of the norms of internal and external forces."""
    internal, external = forces(problem, displacement)
    largest = max(np.linalg.norm(internal), np.linalg.norm(external))
    return float(np.linalg.norm((external - internal)[problem.free]) / largest)


def forces(problem: Problem, displacement: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Internal forces (n, 3), reactions included, and those of the weight (n, 3), in mN."""
    internal, external = np.zeros_like(problem.nodes), np.zeros_like(problem.nodes)
    points, weights = _rule(problem.order)
    values, slopes = _shapes(points, problem.order)
    for start in range(0, len(problem.tetrahedra), _CHUNK):
        elements = problem.tetrahedra[start : start + _CHUNK]
        jacobians = np.einsum("mai,qak->mqik", problem.nodes[elements], slopes)
        gradients = np.einsum("qak,mqki->mqai", slopes, np.linalg.inv(jacobians))
        volumes = np.linalg.det(jacobians) * weights / 6.0
        deformation = np.eye(3) + np.einsum("mai,mqak->mqik", displacement[elements], gradients)
        pushes = np.einsum("mq,mqik,mqak->mai", volumes, stress(deformation), gradients)
        loads = np.einsum("mq,qa->ma", volumes, values)
        for axis in range(3):
            np.add.at(internal[:, axis], elements, pushes[..., axis])
        np.add.at(external[:, 2], elements, -WEIGHT_MN_MM3 * loads)
    return internal, external


def stress(deformation: NDArray[np.float64]) -> NDArray[np.float64]:
    """First Piola–Kirchhoff stress (…, 3, 3) in kPa at deformation gradients (…, 3, 3)."""
    volume = np.linalg.det(deformation)[..., None, None]
    inverse = np.swapaxes(np.linalg.inv(deformation), -1, -2)
    first = np.sum(deformation**2, axis=(-2, -1))[..., None, None]
    return (
        SHEAR_KPA * volume ** (-2.0 / 3.0) * (deformation - first / 3.0 * inverse)
        + BULK_KPA * (volume - 1.0) * volume * inverse
    )


def relative_difference(displacement: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
    """‖u − u_ref‖ / ‖u_ref‖ over all nodes."""
    return float(np.linalg.norm(displacement - reference) / np.linalg.norm(reference))


def _rule(order: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Barycentric points (q, 4) and weights (q,): the one-point rule, and the four-point rule of degree 2."""
    if order == 1:
        return np.full((1, 4), 0.25), np.ones(1)
    outer = (5.0 - np.sqrt(5.0)) / 20.0
    points = np.full((4, 4), outer)
    np.fill_diagonal(points, 1.0 - 3.0 * outer)
    return points, np.full(4, 0.25)


def _shapes(points: NDArray[np.float64], order: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Shape functions (q, a) and their slopes (q, a, 3) along the second to fourth barycentric coordinate."""
    corner_slopes = np.array([[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    if order == 1:
        return points, np.broadcast_to(corner_slopes, (len(points), 4, 3))
    edges = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])
    first, second = points[:, edges[:, 0]], points[:, edges[:, 1]]
    values = np.hstack([points * (2.0 * points - 1.0), 4.0 * first * second])
    corners = (4.0 * points - 1.0)[..., None] * corner_slopes
    middles = 4.0 * (first[..., None] * corner_slopes[edges[:, 1]] + second[..., None] * corner_slopes[edges[:, 0]])
    return values, np.concatenate([corners, middles], axis=1)


def judge(problem: Problem, fields: list[NDArray[np.float64]]) -> list[dict[str, float | int | None]]:
    """Of each displacement its unknowns, its residual, and its difference to the one with the smallest residual."""
    finite = [bool(np.isfinite(field).all()) for field in fields]
    residuals = [residual(problem, field) if known else np.inf for field, known in zip(fields, finite, strict=True)]
    best = fields[int(np.argmin(residuals))]
    return [
        {
            "dofs": 3 * int(problem.free.sum()),
            "residual": value if known else None,
            "difference": relative_difference(field, best) if known else None,
        }
        for field, known, value in zip(fields, finite, residuals, strict=True)
    ]


if __name__ == "__main__":
    displacements = [np.load(name)["displacement"] for name in sys.argv[3:]]
    Path(sys.argv[2]).write_text(json.dumps(judge(load_problem(Path(sys.argv[1])), displacements)))
