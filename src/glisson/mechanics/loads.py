"""What a scenario does to a model's nodes: weights, and what is held."""

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.model import Model
from glisson.core.units import STANDARD_GRAVITY_MM_S2, density_from_kg_m3
from glisson.mechanics.elements import nodal_volumes


def gravity_forces(model: Model, direction: FloatArray | None) -> FloatArray:
    """Weight of the scanned shape as nodal forces (n, 3) in mN along a unit direction (None: weightless)."""
    if direction is None:
        return np.zeros_like(model.mesh.nodes)
    densities = {n: density_from_kg_m3(m.density_kg_m3) for n, m in model.materials.items()}
    factors = np.array([densities[int(region)] for region in model.mesh.region_numbers])
    masses = nodal_volumes(model.mesh.nodes, model.mesh, factors)
    weights: FloatArray = masses[:, None] * STANDARD_GRAVITY_MM_S2 * direction
    return weights


def fixed_unknowns(model: Model, names: tuple[str, ...]) -> NDArray[np.bool_]:
    """Which unknowns (n, 3) the named node sets hold.

    Raises:
        BadInput: the model has no such set.
    """
    fixed = np.zeros(model.mesh.nodes.shape, dtype=bool)
    for name in names:
        fixed[model.node_set(name)] = True
    return fixed
