"""Views through a laparoscope of a surface that is touched by a tool's tip."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray, IntArray, check_range, frozen_covariance, frozen_floats, frozen_ints
from glisson.core.camera import Camera
from glisson.core.errors import BadInput
from glisson.core.transform import RigidTransform


@dataclass(frozen=True, eq=False)
class View:
    """One picture.

    Args:
        name: for people.
        camera: calibrated.
        room_from_camera: the scope's pose as it was measured, with its covariance.
        tip_px: where the tool's tip is seen (2,).
    """

    name: str
    camera: Camera
    room_from_camera: RigidTransform
    tip_px: FloatArray

    def __post_init__(self) -> None:
        pose = self.room_from_camera
        if (pose.target, pose.source) != ("room", "camera"):
            raise BadInput(f"The pose of {self.name} is {pose.target}_from_{pose.source}; give room_from_camera.")
        if pose.covariance is None:
            raise BadInput(f"The pose of {self.name} needs a positive definite covariance.")
        frozen_covariance(pose.covariance, (6, 6), f"the covariance of the pose of {self.name}")
        object.__setattr__(self, "tip_px", frozen_floats(self.tip_px, (2,), f"tip in {self.name}"))


@dataclass(frozen=True, eq=False)
class Sightings:
    """Pixels in which points are seen: row k says that `point[k]` is seen in `view[k]` at `pixels[k]`.

    Args:
        point: number of the point, from 0.
        view: number of the view, from 0.
        pixels: (n, 2).
        sigma_px: standard deviation of each coordinate.
    """

    point: IntArray
    view: IntArray
    pixels: FloatArray
    sigma_px: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", frozen_ints(self.point, (None,), "points of sightings"))
        object.__setattr__(self, "view", frozen_ints(self.view, (len(self.point),), "views of sightings"))
        object.__setattr__(self, "pixels", frozen_floats(self.pixels, (len(self.point), 2), "pixels of sightings"))
        if not (np.isfinite(self.sigma_px) and self.sigma_px > 0.0):
            raise BadInput("Pixels need a positive standard deviation.")

    @classmethod
    def none(cls) -> "Sightings":
        """No point at all."""
        return cls(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros((0, 2)), 1.0)

    @property
    def count(self) -> int:
        """How many points there are."""
        return int(self.point.max(initial=-1)) + 1


@dataclass(frozen=True, eq=False)
class ViewSet:
    """Two or more views, and what is known of the touched point.

    Args:
        views: in any order.
        touched_mm: the tool's tip (3,) in the frame "room".
        touched_covariance_mm2: (3, 3), positive definite.
        tip_sigma_px: standard deviation of each coordinate of the tip's pixels.
        names: of the landmarks.
        landmarks: their pixels; each is seen in at least two views.
        features: pixels of points of the surface that have no name.
        hand_eye_covariance: (6, 6) of what all poses have in common, in the camera's frame: the true pose is the
            measured one after exp(d) and e as in `RigidTransform`. None: it is part of the poses' own covariance.
    """

    views: tuple[View, ...]
    touched_mm: FloatArray
    touched_covariance_mm2: FloatArray
    tip_sigma_px: float
    names: tuple[str, ...]
    landmarks: Sightings
    features: Sightings
    hand_eye_covariance: FloatArray | None = None

    def __post_init__(self) -> None:
        if len(self.views) < 2:
            raise BadInput("A reconstruction needs at least two views.")
        object.__setattr__(self, "touched_mm", frozen_floats(self.touched_mm, (3,), "touched point"))
        covariance = frozen_covariance(self.touched_covariance_mm2, (3, 3), "the covariance of the touched point")
        object.__setattr__(self, "touched_covariance_mm2", covariance)
        if not (np.isfinite(self.tip_sigma_px) and self.tip_sigma_px > 0.0):
            raise BadInput("The tip's pixels need a positive standard deviation.")
        if self.hand_eye_covariance is not None:
            hand_eye = frozen_covariance(self.hand_eye_covariance, (6, 6), "the hand-eye covariance")
            object.__setattr__(self, "hand_eye_covariance", hand_eye)
        if self.landmarks.count > len(self.names):
            raise BadInput(f"There are {self.landmarks.count} landmarks and {len(self.names)} names.")
        for seen, what in ((self.landmarks, "landmark"), (self.features, "feature")):
            check_range(seen.view, len(self.views), f"A {what}'s view")
            if (seen.point < 0).any():
                raise BadInput(f"A {what}'s number must not be negative.")
        for number, name in enumerate(self.names):
            views = self.landmarks.view[self.landmarks.point == number]
            if len(np.unique(views)) < 2 or len(np.unique(views)) < len(views):
                raise BadInput(f"The landmark {name!r} must be seen in two or more views, once in each.")
