"""Makes a reduced model from full solutions."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from glisson.core.arrays import FloatArray, IntArray
from glisson.geometry.spreading import evenly_spread
from glisson.mechanics.reduced.basis import modes
from glisson.mechanics.reduced.contact import reduced_surface
from glisson.mechanics.reduced.cubature import Cubature, choose_points
from glisson.mechanics.reduced.estimate import ErrorEstimate, with_tangent
from glisson.mechanics.reduced.full import FullModel
from glisson.mechanics.reduced.local import local_compliance
from glisson.mechanics.reduced.model import ReducedModel
from glisson.mechanics.reduced.points import ElasticPoints, elastic_points, some_points

_STATES = 250  # at which forces are compared, at most
_LEAST = 1e-5  # eigenvalue of a stiffness, as a share of its largest
_SENTINELS = 200
_EQUATIONS = 6  # mixed ones for each point that may be chosen


@dataclass(frozen=True)
class Sizes:
    """Unknowns r and points of the solution, modes R and points of its error estimate, and how exact points are."""

    unknowns: int = 60
    points: int = 400
    estimate_unknowns: int = 150
    estimate_points: int = 1000
    tolerance: float = 3e-4


def build_reduced(full: FullModel, displacements: FloatArray, reach: IntArray, sizes: Sizes) -> ReducedModel:
    """A reduced model, its estimate not calibrated yet.

    Args:
        full: what is reduced.
        displacements: (s, n, 3) of full solutions, in mm.
        reach: (k,) the nodes of the surface that tools may touch.
        sizes: of the reduced model.
    """
    basis = modes(displacements, sizes.estimate_unknowns)
    count = min(sizes.unknowns, basis.shape[2])
    basis = _uncoupled(full, basis, count)
    every = elastic_points(full.model.mesh, full.model.materials, basis)
    stiffness = every.stiffness(every.gradients(np.zeros(basis.shape[2])))
    amounts = np.linalg.lstsq(basis.reshape(-1, basis.shape[2]), displacements.reshape(len(displacements), -1).T)[0]
    states = np.ascontiguousarray(amounts.T)
    few = ElasticPoints(
        np.ascontiguousarray(every.strains[:, :, :count]), every.weights, every.regions, every.materials
    )
    some = states[np.random.default_rng(0).permutation(len(states))[:_STATES]]
    tangents = [few.stiffness(few.gradients(state[:count])) for state in some]
    chosen = balancing_points(few, some[:, :count], tangents, sizes.points, sizes.tolerance)
    in_all = [with_tangent(stiffness, tangent) for tangent in tangents]
    estimating = balancing_points(every, some, in_all, sizes.estimate_points, sizes.tolerance)
    mesh, surface = full.model.mesh, full.surface
    skin = np.unique(surface.nodes)
    seen = some_points(every, estimating.points, estimating.factors)
    estimate = ErrorEstimate(
        replace(seen, strains=seen.strains.astype(np.float32)),  # read twice as fast, and good enough for a residual
        stiffness,
        basis[skin[evenly_spread(mesh.nodes[skin], _SENTINELS)]],
    )
    return ReducedModel(
        full.rest,
        basis,
        some_points(few, chosen.points, chosen.factors),
        reduced_surface(mesh, surface, basis, reach),
        local_compliance(full, reach, basis[:, :, :count]),
        np.tensordot(full.weights, basis, 2),
        full.cushion,
        estimate,
    )


def _uncoupled(full: FullModel, basis: FloatArray, count: int) -> FloatArray:
    """The modes (n, 3, R), those after the first `count` replaced by what these don't answer at rest, of unit length.

    Stiffness at rest then couples both not at all, and any of the first ones can be joined with it.
    """
    points = elastic_points(full.model.mesh, full.model.materials, basis)
    stiffness = points.stiffness(points.gradients(np.zeros(basis.shape[2])))
    first, others = basis[:, :, :count], basis[:, :, count:]
    others = others - first @ np.linalg.solve(stiffness[:count, :count], stiffness[:count, count:])
    others /= np.linalg.norm(others, axis=(0, 1))
    return np.concatenate([first, others], axis=2)


def balancing_points(
    points: ElasticPoints, states: FloatArray, tangents: Sequence[FloatArray], most: int, tolerance: float
) -> Cubature:
    """Points that make the forces of all at the states (s, r), whose stiffness (r, r) is that of `tangents`.

    Forces count by the displacement that they make there, as a share of the state's. The equations, r for each state,
    are summed with random signs to as many as choosing needs.
    """
    random = np.random.default_rng(0)
    rows = min(states.size, _EQUATIONS * most)
    mixed = np.zeros((rows, len(points.weights)))
    for state, tangent in zip(states, tangents, strict=True):
        forces = np.einsum("pk,pkr->rp", points.stresses(points.gradients(state)), points.strains)
        made = cho_solve(cho_factor(_definite(tangent)), forces) / np.linalg.norm(state)
        into = random.choice(rows, len(state), replace=False)
        mixed[into] += random.choice([-1.0, 1.0], len(state))[:, None] * made
    return choose_points(mixed, tolerance, most)


def _definite(matrix: FloatArray) -> FloatArray:
    """The matrix with its least eigenvalues raised: what buckles without its tool is still stiff with it."""
    values, vectors = np.linalg.eigh(matrix)
    result: FloatArray = (vectors * np.maximum(values, _LEAST * values[-1])) @ vectors.T
    return result
