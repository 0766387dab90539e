"""Forces of the neo-Hookean law by numpy alone and no engine's code, with which engines' answers are judged.

W = µ/2 (J^(−2/3) I1 − 3) + κ/2 (J − 1)² on straight T4 (one quadrature point) or T10 (four points, degree 2, the rule
that all engines are given).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_CHUNK = 20_000  # elements at a time: the memory for a million stays small


@dataclass(frozen=True, eq=False)
class Tissue:
    """Shear and bulk modulus in kPa, and the weight (3,) in mN/mm³ of the shape that is weighed."""

    shear_kpa: float
    bulk_kpa: float
    weight_mn_mm3: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Forces:
    """Internal (n, 3), reactions included, and those of the weight (n, 3), in mN; and the least det F of all points."""

    internal: NDArray[np.float64]
    external: NDArray[np.float64]
    least_volume_ratio: float

    def residual(self, free: NDArray[np.bool_]) -> float:
        """Norm of the unbalanced forces on the nodes `free` over the larger of the norms of internal and external."""
        largest = max(np.linalg.norm(self.internal), np.linalg.norm(self.external))
        return float(np.linalg.norm((self.external - self.internal)[free]) / largest)


def forces(
    tissue: Tissue,
    rest: NDArray[np.float64],
    tetrahedra: NDArray[np.int64],
    displacement: NDArray[np.float64],
    weighed: NDArray[np.float64],
) -> Forces:
    """Forces of elements (m, 4 or 10) with unloaded nodes `rest` (n, 3), displaced from there by (n, 3), in mm.

    `weighed` (n, 3) are the nodes of the shape whose volume the weight belongs to.
    """
    order = 1 if tetrahedra.shape[1] == 4 else 2
    internal, external = np.zeros_like(rest), np.zeros_like(rest)
    points, weights = _rule(order)
    values, slopes = _shapes(points, order)
    least = np.inf
    for start in range(0, len(tetrahedra), _CHUNK):
        elements = tetrahedra[start : start + _CHUNK]
        jacobians = np.einsum("mai,qak->mqik", rest[elements], slopes)
        gradients = np.einsum("qak,mqki->mqai", slopes, np.linalg.inv(jacobians))
        volumes = np.linalg.det(jacobians) * weights / 6.0
        deformation = np.eye(3) + np.einsum("mai,mqak->mqik", displacement[elements], gradients)
        least = min(least, float(np.linalg.det(deformation).min()))
        pushes = np.einsum("mq,mqik,mqak->mai", volumes, stress(tissue, deformation), gradients)
        volumes = np.linalg.det(np.einsum("mai,qak->mqik", weighed[elements], slopes)) * weights / 6.0
        loads = np.einsum("mq,qa->ma", volumes, values)
        for axis in range(3):
            np.add.at(internal[:, axis], elements, pushes[..., axis])
            np.add.at(external[:, axis], elements, tissue.weight_mn_mm3[axis] * loads)
    return Forces(internal, external, least)


def stress(tissue: Tissue, deformation: NDArray[np.float64]) -> NDArray[np.float64]:
    """First Piola–Kirchhoff stress (…, 3, 3) in kPa at deformation gradients (…, 3, 3)."""
    volume = np.linalg.det(deformation)[..., None, None]
    inverse = np.swapaxes(np.linalg.inv(deformation), -1, -2)
    first = np.sum(deformation**2, axis=(-2, -1))[..., None, None]
    return (
        tissue.shear_kpa * np.cbrt(volume) ** -2 * (deformation - first / 3.0 * inverse)
        + tissue.bulk_kpa * (volume - 1.0) * volume * inverse
    )


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
