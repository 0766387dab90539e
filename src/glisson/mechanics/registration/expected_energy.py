"""How much strain energy an organ is expected to hold."""

import numpy as np

from glisson.core.model import Model

_MODES = 10
"""Ways of deforming among which the energy is shared: about as many are seen in deformed livers."""


def energy_per_mode_uj(model: Model, strain: float) -> float:
    """Twice the energy that one way of deforming has in the mean, where the whole organ has a typical strain."""
    volumes = model.mesh.corner_volumes_mm3
    moduli = np.array([model.materials[int(number)].young_modulus_kpa for number in model.mesh.region_numbers])
    return float(moduli @ volumes) * strain**2 / _MODES
