"""Where the liver's ligaments, the vena cava and the hilum hold it, proposed from its shape.

Each is a window of the organ's extent and the side that its surface faces there: a first proposal, since ligaments do
not show in a scan. The windows follow the anatomy as Abdel-Misih and Bloomston describe it (2010, Surg. Clin. N. Am.
90:643). The hilum (porta hepatis), where the hepatoduodenal ligament enters, is the hollow of the visceral surface.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from glisson.core.arrays import FloatArray

_Range = tuple[float, float]


@dataclass(frozen=True)
class Window:
    """A part of the surface by fractions of the organ's extent and by its outward normal.

    Fractions run along LPS: from the right side (0) to the left (1), from the front to the back, from the feet to the
    head. `facing` is a direction in LPS to which the normal must be at most `_WIDEST_DEG` away.
    """

    right_to_left: _Range
    front_to_back: _Range
    feet_to_head: _Range
    facing: tuple[float, float, float]

    def chosen(self, points_mm: FloatArray, normals: FloatArray) -> NDArray[np.bool_]:
        """Which surface points (n, 3) with outward unit normals (n, 3) lie in the window, (n,)."""
        low, extent = points_mm.min(axis=0), np.maximum(np.ptp(points_mm, axis=0), 1e-9)
        fractions = (points_mm - low) / extent
        ranges = np.array([self.right_to_left, self.front_to_back, self.feet_to_head])
        inside = ((fractions >= ranges[:, 0]) & (fractions <= ranges[:, 1])).all(axis=1)
        facing = np.asarray(self.facing) / np.linalg.norm(self.facing)
        result: NDArray[np.bool_] = inside & (normals @ facing >= np.cos(np.radians(_WIDEST_DEG)))
        return result


_WIDEST_DEG = 70.0

_HOLLOW_SHARE = 0.5


@dataclass(frozen=True)
class Hollow:
    """The hollow of the surface in a window, without what lies in another one.

    A point's depth is its distance from the organ's convex hull; the points of at least half the greatest depth in the
    window are the hollow.
    """

    window: Window
    without: Window

    def chosen(self, points_mm: FloatArray, normals: FloatArray) -> NDArray[np.bool_]:
        """Which surface points (n, 3) with outward unit normals (n, 3) lie in the hollow, (n,)."""
        inside = self.window.chosen(points_mm, normals) & ~self.without.chosen(points_mm, normals)
        planes = ConvexHull(points_mm).equations
        depth = np.zeros(len(points_mm))
        depth[inside] = -(points_mm[inside] @ planes[:, :3].T + planes[:, 3]).max(axis=1, initial=-np.inf)
        result: NDArray[np.bool_] = inside & (depth >= _HOLLOW_SHARE * depth.max())
        return result


_VENA_CAVA = Window((0.38, 0.6), (0.45, 0.85), (0.5, 0.95), (0.0, 1.0, 0.0))

LIGAMENTS: Mapping[str, Window | Hollow] = MappingProxyType(
    {
        "coronary": Window((0.05, 0.55), (0.45, 1.0), (0.55, 1.0), (0.0, 1.0, 1.0)),
        "right-triangular": Window((0.0, 0.25), (0.4, 1.0), (0.35, 0.85), (-1.0, 1.0, 0.0)),
        "left-triangular": Window((0.7, 1.0), (0.0, 1.0), (0.5, 1.0), (0.0, 1.0, 1.0)),
        "falciform": Window((0.52, 0.64), (0.0, 0.7), (0.3, 1.0), (0.0, -1.0, 1.0)),
        "vena-cava": _VENA_CAVA,
        # The vena cava's groove begins just above, and is as deep.
        "hilum": Hollow(Window((0.3, 0.6), (0.35, 1.0), (0.3, 0.6), (0.0, 1.0, -1.0)), _VENA_CAVA),
    }
)
"""Name of what holds the liver → where."""
