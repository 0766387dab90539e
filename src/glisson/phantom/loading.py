"""From the scanned (loaded) shape back to the rest shape, for every voxel."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import map_coordinates

from glisson.core.arrays import FloatArray
from glisson.core.mesh import TetMesh
from glisson.geometry.mapping import PointMap

_KNOT_MM = 5.0


@dataclass(frozen=True, eq=False)
class Loading:
    """The displacement (n, 3) in mm, on a mesh of the rest shape, that the scan's loads make: rest → A."""

    mesh: TetMesh
    displacement: FloatArray
    _map: PointMap = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_map", PointMap(self.mesh, self.displacement))

    @property
    def largest_mm(self) -> float:
        """The longest displacement."""
        return float(np.linalg.norm(self.displacement, axis=1).max())

    def scanned(self, rest_points: ArrayLike) -> FloatArray:
        """Where material points (n, 3) of the rest shape lie in A."""
        return self._map.forward(rest_points)

    def rest_places(self, places: NDArray[np.float32]) -> NDArray[np.float32]:
        """Rest coordinates (i, j, k, 3) of voxels at LPS coordinates (i, j, k, 3) in A.

        The backward displacement is smooth, so it is found on knots 5 mm apart and interpolated between
        them; outside the organ it goes on linearly.
        """
        flat = places.reshape(-1, 3)
        low, high = flat.min(axis=0) - 1.0, flat.max(axis=0) + 1.0
        count = np.ceil((high - low) / _KNOT_MM).astype(int) + 1
        axes = [low[a] + _KNOT_MM * np.arange(count[a]) for a in range(3)]
        knots = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        backward = (self._map.back(knots) - knots).reshape(*count, 3)
        index = ((flat - low) / _KNOT_MM).T
        shift = [map_coordinates(backward[..., a], index, order=1, mode="nearest") for a in range(3)]
        return places + np.stack(shift, axis=-1).reshape(places.shape).astype(np.float32)
