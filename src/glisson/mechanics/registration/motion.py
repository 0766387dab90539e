"""The ways in which an organ may move: rigidly, and by a basis of displacements on top."""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from scipy.spatial.transform import Rotation

from glisson.core.arrays import FloatArray, IntArray
from glisson.geometry.rotations import nearest_rotation


@dataclass(frozen=True, eq=False)
class MotionState:
    """Where the organ is: rotation (3, 3) about its middle, shift (3,) in mm, and amounts (k,) of the basis."""

    rotation: FloatArray
    shift_mm: FloatArray
    amounts: FloatArray


class Motion(Protocol):
    """A way of moving, with 6 rigid unknowns before k others.

    The rigid ones are a turn (rad times the radius of gyration, hence mm) and a shift (mm) in the observations' frame.
    """

    size: int

    def positions(self, state: MotionState) -> FloatArray:
        """Nodes (n, 3) in the observations' frame."""

    def derivative(self, state: MotionState, nodes: IntArray) -> FloatArray:
        """Derivative (m, 3, size) of the positions of some nodes (m,) by the unknowns."""

    def prior(self, state: MotionState) -> tuple[float, FloatArray, FloatArray]:
        """What the motion costs: half the square, its gradient (size,) and Hessian (size, size)."""

    def moved(self, state: MotionState, step: FloatArray) -> MotionState:
        """The state after a step (size,)."""


class BasisMotion:
    """x = c + R (X + Φ a − c) + t, with a cost of ½ aᵀ P a.

    Args:
        nodes: X (n, 3), mm.
        basis: Φ (n, 3, k).
        precision: P (k, k).
    """

    def __init__(self, nodes: FloatArray, basis: FloatArray | None = None, precision: FloatArray | None = None) -> None:
        self.nodes = nodes
        self.basis = np.zeros((len(nodes), 3, 0)) if basis is None else basis
        self.precision = np.zeros((0, 0)) if precision is None else precision
        self.middle_mm: FloatArray = nodes.mean(axis=0)
        self.radius_mm = float(np.sqrt(((nodes - self.middle_mm) ** 2).sum(axis=1).mean()))
        self.size = 6 + self.basis.shape[2]

    def at_rest(self) -> MotionState:
        """Where the scan was taken."""
        return MotionState(np.eye(3), np.zeros(3), np.zeros(self.size - 6))

    def nearest(self, positions: FloatArray) -> MotionState:
        """A state whose nodes are at some positions (n, 3), or near: turned as fits best, then deformed."""
        arms, middle = self.nodes - self.middle_mm, positions.mean(axis=0)
        rotation = nearest_rotation((positions - middle).T @ arms)
        left = (positions - middle) @ rotation - arms
        flat = self.basis.reshape(self.nodes.size, self.size - 6)
        amounts: FloatArray = np.linalg.solve(flat.T @ flat, flat.T @ left.ravel())
        return MotionState(rotation, middle - self.middle_mm, amounts)

    def positions(self, state: MotionState) -> FloatArray:
        """See `Motion`."""
        return (self.shape(state.amounts) - self.middle_mm) @ state.rotation.T + self.middle_mm + state.shift_mm

    def shape(self, amounts: FloatArray) -> FloatArray:
        """Nodes (n, 3) of the organ that has deformed but not moved."""
        return self.nodes + self.basis @ amounts

    def slopes(self, amounts: FloatArray, nodes: IntArray) -> FloatArray:
        """Derivative (m, 3, k) of that at some nodes (m,)."""
        return self.basis[nodes]

    def derivative(self, state: MotionState, nodes: IntArray) -> FloatArray:
        """See `Motion`."""
        arms = (self.shape(state.amounts)[nodes] - self.middle_mm) @ state.rotation.T
        result = np.zeros((len(nodes), 3, self.size))
        result[:, :, :3] = np.cross(np.eye(3)[None], arms[:, None, :]).transpose(0, 2, 1) / self.radius_mm
        result[:, :, 3:6] = np.eye(3)
        result[:, :, 6:] = state.rotation @ self.slopes(state.amounts, nodes)
        return result

    def prior(self, state: MotionState) -> tuple[float, FloatArray, FloatArray]:
        """See `Motion`."""
        pull = self.precision @ state.amounts
        gradient, hessian = np.zeros(self.size), np.zeros((self.size, self.size))
        gradient[6:], hessian[6:, 6:] = pull, self.precision
        return 0.5 * float(state.amounts @ pull), gradient, hessian

    def moved(self, state: MotionState, step: FloatArray) -> MotionState:
        """See `Motion`."""
        turn = Rotation.from_rotvec(step[:3] / self.radius_mm).as_matrix()
        return replace(
            state,
            rotation=turn @ state.rotation,
            shift_mm=state.shift_mm + step[3:6],
            amounts=state.amounts + step[6:],
        )
