"""Corners of crosses as they were measured in an image."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

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
        growth: derivative (n, 2, 4) of the slopes by how far each colour's ink has grown, per px, if that is in them.
        growth_covariance: what is left open of that (4, 4), px².
    """

    cross: IntArray
    corner: IntArray
    points_mm: FloatArray
    pixels: FloatArray
    slopes: FloatArray
    information: FloatArray
    growth: FloatArray | None = None
    growth_covariance: FloatArray | None = None

    def __len__(self) -> int:
        return len(self.cross)

    def of(self, chosen: "np.typing.NDArray[np.bool_]") -> "SeenCorners":
        """Some of them (n,)."""
        growth = None if self.growth is None else self.growth[chosen]
        names = ("cross", "corner", "points_mm", "pixels", "slopes", "information")
        return replace(self, growth=growth, **{name: getattr(self, name)[chosen] for name in names})

    @property
    def crosses(self) -> list[int]:
        """Numbers of the crosses that they belong to, sorted."""
        return sorted({int(number) for number in self.cross})


def joined(parts: Sequence[SeenCorners]) -> SeenCorners:
    """Corners of one image that were measured apart, all with their derivative by the growth."""
    growths = [part.growth for part in parts if part.growth is not None]
    names = ("cross", "corner", "points_mm", "pixels", "slopes", "information")
    values = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    return SeenCorners(**values, growth=np.concatenate(growths))


def corners_at(
    camera: Camera, layout: CrossLayout, cross: IntArray, corner: IntArray, pixels: FloatArray, sigma_px: float
) -> SeenCorners:
    """Corners at pixels (n, 2), each coordinate with one standard deviation."""
    places = np.array([one.corners_mm for one in layout.crosses])
    information = np.broadcast_to(np.diag((camera.focal_px / sigma_px) ** 2), (len(pixels), 2, 2))
    return SeenCorners(
        cross, corner, places[cross, corner], pixels, undistorted(camera, pixels), np.ascontiguousarray(information)
    )
