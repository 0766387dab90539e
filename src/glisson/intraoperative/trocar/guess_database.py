"""The dissertation's way (section 5.2): a database of initial guesses, and the local minimum next to the best one."""

from dataclasses import dataclass
from itertools import product
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.crosses import CrossLayout
from glisson.core.parameters import parameter
from glisson.core.transform import RigidTransform
from glisson.intraoperative.trocar.corners import SeenCorners
from glisson.intraoperative.trocar.localiser import CrossLocaliser, LocaliserParameters
from glisson.intraoperative.trocar.pose import FoundPose, with_covariance
from glisson.intraoperative.trocar.refinement import refined_pose

_ROLLS = 12


@dataclass(frozen=True)
class DatabaseParameters(LocaliserParameters):
    """Where the trocar may be."""

    low_mm: tuple[float, float, float] = parameter((-350.0, -250.0, 950.0), "Least coordinates in the room, mm.")
    high_mm: tuple[float, float, float] = parameter((350.0, 250.0, 1200.0), "Largest coordinates in the room, mm.")
    tilt_deg: float = parameter(40.0, "Largest angle between the trocar's axis and the upright, degrees.", 0.0, 89.0)


class GuessDatabase(CrossLocaliser):
    """Poses all over the trocar's region; from the one with the least error the minimum beside it."""

    name: ClassVar[str] = "guess-database"
    summary: ClassVar[str] = "Local refinement from the best of a database of guesses, for comparison."
    Parameters: ClassVar[type[DatabaseParameters]] = DatabaseParameters

    def __init__(self, parameters: DatabaseParameters) -> None:
        self._parameters = parameters
        self._rotations, self._shifts = _database(parameters)

    def _first_pose(self, seen: SeenCorners, camera: Camera, layout: CrossLayout) -> FoundPose | None:
        in_camera = np.einsum("gij,nj->gni", self._rotations, seen.points_mm) + self._shifts[:, None]
        before = (in_camera[..., 2] > 1.0).all(axis=1)
        off = in_camera[..., :2] / np.maximum(in_camera[..., 2:], 1.0) - seen.slopes
        errors = np.where(before, np.sum(off**2, axis=(1, 2)), np.inf)
        best = int(np.argmin(errors))
        guess = RigidTransform("camera", "room", self._rotations[best], self._shifts[best])
        return self._pose(seen, camera, layout, guess)

    def _pose(self, seen: SeenCorners, camera: Camera, layout: CrossLayout, before: RigidTransform) -> FoundPose | None:
        if len(seen) < 6:
            return None
        pose = refined_pose(seen.points_mm, seen.slopes, seen.information, before.rotation, before.translation_mm)
        everything = np.ones(len(seen), dtype=bool)
        good = np.isfinite(pose.squares).all() and np.linalg.cond(pose.normal) < 1e15
        return with_covariance(pose, seen, seen, everything, camera, layout) if good else None


def _database(parameters: DatabaseParameters) -> tuple[FloatArray, FloatArray]:
    """Rotations (g, 3, 3) and shifts (g, 3) of camera_from_room."""
    low, high = np.array(parameters.low_mm), np.array(parameters.high_mm)
    shares = [(0.25, 0.75), (0.25, 0.75), (0.5,)]
    places = low + np.array(list(product(*shares))) * (high - low)
    tilt = np.deg2rad(parameters.tilt_deg)
    tilts = [(0.0, 0.0)] + [(ring * tilt, turn) for ring, count in ((0.45, 6), (0.9, 12))
                            for turn in 2.0 * np.pi * np.arange(count) / count]  # fmt: skip
    rotations, shifts = [], []
    for place, (lean, turn), roll in product(places, tilts, 2.0 * np.pi * np.arange(_ROLLS) / _ROLLS):
        room_from_camera = Rotation.from_euler("ZYZ", [turn, lean, roll]).as_matrix()
        rotations.append(room_from_camera.T)
        shifts.append(-room_from_camera.T @ place)
    return np.array(rotations), np.array(shifts)
