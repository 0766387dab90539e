"""The problem that every engine solves: a soft ellipsoid under its weight, clamped at one end, lifted at the other.

Units: mm, kPa, mN (1 kPa·mm² = 1 mN). This file needs numpy only, so that every engine's environment can read it.

A neo-Hookean ellipsoid about as large as a liver has its long axis along x. Nodes of its surface with x < −30 mm
are clamped; those within 20 mm of the tip (+100, 0, 0) are carried upwards (+z) by 30 mm and held there. The weight
acts along −z. Lift and weight grow together in four equal load steps; each must reach a residual of 1e-6.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

SEMI_AXES_MM = np.array([100.0, 70.0, 50.0])
CLAMPED_BELOW_X_MM = -30.0
PATCH_RADIUS_MM = 20.0
LIFT_MM = 30.0
STEPS = 4
TOLERANCE = 1e-6
"""Norm of the residual on the free nodes over the larger norm of internal (with reactions) and external forces."""

YOUNG_MODULUS_KPA = 8.0
POISSON_RATIO = 0.45
DENSITY_KG_M3 = 1150.0
SHEAR_KPA = YOUNG_MODULUS_KPA / (2.0 * (1.0 + POISSON_RATIO))
BULK_KPA = YOUNG_MODULUS_KPA / (3.0 * (1.0 - 2.0 * POISSON_RATIO))
"""W = µ/2 (J^(−2/3) I1 − 3) + κ/2 (J − 1)²."""

WEIGHT_MN_MM3 = DENSITY_KG_M3 * 1e-9 * 9806.65


@dataclass(frozen=True, eq=False)
class Problem:
    """Nodes (n, 3) mm, tetrahedra (m, 4 or 10), and the numbers of the clamped and of the carried nodes.

    T10 nodes 5 to 10 are the middles of the edges 01, 12, 02, 03, 13, 23 (as in VTK and CalculiX).
    """

    nodes: NDArray[np.float64]
    tetrahedra: NDArray[np.int64]
    clamped: NDArray[np.int64]
    carried: NDArray[np.int64]

    @property
    def order(self) -> int:
        """Polynomial order of the elements: 1 for T4, 2 for T10."""
        return 1 if self.tetrahedra.shape[1] == 4 else 2

    @property
    def held(self) -> NDArray[np.int64]:
        """Numbers of all nodes whose displacement is given."""
        return np.concatenate([self.clamped, self.carried])

    @property
    def free(self) -> NDArray[np.bool_]:
        """Which nodes (n,) are free."""
        mask = np.ones(len(self.nodes), dtype=bool)
        mask[self.held] = False
        return mask

    def step(self) -> NDArray[np.float64]:
        """The displacement (n, 3) of held nodes in one load step; zero elsewhere."""
        moved = np.zeros_like(self.nodes)
        moved[self.carried, 2] = LIFT_MM / STEPS
        return moved


def load_problem(path: Path) -> Problem:
    """A problem from a file of `meshes.py`."""
    with np.load(path) as stored:
        return Problem(*(stored[name] for name in ("nodes", "tetrahedra", "clamped", "carried")))
