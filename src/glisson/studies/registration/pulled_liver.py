"""The public sequences of a pulled liver (Mestdagh and Cotin 2022) as models and observations to be registered."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TET_EDGES, TetMesh
from glisson.core.model import Material, Model
from glisson.core.observations import Observation, Observations
from glisson.geometry.location import PointLocator
from glisson.geometry.quadratic import straight_boundary
from glisson.io.mestdagh import PulledSequence, read_pulled_mesh, read_pulled_sequence

HELD, PULLED, VISIBLE = "held", "pulled", "visible"
YOUNG_KPA, POISSON = 4.5, 0.49
"""Published for the neo-Hookean sequences; those of the linear one are not."""

_CLOUD_MM = 0.05  # standard deviation of cloud points, which lie on the true surface


@dataclass(frozen=True, eq=False)
class PulledLiver:
    """One sequence: a model on the mesh for whoever reconstructs, what was seen (f), and the truth.

    `true_positions` (f, m, 3) mm are those of material points that lie at `points_mm` (m, 3) at rest, `true_forces`
    (f, 3) mN what the tool pulls with in all.
    """

    model: Model
    observations: tuple[Observations, ...]
    points_mm: FloatArray
    true_positions: FloatArray
    true_forces: FloatArray

    def errors_mm(self, positions: FloatArray, frame: int) -> FloatArray:
        """How far the material points (m,) are off with the model's nodes at `positions` (n, 3)."""
        locator = PointLocator(self.model.mesh)
        location = locator.locate(self.points_mm)
        places = locator.interpolate(location, positions)
        errors: FloatArray = np.linalg.norm(places - self.true_positions[frame], axis=1)
        return errors


def read_pulled_liver(folder: Path, sequence: str, law: str, quadratic: bool) -> PulledLiver:
    """A sequence such as "neohookean-s1", to be reconstructed with a material law, on T4 or T10.

    Raises:
        BadInput: a file is absent or damaged.
    """
    default, remeshed = read_pulled_mesh(folder, "default"), read_pulled_mesh(folder, "remeshed")
    pulled = read_pulled_sequence(folder / f"sequences-{sequence}.tar.xz")
    mesh = remeshed.mesh.as_quadratic() if quadratic else remeshed.mesh
    sets = {HELD: remeshed.held, PULLED: pulled.candidates, VISIBLE: np.unique(remeshed.triangles)}
    model = Model(
        mesh,
        {0: Material(law, YOUNG_KPA, POISSON)},
        {0: "liver"},
        {name: _with_middles(mesh, nodes) for name, nodes in sets.items()},
    )
    return PulledLiver(model, _seen(pulled), default.mesh.nodes, pulled.positions, pulled.forces)


def _seen(pulled: PulledSequence) -> tuple[Observations, ...]:
    return tuple(Observations((Observation("surface", VISIBLE, cloud, _CLOUD_MM),)) for cloud in pulled.clouds)


def _with_middles(mesh: TetMesh, nodes: IntArray) -> IntArray:
    """Corner nodes of the surface, and the T10 nodes of it between two of them."""
    if not mesh.is_quadratic:
        return nodes
    edges = mesh.corners[:, TET_EDGES]
    between = mesh.tetrahedra[:, 4:][np.isin(edges, nodes).all(axis=2)]
    return np.union1d(nodes, np.intersect1d(between, straight_boundary(mesh)[0]))
