"""A duct's centreline as a smooth curve that moves with the organ."""

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TetMesh
from glisson.core.structures import Curve
from glisson.geometry.location import PointLocator
from glisson.geometry.wire import Wire

_KNOT_MM = 6.0  # between the material points that carry the curve; voxel steps of a traced duct are much shorter
_DEGREE = 3


class DuctPath:
    """c(s) = Σ φ_k(s) P_k through material points P_k, and with them linear in the node positions.

    s in mm is the arc length of A from the mouth; before the mouth and behind the end the curve goes on straight.

    Args:
        mesh: the organ in A.
        duct: its centreline, from the mouth inward.
        length_mm: how far it is followed at least.
    """

    def __init__(self, mesh: TetMesh, duct: Curve, length_mm: float) -> None:
        self.length_mm = max(float(length_mm), duct.length_mm)
        count = max(round(self.length_mm / _KNOT_MM), _DEGREE) + 1
        knots = np.linspace(0.0, self.length_mm, count)
        points = Wire(duct.points_mm, self.length_mm).at(knots)
        locator = PointLocator(mesh)
        location = locator.locate(points)
        hosts = mesh.tetrahedra[location.elements]
        self.nodes: IntArray = np.unique(hosts)
        """Nodes (a,) on which the curve depends."""
        carried = np.zeros((count, len(self.nodes)))
        np.put_along_axis(carried, np.searchsorted(self.nodes, hosts), locator.weights(location), axis=1)
        # Exact in A for points outside the mesh as well.
        self._constant = points - carried @ mesh.nodes[self.nodes]
        self._carried = carried
        degree = min(_DEGREE, count - 1)
        self._basis: BSpline = make_interp_spline(knots, np.eye(count), degree)

    def weights(self, arcs_mm: FloatArray, order: int) -> FloatArray:
        """∂ʳ/∂sʳ of the curve's dependence on its nodes (m, a), for `order` r up to 2."""
        weights: FloatArray = self._shares(arcs_mm, order) @ self._carried
        return weights

    def places(self, positions: FloatArray, arcs_mm: FloatArray, order: int = 0) -> FloatArray:
        """∂ʳc/∂sʳ (m, 3) at the node positions (n, 3) of the organ."""
        points = self._carried @ positions[self.nodes] + self._constant
        places: FloatArray = self._shares(arcs_mm, order) @ points
        return places

    def _shares(self, arcs_mm: FloatArray, order: int) -> FloatArray:
        """∂ʳφ_k/∂sʳ, (m, k)."""
        within = np.clip(arcs_mm, 0.0, self.length_mm)
        beyond = (arcs_mm - within)[:, None]
        if order == 0:
            return np.asarray(self._basis(within) + beyond * self._basis(within, 1))
        shares = np.asarray(self._basis(within, order))
        return np.where(beyond != 0.0, 0.0, shares) if order == 2 else shares
