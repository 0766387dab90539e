"""The angle between the rays to a point, and how large it must be for points to be worth anything."""

from collections.abc import Sequence

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.status import Status
from glisson.core.views import View


def parallax_rad(centres_mm: FloatArray, points_mm: FloatArray) -> FloatArray:
    """The largest angle (m,) between the rays from centres (v, 3) to each of points (m, 3)."""
    rays = points_mm[:, None, :] - centres_mm
    rays = rays / np.linalg.norm(rays, axis=2, keepdims=True)
    cosines = np.einsum("mvi,mwi->mvw", rays, rays).min(axis=(1, 2))
    angles: FloatArray = np.arccos(np.clip(cosines, -1.0, 1.0))
    return angles


def require_parallax(views: Sequence[View], touched_mm: FloatArray, sigma_px: float, worst_mm: float) -> None:
    """Refuse views that are so near to each other that pixels alone leave more than `worst_mm` of depth open.

    Raises:
        StageFailed: they are (unobservable).
    """
    centres = np.stack([view.room_from_camera.translation_mm for view in views])
    angle = float(parallax_rad(centres, touched_mm[None])[0])
    focal = float(np.mean([view.camera.focal_px.mean() for view in views]))
    distance = float(np.linalg.norm(touched_mm - centres, axis=1).mean())
    least = distance * np.sqrt(2.0) * sigma_px / focal / worst_mm
    if angle < least:
        raise StageFailed(_too_close(angle, least, worst_mm), Status.UNOBSERVABLE)


def judged(covariance_mm2: FloatArray, angle_rad: float, worst_mm: float, doubtful_mm: float) -> tuple[str, ...]:
    """A sentence where the points' error bars are long; the error falls as the angle between the views grows.

    Args:
        covariance_mm2: (m, 3, 3).
        angle_rad: between the views, at the points.
        worst_mm: a median standard deviation along the longest axis above this is refused.
        doubtful_mm: above this it is told.

    Raises:
        StageFailed: it is refused (unobservable).
    """
    longest = np.linalg.eigvalsh(covariance_mm2)[:, -1]
    error = float(np.sqrt(np.median(longest))) if np.isfinite(longest).all() else np.inf
    if not error <= worst_mm:
        needed = angle_rad * min(error / worst_mm, 1e3)
        raise StageFailed(_too_close(angle_rad, needed, worst_mm), Status.UNOBSERVABLE)
    if error > doubtful_mm:
        needed = np.degrees(angle_rad * error / doubtful_mm)
        return (
            f"The error bars are {error:.1f} mm long in the median; views {needed:.1f}° apart instead of "
            f"{np.degrees(angle_rad):.1f}° would bring them to {doubtful_mm:g} mm.",
        )
    return ()


def _too_close(angle: float, needed: float, worst_mm: float) -> str:
    return (
        f"The views are too close to each other: {np.degrees(angle):.2f}° apart at the surface, where an error bar of "
        f"{worst_mm:g} mm needs {np.degrees(needed):.2f}°; move the laparoscope farther."
    )
