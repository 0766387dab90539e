"""The dissertation's box with a half sphere (section 5.4), as closed forms: what is where, and which pixel shows it.

The room's origin is the sphere's centre on the mat, z upward. Where the source is silent the choice is ours: radius and
distance, the six points, and that the scope turns about the middle of the model (in figure II.31 its axes meet there),
so that views turned by 3.28° see the model 3.28° apart. It moves across the image's diagonal: Table 4 says so, since
image points displaced along that diagonal hardly change their depth there.
"""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.phantom.laparoscope_view import Place, Tool
from glisson.phantom.optics import seen_at
from glisson.phantom.texture import Mottle

RADIUS_MM = 40.0
CAMERA = Camera(1440, 1080, np.array([1250.0, 1250.0]), np.array([712.0, 548.0]), np.array([-0.2, 0.05, 0.0, 0.0, 0.0]))

TURNS_DEG = (3.28, 4.86, 3.71)
"""From position 1 to 2, 2 to 3 and 3 to 4."""

POSITIONS_DEG = tuple(float(angle) for angle in np.cumsum((0.0, *TURNS_DEG)))

_AIM_MM = np.array([0.0, 0.0, 32.0])
_DISTANCE_MM = 110.0
_TILT_DEG = 20.0
_ROLL_DEG = 55.0
_LINE_MM = 0.3
_REACH_MM, _MAT_MM = 33.0, (45.0, 60.0)
"""How far from the axis features lie: on the sphere, which is too steep beyond, and on the mat from there to there."""


def on_sphere(across_mm: Sequence[tuple[float, float]] | FloatArray) -> FloatArray:
    """Points (n, 3) of the half sphere above places (n, 2) of the mat."""
    flat = np.asarray(across_mm, dtype=np.float64)
    return np.column_stack([flat, np.sqrt(RADIUS_MM**2 - (flat**2).sum(axis=1))])


LANDMARKS_MM = on_sphere([(-10, 10), (10, 10), (-20, -10), (0, -10), (10, -20), (20, 0)])
"""Six crossings of the 1-cm lines."""

TOUCHED_MM = on_sphere([(15.0, -12.0)])[0]


def scope_place(angle_deg: float) -> Place:
    """Where the scope is after a turn from position 1."""
    tilt = Rotation.from_euler("x", _TILT_DEG, degrees=True).as_matrix()
    away = tilt @ np.array([np.sin(np.radians(angle_deg)), 0.0, np.cos(np.radians(angle_deg))])
    right = np.cross([0.0, 1.0, 0.0], -away)
    right /= np.linalg.norm(right)
    level = np.column_stack([right, np.cross(-away, right), -away])
    roll = Rotation.from_euler("z", _ROLL_DEG, degrees=True).as_matrix()
    return Place(level @ roll, _AIM_MM + _DISTANCE_MM * away)


def pixels_of(place: Place, points_mm: FloatArray) -> FloatArray:
    """Pixels (n, 2) of points (n, 3)."""
    return seen_at(CAMERA, (np.asarray(points_mm) - place.centre_mm) @ place.rotation)


def drawn_features(count: int, rng: np.random.Generator) -> FloatArray:
    """Points (n, 3) that all positions see: half of them on the sphere, half on the mat about it."""
    reach = np.sqrt(np.concatenate([
        rng.uniform(0.0, _REACH_MM**2, count // 2), rng.uniform(_MAT_MM[0] ** 2, _MAT_MM[1] ** 2, count - count // 2)
    ]))  # fmt: skip
    turn = rng.uniform(0.0, 2.0 * np.pi, count)
    flat = reach[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    height = np.sqrt(np.maximum(RADIUS_MM**2 - reach**2, 0.0))
    return np.column_stack([flat, height])


def touching_tool() -> Tool:
    """A shaft that comes from the side and stands on the touched point."""
    return Tool(TOUCHED_MM, np.array([0.75, -0.35, 0.55]))


class HalfSphereBox:
    """The half sphere with its 1-cm lines on a mat with lines of its own, both faintly mottled."""

    def __init__(self, seed: int = 0) -> None:
        self._mottle = Mottle(6.0, 4, seed)

    def hits(self, origin: FloatArray, rays: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `glisson.phantom.laparoscope_view.Surface`."""
        along = rays @ origin
        square = along**2 - (origin @ origin - RADIUS_MM**2)
        with np.errstate(invalid="ignore", divide="ignore"):
            ball = -along - np.sqrt(square)
            mat = np.where(rays[:, 2] < 0.0, -origin[2] / rays[:, 2], np.inf)
        met = origin + ball[:, None] * rays
        ball = np.where((square > 0.0) & (met[:, 2] >= 0.0), ball, np.inf)
        on_ball = ball < mat
        normals = np.tile([0.0, 0.0, 1.0], (len(rays), 1))
        normals[on_ball] = met[on_ball] / RADIUS_MM
        return np.where(on_ball, ball, mat), normals

    def colours(self, points_mm: FloatArray) -> FloatArray:
        """See `glisson.phantom.laparoscope_view.Surface`."""
        on_mat = points_mm[:, 2] < 1e-6
        base = np.where(on_mat[:, None], [0.45, 0.75, 0.55], [0.86, 0.80, 0.70])
        shade = 0.75 + 1.2 * (self._mottle.at(points_mm) - 0.5)
        off = np.abs(points_mm[:, :2] - 10.0 * np.rint(points_mm[:, :2] / 10.0)).min(axis=1)
        lined = np.clip((_LINE_MM - off) / 0.2 + 0.5, 0.0, 1.0)[:, None]
        painted: FloatArray = base * shade[:, None] * (1.0 - 0.75 * lined)
        return painted
