"""How sure a fit is: the Gauss–Newton posterior, made honest.

Two things that the posterior by itself leaves out are added: how much the organ turned out to strain, and what the
model cannot follow however well it is fitted, also where nothing was seen.
"""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.mesh import TetMesh
from glisson.geometry.spreading import evenly_spread
from glisson.mechanics.registration.fitting import Fit
from glisson.mechanics.registration.motion import Motion
from glisson.mechanics.registration.seen import ModelError

_LEAST_PRECISION = 1e-6
"""Per mm²: what nothing determines has a standard deviation of a metre."""

_USUAL_MODES = 2.0
"""What is expected of the organ's deformation before anything is seen counts as much as so many ways of deforming that
were seen."""

INFLATION = 1.28
"""Standard deviations are multiplied by this, fitted with `tractions` on cases of livers 600 to 619 of the sparse-data
twin so that 90 % regions hold 90 % of their targets; none of these livers is reported (docs/registration.md)."""

_MOST_PATCHES = 60


def spread_by(hessian: FloatArray, motion: Motion, found: Fit) -> FloatArray:
    """Motion of all nodes (n, 3, size) by independent unknowns of unit variance, from a Hessian (size, size)."""
    values, vectors = np.linalg.eigh(hessian)
    root = vectors / np.sqrt(np.maximum(values, _LEAST_PRECISION))
    nodes = np.arange(len(motion.positions(found.state)))
    spread: FloatArray = motion.derivative(found.state, nodes) @ root
    return spread


def posterior_spread(motion: Motion, found: Fit, usual: float) -> FloatArray:
    """The same of an organ that moves rigidly and deforms at a cost.

    The covariance is the inverse of the Gauss–Newton Hessian, in which the prior is as wide as the organ's own
    deformation says: the cost of the ways of deforming that were seen tells that of the others (empirical Bayes;
    MacKay 1992, Neural Computation 4:415). An organ that hardly deforms where it is seen hardly does so elsewhere.

    Args:
        motion: the ways to move.
        found: where it came to rest.
        usual: the share of what the motion's prior allows that is expected before anything is seen.
    """
    cost, _, prior = motion.prior(found.state)
    held = found.hessian + _LEAST_PRECISION * np.eye(motion.size)
    seen = motion.size - 6 - float(np.trace(np.linalg.solve(held, prior)))
    share = (_USUAL_MODES * usual + 2.0 * cost) / (_USUAL_MODES + seen)
    return spread_by(found.hessian + (1.0 / share - 1.0) * prior, motion, found)


def model_error_spread(mesh: TetMesh, error: ModelError) -> FloatArray:
    """A random field (n, 3, k) of the model's error, as independent unknowns of unit variance.

    Every node is off by the error's standard deviation, and nodes nearer than its length (in large organs somewhat
    more) are off alike: the field is a moving average of independent patches.
    """
    count = int(np.clip(mesh.volume_mm3 / error.length_mm**3, 1, min(_MOST_PATCHES, len(mesh.nodes))))
    patches = mesh.nodes[evenly_spread(mesh.nodes, count)]
    width = (mesh.volume_mm3 / count) ** (1.0 / 3.0)
    squared = ((mesh.nodes[:, None] - patches[None]) ** 2).sum(axis=2)
    # The nearest patch counts most, so that no node is without one.
    weights = np.exp(-0.5 * (squared - squared.min(axis=1, keepdims=True)) / width**2)
    weights *= error.sigma_mm / np.linalg.norm(weights, axis=1, keepdims=True)
    field: FloatArray = np.einsum("np,ij->nipj", weights, np.eye(3)).reshape(len(mesh.nodes), 3, -1)
    return field
