"""What distinguishes one member of the family from another: lengths drawn from a seed.

Organ coordinates are patient LPS mm with the board (the flat underside) at y = 0, the organ at y < 0,
and the hilum near x = z = 0. The nominal member is some 230 mm wide (x), 65 mm thick (y), 150 mm tall (z).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from glisson.core.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Proportions:
    """Stretches against the nominal member, the lobes' own variation, undulation, tumour and wire.

    `right`, `left`, `thick` and `tall` stretch x < 0, x > 0, y and z; `lobes` (3, 3) multiplies the
    semi-axes of the right lobe, the bridge and the left lobe. `waves` (k, 3) in rad/mm with `phases` (k,)
    make bumps of `bump_mm` on the upper surface. `station` is the place of the tumour along the duct
    (0 mouth, 1 end), `gap_mm` its distance from the duct's wall.
    """

    right: float
    left: float
    thick: float
    tall: float
    lobes: FloatArray
    waves: FloatArray
    phases: FloatArray
    bump_mm: float
    tumour_radii_mm: FloatArray
    station: float
    gap_mm: float
    second_tumour: bool

    def place(self, nominal: ArrayLike) -> FloatArray:
        """Points (..., 3) of this member from the nominal member's; the left stretch sets in smoothly."""
        points = np.array(nominal, dtype=np.float64)
        x = points[..., 0]
        # Softplus over 10 mm: slope `right` far to the right, `left` far to the left of the patient.
        bend = 10.0 * (np.logaddexp(0.0, x / 10.0) - np.log(2.0))
        points[..., 0] = self.right * x + (self.left - self.right) * bend
        points[..., 1] *= self.thick
        points[..., 2] *= self.tall
        return points


def draw_proportions(seed: int) -> Proportions:
    """The proportions of member `seed` (any whole number ≥ 0)."""
    random = np.random.default_rng(seed)
    directions = random.normal(size=(6, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    lengths = random.uniform(45.0, 95.0, size=(6, 1))
    return Proportions(
        right=float(random.uniform(0.95, 1.04)),
        left=float(random.uniform(0.92, 1.06)),
        thick=float(random.uniform(0.97, 1.06)),
        tall=float(random.uniform(0.95, 1.04)),
        lobes=random.uniform(0.97, 1.03, size=(3, 3)),
        waves=2.0 * np.pi * directions / lengths,
        phases=random.uniform(0.0, 2.0 * np.pi, size=6),
        bump_mm=float(random.uniform(0.3, 0.7)),
        tumour_radii_mm=random.uniform(8.5, 11.5) * random.uniform(0.93, 1.07, size=3),
        station=float(random.uniform(0.72, 0.81)),
        gap_mm=float(random.uniform(1.5, 3.0)),
        second_tumour=bool(random.uniform() < 0.4),
    )
