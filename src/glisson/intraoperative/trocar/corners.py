"""Corners of crosses as they were measured in an image."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.camera import Camera
from glisson.core.crosses import CrossLayout
from glisson.intraoperative.cameras.projection import undistorted


@dataclass(frozen=True, eq=False)
class SeenCorners:
    """Corners with what is known of them.

    Args:
        cross: number in the layout (n,).
        corner: number in `Cross.corners_mm` (n,).
        points_mm: places in the room (n, 3).
        pixels: in the image (n, 2).
        slopes: x / z and y / z of their rays in the camera's frame (n, 2).
        information: inverse covariance of the slopes (n, 2, 2).
    """

    cross: IntArray
    corner: IntArray
    points_mm: FloatArray
    pixels: FloatArray
    slopes: FloatArray
    information: FloatArray

    def __len__(self) -> int:
        return len(self.cross)

    def of(self, chosen: "np.typing.NDArray[np.bool_]") -> "SeenCorners":
        """Some of them (n,)."""
        return SeenCorners(*(values[chosen] for values in vars(self).values()))

    @property
    def crosses(self) -> list[int]:
        """Numbers of the crosses that they belong to, sorted."""
        return sorted({int(number) for number in self.cross})


def corners_at(
    camera: Camera, layout: CrossLayout, cross: IntArray, corner: IntArray, pixels: FloatArray, sigma_px: float
) -> SeenCorners:
    """Corners at pixels (n, 2), each coordinate with one standard deviation."""
    places = np.array([one.corners_mm for one in layout.crosses])
    information = np.broadcast_to(np.diag((camera.focal_px / sigma_px) ** 2), (len(pixels), 2, 2))
    return SeenCorners(
        cross, corner, places[cross, corner], pixels, undistorted(camera, pixels), np.ascontiguousarray(information)
    )
