"""The organ's capsule: an incompressible neo-Hookean membrane on its whole surface.

W = µ/2 (tr C + 1 / det C − 3) per volume, with C (2, 2) of the surface alone: the thickness follows from
incompressibility, and the stress across it is zero (Bonet et al. 2000, Int. J. Solids Structures 37).
"""

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TetMesh
from glisson.core.model import Capsule
from glisson.mechanics.elements import triangle_rule
from glisson.mechanics.faces import face_nodes, face_slopes
from glisson.mechanics.parts import Memoryless


class Membrane(Memoryless):
    """A `Part`, free of stress in A."""

    def __init__(self, mesh: TetMesh, capsule: Capsule) -> None:
        self._faces = face_nodes(mesh)
        points, weights = triangle_rule(1)
        slopes = face_slopes(points, mesh.is_quadratic)
        tangents = np.einsum("qad,fai->fqdi", slopes, mesh.nodes[self._faces])
        first = tangents[:, :, 0] / np.linalg.norm(tangents[:, :, 0], axis=2, keepdims=True)
        normal = np.cross(tangents[:, :, 0], tangents[:, :, 1])
        doubled = np.linalg.norm(normal, axis=2)
        second = np.cross(normal / doubled[:, :, None], first)
        # Coordinates of the tangents in a flat frame of each point; gradients follow from their inverse.
        flat = np.einsum("fqdi,fqei->fqed", tangents, np.stack([first, second], axis=2))
        self._gradients = np.einsum("qad,fqde->fqae", slopes, np.linalg.inv(flat))
        shear_modulus = capsule.young_modulus_kpa / 3.0
        self._weights = shear_modulus * capsule.thickness_mm * 0.5 * doubled * weights

    def energy(self, positions: FloatArray) -> float:
        """Energy in µJ."""
        metric = _metric(self._deformation(positions))
        density = np.einsum("fqdd->fq", metric) + 1.0 / np.linalg.det(metric) - 3.0
        return 0.5 * float(np.vdot(self._weights, density))

    def forces(self, positions: FloatArray) -> FloatArray:
        """Forces (n, 3) in mN."""
        deformation = self._deformation(positions)
        metric = _metric(deformation)
        inner = np.eye(2) - np.linalg.inv(metric) / np.linalg.det(metric)[..., None, None]
        pulls = np.einsum("fq,fqid,fqde,fqae->fai", self._weights, deformation, inner, self._gradients)
        forces = np.zeros_like(positions)
        np.add.at(forces, self._faces, -pulls)
        return forces

    def stiffness(self, positions: FloatArray, project: bool) -> tuple[IntArray, FloatArray]:
        """Blocks of the faces; with `project` the negative eigenvalues of each point's tangent (6, 6) are cut."""
        tangent = _tangent(self._deformation(positions))
        if project:
            values, vectors = np.linalg.eigh(tangent.reshape(*tangent.shape[:2], 6, 6))
            definite = (vectors * np.maximum(values, 0.0)[..., None, :]) @ vectors.swapaxes(2, 3)
            tangent = definite.reshape(tangent.shape)
        half = np.einsum("fqidke,fqbe->fqidkb", tangent, self._gradients)
        local = np.einsum("fq,fqad,fqidkb->fabik", self._weights, self._gradients, half)
        return self._faces, local

    def _deformation(self, positions: FloatArray) -> FloatArray:
        """F (f, q, 3, 2): the flat frame's axes, carried along."""
        deformation: FloatArray = np.einsum("fai,fqae->fqie", positions[self._faces], self._gradients)
        return deformation


def _metric(deformation: FloatArray) -> FloatArray:
    metric: FloatArray = np.einsum("fqid,fqie->fqde", deformation, deformation)
    return metric


def _tangent(deformation: FloatArray) -> FloatArray:
    """∂P/∂F (f, q, 3, 2, 3, 2) of P = F (1 − q C⁻¹) with q = 1 / det C."""
    metric = _metric(deformation)
    inverse = np.linalg.inv(metric)
    share = 1.0 / np.linalg.det(metric)
    lifted = np.einsum("fqid,fqde->fqie", deformation, inverse)  # F C⁻¹
    across = np.einsum("fqie,fqke->fqik", lifted, deformation)  # F C⁻¹ Fᵀ
    tangent = np.einsum("ik,fqde->fqidke", np.eye(3), np.eye(2) - share[..., None, None] * inverse)
    curved = 2.0 * np.einsum("fqid,fqke->fqidke", lifted, lifted)
    curved += np.einsum("fqie,fqkd->fqidke", lifted, lifted)
    curved += np.einsum("fqik,fqed->fqidke", across, inverse)
    result: FloatArray = tangent + share[..., None, None, None, None] * curved
    return result
