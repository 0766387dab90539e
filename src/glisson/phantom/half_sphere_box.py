"""The dissertation's box with a half sphere (section 5.4), as closed forms: what is where, and which pixel shows it.

The room's origin is the sphere's centre on the mat, z upward. Where the source is silent the choice is ours: radius and
distance, the six points, and that the scope turns about the middle of the model (in figure II.31 its axes meet there),
so that views turned by 3.28° see the model 3.28° apart. It moves across the image's diagonal: Table 4 says so, since
image points displaced along that diagonal hardly change their depth there.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.phantom.optics import seen_at

RADIUS_MM = 40.0
CAMERA = Camera(1440, 1080, np.array([1250.0, 1250.0]), np.array([712.0, 548.0]), np.array([-0.2, 0.05, 0.0, 0.0, 0.0]))

TURNS_DEG = (3.28, 4.86, 3.71)
"""From position 1 to 2, 2 to 3 and 3 to 4."""

POSITIONS_DEG = tuple(float(angle) for angle in np.cumsum((0.0, *TURNS_DEG)))

_AIM_MM = np.array([0.0, 0.0, 32.0])
_DISTANCE_MM = 110.0
_TILT_DEG = 20.0
_ROLL_DEG = 55.0
_REACH_MM = 33.0
"""Features are seen as far from the sphere's axis: beyond it the surface is too steep."""


@dataclass(frozen=True, eq=False)
class ScopePlace:
    """Where the scope is: `rotation` (3, 3) has the image's right, down and forward as columns; `centre_mm` (3,)."""

    rotation: FloatArray
    centre_mm: FloatArray


def on_sphere(across_mm: Sequence[tuple[float, float]] | FloatArray) -> FloatArray:
    """Points (n, 3) of the half sphere above places (n, 2) of the mat."""
    flat = np.asarray(across_mm, dtype=np.float64)
    return np.column_stack([flat, np.sqrt(RADIUS_MM**2 - (flat**2).sum(axis=1))])


LANDMARKS_MM = on_sphere([(-10, 10), (10, 10), (-20, -10), (0, -10), (10, -20), (20, 0)])
"""Six crossings of the 1-cm lines."""

TOUCHED_MM = on_sphere([(15.0, -12.0)])[0]


def scope_place(angle_deg: float) -> ScopePlace:
    """Where the scope is after a turn from position 1."""
    tilt = Rotation.from_euler("x", _TILT_DEG, degrees=True).as_matrix()
    away = tilt @ np.array([np.sin(np.radians(angle_deg)), 0.0, np.cos(np.radians(angle_deg))])
    right = np.cross([0.0, 1.0, 0.0], -away)
    right /= np.linalg.norm(right)
    level = np.column_stack([right, np.cross(-away, right), -away])
    roll = Rotation.from_euler("z", _ROLL_DEG, degrees=True).as_matrix()
    return ScopePlace(level @ roll, _AIM_MM + _DISTANCE_MM * away)


def pixels_of(place: ScopePlace, points_mm: FloatArray) -> FloatArray:
    """Pixels (n, 2) of points (n, 3)."""
    return seen_at(CAMERA, (np.asarray(points_mm) - place.centre_mm) @ place.rotation)


def drawn_features(count: int, rng: np.random.Generator) -> FloatArray:
    """Points (n, 3) anywhere on the part of the sphere that all positions see."""
    reach = _REACH_MM * np.sqrt(rng.uniform(0.0, 1.0, count))
    turn = rng.uniform(0.0, 2.0 * np.pi, count)
    return on_sphere(np.column_stack([reach * np.cos(turn), reach * np.sin(turn)]))
