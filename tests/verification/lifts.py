"""The lever lift on a small slab of liver that lies on a board and is held at its back."""

import numpy as np

from glisson.core import Board, ContactLaw, Deformation, Lever, LeverDrive, Material, Model, Scenario, Stage
from glisson.geometry.boxes import box_mesh
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters
from glisson.verification.bodies import box_model

DOWN = np.array([0.0, 0.0, -1.0])
BOARD = Board("board", np.zeros(3), -DOWN)
SIZES = (120.0, 50.0, 25.0)


def slab_lever(across: float = 20.0, height: float = 0.0, width_mm: float = 25.0) -> Lever:
    """A lever along x whose hinge lies `across` the slab (0 to 50 mm) and `height` over the board."""
    arm, hinge = np.array([1.0, 0.0, 0.0]), np.array([55.0, across, height])
    return Lever.lifting("lever", hinge, arm, -DOWN, length_mm=70.0, width_mm=width_mm)


# Wide and centred: a narrow one lets the slab roll to either side, two states a hair apart.
WIDE = slab_lever(across=25.0, width_mm=60.0)


def slab(young_modulus_kpa: float, counts=(8, 3, 2), poisson_ratio=0.45) -> Model:
    mesh = box_mesh(SIZES, counts)
    back = np.flatnonzero(mesh.nodes[:, 0] < 1e-9)
    return box_model(mesh, Material("neo-hookean", young_modulus_kpa, poisson_ratio), back=back)


def lift(model: Model, drive: LeverDrive, lever: Lever | None = None, cohesion_kpa=10.0, **parameters) -> Deformation:
    """Sticky while the lever rises, plain friction afterwards (the second stage of the dissertation)."""
    stages = (
        Stage("stage 1", ContactLaw(0.1, cohesion_kpa), (drive,)),
        Stage("stage 2", ContactLaw(0.1)),
    )
    scenario = Scenario((BOARD, lever or slab_lever()), stages, DOWN, DOWN, ("board",))
    return QuasiStatic(QuasiStaticParameters(**parameters)).solve(model, scenario)
