"""Whether views of a board determine a camera, and what a person should look at."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.errors import BadInput, StageFailed
from glisson.core.status import Status
from glisson.core.transform import RigidTransform
from glisson.intraoperative.cameras.boards import BoardView

FOCAL_SHARE = 0.05
"""Standard deviation of the focal length, as a share of it, above which it counts as unobservable."""

_FOCAL_NOTE = 0.005
_TILT_DEG = 10.0
_COVERED = 0.5
_PATIENCE = 2.5
_REPEATED_PX = 1.0


def check_repeated(views: Sequence[BoardView]) -> None:
    """Refuse views that say the same twice, since all are counted as independent.

    Raises:
        BadInput: two views show the board in the same place of the image.
    """
    seen = [{tuple(point): pixel for point, pixel in zip(view.points_mm.tolist(), view.pixels, strict=True)}
            for view in views]  # fmt: skip
    repeated = []
    for number, later in enumerate(seen):
        for earlier, name in zip(seen[:number], (view.name for view in views), strict=False):
            off = [later[point] - earlier[point] for point in later.keys() & earlier.keys()]
            if 2 * len(off) > len(later) and float(np.sqrt(np.mean(np.square(off)))) < _REPEATED_PX:
                repeated.append(f"{views[number].name} (as {name})")
                break
    if repeated:
        named = ", ".join(repeated[:8]) + (" …" if len(repeated) > 8 else "")
        raise BadInput(
            f"The board is in the same place of the image again in {named}: such a view tells nothing "
            "new; leave it out, and move the board or the camera for each view."
        )


def unobservable(poses: Sequence[RigidTransform], share: float) -> StageFailed:
    """Why views leave the focal length open.

    Scale and distance of a board that is parallel to the image cannot be told apart.

    Args:
        poses: `camera_from_board` of the views, as they came out.
        share: standard deviation of the focal length, as a share of it; infinite where nothing limits it.
    """
    normals = np.array([pose.rotation[:, 2] for pose in poses])
    tilts = np.degrees(np.arccos(np.clip(np.abs(normals[:, 2]), 0.0, 1.0)))
    if float(tilts.max()) < _TILT_DEG:
        reason = "all boards are nearly parallel to the image: tilt the board by 20° to 45°, each time another way"
    elif _spread_deg(normals) < _TILT_DEG:
        reason = "all boards are tilted the same way: tilt the board another way in each view"
    else:
        reason = "the boards are too few, too small or too far: take more views, nearer and tilted"
    known = f" (to {100.0 * share:.0f} % only)" if share < 1.0 else ""
    return StageFailed(f"The focal length is not determined{known}, since {reason}.", Status.UNOBSERVABLE)


def notes_on_views(
    camera: Camera,
    views: Sequence[BoardView],
    poses: Sequence[RigidTransform],
    used: Sequence[NDArray[np.bool_]],
    rms_px: Sequence[float],
) -> tuple[str, ...]:
    """Sentences on parts of the image without points, points left out, and views that fit badly."""
    notes = []
    pixels = np.concatenate([view.pixels[keep] for view, keep in zip(views, used, strict=True)])
    hull = cv2.convexHull(pixels.astype(np.float32))
    covered = cv2.contourArea(hull) / (camera.width * camera.height)
    if covered < _COVERED:
        notes.append(
            f"The boards cover {100.0 * covered:.0f} % of the image: outside of them distortion is a guess, "
            "so hold the board into the corners too."
        )
    assert camera.covariance is not None  # a calibration has one
    share = float((np.sqrt(np.diag(camera.covariance)[:2]) / camera.focal_px).max())
    if share > _FOCAL_NOTE:
        notes.append(f"The focal length is known to {100.0 * share:.1f} % only (one standard deviation).")
    if len(poses) < 6:
        notes.append(f"{len(poses)} views are few; 10 or more tell more surely.")
    for view, keep in zip(views, used, strict=True):
        if not keep.all():
            notes.append(f"{view.name}: {int((~keep).sum())} of {len(keep)} points fit no board and were left out.")
    usual = float(np.median(rms_px))
    for view, own in zip(views, rms_px, strict=True):
        if own > _PATIENCE * usual:
            notes.append(f"{view.name} fits worse than the others ({own:.2f} px against {usual:.2f} px): look at it.")
    return tuple(notes)


def _spread_deg(normals: FloatArray) -> float:
    """The largest angle between two normals."""
    cosines = np.clip(normals @ normals.T, -1.0, 1.0)
    return float(np.degrees(np.arccos(cosines.min())))
