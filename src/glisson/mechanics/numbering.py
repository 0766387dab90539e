"""Numbers nodes along the organ's longest side, so that what is near in the body is near in memory."""

from dataclasses import dataclass, replace

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.deformation import Deformation
from glisson.core.mesh import TetMesh
from glisson.core.model import Model


@dataclass(frozen=True, eq=False)
class Numbering:
    """`old` (n,) are the former numbers of the nodes in their new order, `new` (n,) the new numbers in the former."""

    old: IntArray
    new: IntArray

    def model(self, model: Model) -> Model:
        """The model with nodes in the new order, and elements in that of their first nodes."""
        mesh = model.mesh
        tetrahedra = self.new[mesh.tetrahedra]
        elements = np.argsort(tetrahedra.min(axis=1), kind="stable")
        ordered = TetMesh(mesh.nodes[self.old], tetrahedra[elements], mesh.region_numbers[elements])
        return replace(
            model, mesh=ordered, node_sets={name: self.new[nodes] for name, nodes in model.node_sets.items()}
        )

    def deformation(self, deformation: Deformation, mesh: TetMesh) -> Deformation:
        """A deformation of the ordered model as one of the former `mesh`."""
        stages = tuple(replace(s, displacement=s.displacement[self.new]) for s in deformation.stages)
        error = deformation.estimated_error
        return replace(
            deformation, mesh=mesh, stages=stages, estimated_error=None if error is None else error[self.new]
        )


def numbering(nodes: FloatArray) -> Numbering:
    """Nodes (n, 3) in order along the longest side of their box."""
    old = np.argsort(nodes[:, int(np.ptp(nodes, axis=0).argmax())], kind="stable")
    new = np.zeros_like(old)
    new[old] = np.arange(len(old))
    return Numbering(old, new)
