"""What a trocar, a person and a matcher of features would measure in the half-sphere box, with known noise."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from glisson.core.arrays import FloatArray
from glisson.core.transform import RigidTransform
from glisson.core.views import Sightings, View, ViewSet
from glisson.phantom.half_sphere_box import (
    CAMERA,
    LANDMARKS_MM,
    TOUCHED_MM,
    drawn_features,
    pixels_of,
    scope_place,
)
from glisson.phantom.laparoscope_view import Place


@dataclass(frozen=True)
class ViewNoise:
    """Standard deviations, each of a coordinate, an angle about one axis, or a pixel's coordinate."""

    position_mm: float
    direction_deg: float
    roll_deg: float
    touched_mm: float
    tip_px: float = 1.0
    landmark_px: float = 0.5
    feature_px: float = 0.2

    def times(self, factor: float) -> "ViewNoise":
        """The same with poses and touched point so many times as noisy; pixels are what they are."""
        return ViewNoise(
            self.position_mm * factor,
            self.direction_deg * factor,
            self.roll_deg * factor,
            self.touched_mm * factor,
            self.tip_px,
            self.landmark_px,
            self.feature_px,
        )


TROCAR = ViewNoise(position_mm=1.0, direction_deg=2.0, roll_deg=2.0, touched_mm=1.0)
"""What the dissertation states of its trocar: 1 mm and 2°."""

FEATURES = 150
"""Fewer than are matched in rendered views."""


def measured_views(
    angles_deg: Sequence[float], noise: ViewNoise, rng: np.random.Generator, features: int = FEATURES
) -> ViewSet:
    """Views from the positions at some angles, with the six landmarks and so many features."""
    places = [scope_place(angle) for angle in angles_deg]
    surface = drawn_features(features, rng)
    return ViewSet(
        views=tuple(_view(number, place, noise, rng) for number, place in enumerate(places, start=1)),
        touched_mm=TOUCHED_MM + noise.touched_mm * rng.standard_normal(3),
        touched_covariance_mm2=noise.touched_mm**2 * np.eye(3),
        tip_sigma_px=noise.tip_px,
        names=tuple(f"point {number}" for number in range(1, 1 + len(LANDMARKS_MM))),
        landmarks=_sightings(places, LANDMARKS_MM, noise.landmark_px, rng),
        features=_sightings(places, surface, noise.feature_px, rng),
    )


def measured_pose(place: Place, noise: ViewNoise, rng: np.random.Generator) -> RigidTransform:
    """`room_from_camera` as it is measured, with its covariance."""
    angles = np.radians([noise.direction_deg, noise.direction_deg, noise.roll_deg])
    turn = place.rotation @ (angles * rng.standard_normal(3))
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = place.rotation @ np.diag(angles**2) @ place.rotation.T
    covariance[3:, 3:] = noise.position_mm**2 * np.eye(3)
    rotation = Rotation.from_rotvec(turn).as_matrix() @ place.rotation
    return RigidTransform(
        "room", "camera", rotation, place.centre_mm + noise.position_mm * rng.standard_normal(3), covariance
    )


def breathed(views: ViewSet, share: float) -> ViewSet:
    """All that is seen of the surface in the second view displaced by a share of its pixel coordinates; the tip stays.

    This is our reading of the dissertation's section 5.5, which says no more than "the same percentage".
    """
    return ViewSet(
        views.views,
        views.touched_mm,
        views.touched_covariance_mm2,
        views.tip_sigma_px,
        views.names,
        _displaced(views.landmarks, share),
        _displaced(views.features, share),
    )


def _displaced(seen: Sightings, share: float) -> Sightings:
    factors = np.where(seen.view == 1, 1.0 + share, 1.0)
    return Sightings(seen.point, seen.view, seen.pixels * factors[:, None], seen.sigma_px)


def _view(number: int, place: Place, noise: ViewNoise, rng: np.random.Generator) -> View:
    tip = pixels_of(place, TOUCHED_MM[None])[0] + noise.tip_px * rng.standard_normal(2)
    return View(f"view {number}", CAMERA, measured_pose(place, noise, rng), tip)


def _sightings(places: Sequence[Place], points_mm: FloatArray, sigma_px: float, rng: np.random.Generator) -> Sightings:
    pixels = np.concatenate([pixels_of(place, points_mm) for place in places])
    return Sightings(
        np.tile(np.arange(len(points_mm)), len(places)),
        np.repeat(np.arange(len(places)), len(points_mm)),
        pixels + sigma_px * rng.standard_normal(pixels.shape),
        sigma_px,
    )
