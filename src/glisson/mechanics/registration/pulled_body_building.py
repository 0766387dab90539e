"""Makes the few modes of a body under smooth forces from full solutions, before surgery."""

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.protocols import Progress, silent
from glisson.mechanics.pattern import Stiffness
from glisson.mechanics.reduced.basis import modes
from glisson.mechanics.reduced.building import balancing_points
from glisson.mechanics.reduced.full import FullModel
from glisson.mechanics.reduced.load import Load
from glisson.mechanics.reduced.points import elastic_points, some_points
from glisson.mechanics.reduced.training import from_rest
from glisson.mechanics.registration.pulled_body import PulledBody

_MODES, _POINTS, _TOLERANCE = 60, 400, 3e-4
_SEED = 7


def pulled_body(
    full: FullModel, patch: IntArray, shares: FloatArray, reach_mm: float, loads: int, progress: Progress = silent
) -> PulledBody:
    """The reduced body, made from so many random `loads`.

    Args:
        full: what is reduced.
        patch: (k,) nodes that forces act on.
        shares: (k, b) of them, in any unit; they are scaled.
        reach_mm: how far forces of unit variance move the patch in the mean, were the body linear.
        loads: how many.
        progress: told how far it is.

    Raises:
        StageFailed: the body has no equilibrium under any of them.
    """
    responses = _responses(full, patch, shares)
    scale = reach_mm / float(np.sqrt((responses[:, patch] ** 2).sum(axis=(0, 2)).mean()))
    shares = scale * shares
    random = np.random.default_rng(_SEED)
    drawn = [Load(nodes=patch, forces=shares @ random.normal(size=(shares.shape[1], 3))) for _ in range(loads)]
    displacements = from_rest(full, drawn, progress)
    basis = modes(displacements, _MODES)
    every = elastic_points(full.model.mesh, full.model.materials, basis)
    states = np.tensordot(displacements, basis, 2)
    tangents = [every.stiffness(every.gradients(state)) for state in states]
    chosen = balancing_points(every, states, tangents, _POINTS, _TOLERANCE)
    return PulledBody(full.rest, basis, some_points(every, chosen.points, chosen.factors), patch, shares)


def _responses(full: FullModel, patch: IntArray, shares: FloatArray) -> FloatArray:
    """Linear displacements (3 b, n, 3) by unit amounts, at rest."""
    blocks = np.zeros((full.pattern.block_count, 3, 3))
    full.elasticity.add_stiffness(full.rest, full.pattern, blocks, project=True)
    full.solver.factor(Stiffness(full.pattern, full.system, blocks, full.rest))
    found = []
    for field in shares.T:
        for axis in range(3):
            forces = np.zeros_like(full.rest)
            forces[patch, axis] = field
            answer = full.solver.solve(forces, 0.0)
            assert answer is not None  # a direct solver has factored it
            found.append(answer)
    return np.array(found)
