"""The problem: the two-stage lever lift with friction of the phantom family's member 3, whose liver is homogeneous.

The liver (E = 7 kPa, ν = 0.45, 1150 kg/m³) lies on a board, where the scan shows it loaded (A). A lever in a slot of
the board lifts its left lobe by 22° with contact that sticks (stage 1), and the lobe settles under plain friction of
0.1 (stage 2). See `glisson.phantom.lever_lift`.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from glisson.core.mesh import TetMesh
from glisson.core.model import Material, Model
from glisson.core.scenario import Scenario
from glisson.phantom.lever_lift import lever_lift
from glisson.phantom.proportions import draw_proportions
from glisson.studies.lifts import lift_model

MEMBER = 3
LIVER = Material("neo-hookean", 7.0, 0.45)


@dataclass(frozen=True, eq=False)
class Problem:
    """Nodes of A and of the unloaded shape (n, 3) mm, tetrahedra (m, 4 or 10), and numbers of nodes.

    `held` are the corners that are held, `inside` those nodes that no tool and no attachment can touch, and `watched`
    those within 15 mm of the tumour's centre.
    """

    scanned: NDArray[np.float64]
    unloaded: NDArray[np.float64]
    tetrahedra: NDArray[np.int64]
    held: NDArray[np.int64]
    inside: NDArray[np.int64]
    watched: NDArray[np.int64]

    @property
    def element(self) -> str:
        """T4 or T10."""
        return "T4" if self.tetrahedra.shape[1] == 4 else "T10"

    @property
    def corner_mesh(self) -> TetMesh:
        """A with linear elements."""
        corners = self.tetrahedra[:, :4]
        return TetMesh(self.scanned[: int(corners.max()) + 1], corners)


def model_of(mesh: TetMesh) -> Model:
    """The model of a mesh of A."""
    return lift_model(mesh, LIVER)


def scenario() -> Scenario:
    """Board, lever, and the two stages."""
    return lever_lift(draw_proportions(MEMBER))


def load_problem(path: Path) -> Problem:
    """A problem from a file of `meshes.py`."""
    names = ("scanned", "unloaded", "tetrahedra", "held", "inside", "watched")
    with np.load(path) as stored:
        return Problem(*(stored[name] for name in names))
