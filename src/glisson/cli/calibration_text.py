"""What `glisson calibrate` says of its results."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from glisson.cli.console import Answer
from glisson.core.arrays import FloatArray
from glisson.core.status import Status
from glisson.core.transform import RigidTransform
from glisson.framework.calibrating import (
    BOARD,
    CAMERA,
    CAMERA_PICTURE,
    HAND_EYE,
    HAND_EYE_CAMERA,
    HAND_EYE_PICTURE,
    BoardImages,
)
from glisson.intraoperative.cameras.calibration import CameraCalibration
from glisson.intraoperative.cameras.hand_eye import HandEye
from glisson.intraoperative.cameras.pivot import Pivot
from glisson.intraoperative.cameras.scope import Scope, Shaft


def camera_answer(made: CameraCalibration, boards: BoardImages, folder: Path) -> Answer:
    """The camera, its errors and its files."""
    camera = made.camera
    assert camera.covariance is not None  # a calibration has one
    sigma = np.sqrt(np.diag(camera.covariance))
    notes = [*made.notes, *_not_found(boards)]
    values = {
        "status": Status.CONVERGED, "views": len(boards.views), "width": camera.width, "height": camera.height,
        "focal_px": camera.focal_px.tolist(), "focal_sigma_px": sigma[:2].tolist(),
        "centre_px": camera.centre_px.tolist(), "centre_sigma_px": sigma[2:4].tolist(),
        "distortion": camera.distortion.tolist(), "distortion_sigma": sigma[4:].tolist(),
        "distortion_terms": list(made.terms), "rms_px": made.rms_px, "sigma_px": made.sigma_px,
        "rms_px_of_views": dict(zip((view.name for view in boards.views), made.rms_px_of_views, strict=True)),
        "notes": notes, "file": str(folder / CAMERA), "picture": str(folder / CAMERA_PICTURE),
    }  # fmt: skip
    terms = ", ".join(made.terms) or "none"
    text = [
        f"focal length {_measured(camera.focal_px, sigma[:2])} px",
        f"centre       {_measured(camera.centre_px, sigma[2:4])} px",
        f"distortion   {' '.join(f'{term:.4f}' for term in camera.distortion)} (estimated: {terms})",
        f"residual     {made.rms_px:.3f} px root mean square over {len(boards.views)} views",
        f"written      {folder / CAMERA} and {folder / CAMERA_PICTURE}",
    ]
    return Answer(values, "\n".join(text + _look_at(notes)))


def hand_eye_answer(made: HandEye, boards: BoardImages, folder: Path, upside_down: bool) -> Answer:
    """Both poses, the residuals and the files."""
    notes = [*made.notes, *_not_found(boards)]
    if upside_down:
        notes.append(
            "This board looks the same when turned by half: results hold only if its first corner stayed the same."
        )
    values = {
        "status": Status.CONVERGED, "views": len(boards.views),
        "camera_from_marker": _pose(made.camera_from_marker), "base_from_board": _pose(made.base_from_board),
        "rms_px": made.rms_px, "rms_mm": made.rms_mm, "rms_deg": made.rms_deg,
        "rms_px_of_views": dict(zip((view.name for view in boards.views), made.rms_px_of_views, strict=True)),
        "sigma_px": made.sigma_px, "board_sigma_px": made.board_sigma_px,
        "tracker_sigma_deg": made.tracker_sigma_deg,
        "tracker_sigma_mm": made.tracker_sigma_mm, "turned_deg": list(made.turned_deg), "notes": notes,
        "file": str(folder / HAND_EYE), "board_file": str(folder / BOARD),
        "camera_file": str(folder / HAND_EYE_CAMERA), "picture": str(folder / HAND_EYE_PICTURE),
    }  # fmt: skip
    pose = made.camera_from_marker
    text = [
        f"camera       {_measured(pose.translation_mm, _sigma(pose)[3:])} mm (marker's origin in the camera's frame)",
        f"turn         known to {float(np.degrees(_sigma(pose)[:3].max())):.2f}°",
        f"residual     {made.rms_px:.2f} px, {made.rms_mm:.2f} mm, {made.rms_deg:.2f}° over {len(boards.views)} views",
        f"errors shown tracker {made.tracker_sigma_mm:.2f} mm and {made.tracker_sigma_deg:.3f}°, "
        f"points {made.sigma_px:.2f} px each and {made.board_sigma_px:.2f} px together",
        f"written      {folder / HAND_EYE}, and beside it {BOARD}, {HAND_EYE_CAMERA} and {HAND_EYE_PICTURE}",
    ]
    return Answer(values, "\n".join(text + _look_at(notes)))


def pivot_answer(made: Pivot) -> Answer:
    """The tip."""
    sigma = np.sqrt(np.diag(made.covariance_mm2))
    values = {
        "status": Status.CONVERGED, "poses": len(made.used), "used": int(made.used.sum()),
        "tip_mm": made.tip_mm.tolist(), "tip_covariance_mm2": made.covariance_mm2[:3, :3].tolist(),
        "pivot_mm": made.pivot_mm.tolist(), "pivot_covariance_mm2": made.covariance_mm2[3:, 3:].tolist(),
        "rms_mm": made.rms_mm, "rms_all_mm": made.rms_all_mm, "tracker_sigma_deg": made.tracker_sigma_deg,
        "tracker_sigma_mm": made.tracker_sigma_mm, "turned_deg": list(made.turned_deg), "notes": list(made.notes),
    }  # fmt: skip
    text = [
        f"tip          {_measured(made.tip_mm, sigma[:3])} mm (marker's frame)",
        f"pivot        {_measured(made.pivot_mm, sigma[3:])} mm (tracker's frame)",
        f"residual     {made.rms_mm:.2f} mm over {int(made.used.sum())} of {len(made.used)} poses",
        f"turned       {made.turned_deg[0]:.1f}° and {made.turned_deg[1]:.1f}° about two axes",
    ]
    return Answer(values, "\n".join(text + _look_at(made.notes)))


def scope_answer(made: Scope, shaft: Shaft | None) -> Answer:
    """Tip, shaft and obliqueness."""
    sigma = np.sqrt(np.diag(made.tip_covariance_mm2))
    values = {
        "status": Status.CONVERGED, "tip_mm": made.tip_mm.tolist(),
        "tip_covariance_mm2": made.tip_covariance_mm2.tolist(),
        "shaft": None if made.shaft is None else made.shaft.tolist(), "oblique_deg": made.oblique_deg,
        "oblique_sigma_deg": made.oblique_sigma_deg, "tip_off_shaft_mm": made.tip_off_shaft_mm,
        "spin_rms_deg": None if shaft is None else shaft.rms_deg, "notes": [],
    }  # fmt: skip
    text = [f"glass tip    {_measured(made.tip_mm, sigma)} mm before the centre of projection (camera's frame)"]
    if made.oblique_deg is not None:
        text.append(f"oblique      {made.oblique_deg:.2f} ± {made.oblique_sigma_deg:.2f}° from optical axis to shaft")
        text.append(f"tip          {made.tip_off_shaft_mm:.2f} mm from the shaft's line")
    return Answer(values, "\n".join(text))


def _pose(pose: RigidTransform) -> dict[str, Any]:
    assert pose.covariance is not None  # both have one
    return {
        "rotation": pose.rotation.tolist(), "translation_mm": pose.translation_mm.tolist(),
        "covariance": pose.covariance.tolist(),
    }  # fmt: skip


def _sigma(pose: RigidTransform) -> FloatArray:
    assert pose.covariance is not None  # both have one
    result: FloatArray = np.sqrt(np.diag(pose.covariance))
    return result


def _measured(values: FloatArray, sigmas: FloatArray) -> str:
    return ", ".join(f"{value:.2f} ± {sigma:.2f}" for value, sigma in zip(values, sigmas, strict=True))


def _not_found(boards: BoardImages) -> list[str]:
    return [f"No board was found in {', '.join(boards.not_found)}."] if boards.not_found else []


def _look_at(notes: Sequence[str]) -> list[str]:
    return [f"look at      {note}" for note in notes]
