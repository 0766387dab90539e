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

_MODES, _POINTS, _TOLERANCE = 80, 500, 3e-4
_SEED = 7
_SIZES = (0.4, 1.6)  # of displacements that are learned from, in what is expected
_WIDTHS = (0.15, 0.8)  # of graspers, in the size of the patch


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
    on_patch = responses[:, patch].reshape(shares.shape[1], 3, len(patch), 3)
    scale = reach_mm / float(np.sqrt((on_patch**2).sum(axis=(0, 1, 3)).mean()))
    random = np.random.default_rng(_SEED)
    drawn = []
    for _ in range(loads):
        pull = _grasp(full.rest[patch], shares, random)
        moved = np.einsum("bi,bikj->kj", pull, on_patch)
        size = random.uniform(*_SIZES) * reach_mm / float(np.linalg.norm(moved, axis=1).max())
        drawn.append(Load(nodes=patch, forces=size * shares @ pull))
    displacements = from_rest(full, drawn, progress)
    # What is small and turns little is linear, and costs nothing more to have exactly.
    basis = modes(np.concatenate([displacements, scale * responses]), _MODES)
    every = elastic_points(full.model.mesh, full.model.materials, basis)
    states = np.tensordot(displacements, basis, 2)
    tangents = [every.stiffness(every.gradients(state)) for state in states]
    chosen = balancing_points(every, states, tangents, _POINTS, _TOLERANCE)
    return PulledBody(full.rest, basis, some_points(every, chosen.points, chosen.factors), patch, scale * shares)


def _grasp(places: FloatArray, shares: FloatArray, random: np.random.Generator) -> FloatArray:
    """Amounts (b, 3) of a grasper that pulls one way, somewhere on the patch (k, 3), over a random width."""
    apart = np.linalg.norm(places - places[random.integers(len(places))], axis=1)
    width = random.uniform(*_WIDTHS) * float(apart.max())
    pressed = np.exp(-0.5 * (apart / width) ** 2)
    return np.outer(np.linalg.lstsq(shares, pressed, rcond=None)[0], random.normal(size=3))


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
