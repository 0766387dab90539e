"""The wire from two calibrated X-ray projections: matched along its course by epipolar lines, then smoothed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.errors import BadInput, StageFailed
from glisson.core.observations import Observation
from glisson.core.status import Status
from glisson.core.transform import RigidTransform
from glisson.intraoperative.cameras.projection import directions, project
from glisson.intraoperative.wire.course import matched_course
from glisson.intraoperative.wire.smooth_curve import smooth_curve

_SAMPLES = 150
_LEAST_ANGLE_RAD = np.radians(5.0)
_FLATTEST_SINE = 0.1
"""Where the wire runs along epipolar lines by less than this, the views do not tell which of its points match."""

_BEAM_MM = 10.0
_STEP_PX = 1e-3
_ALONG = 0.5
"""A point may lie anywhere between its neighbours: this share of their distance, as standard deviation along it."""


@dataclass(frozen=True, eq=False)
class Projection:
    """An X-ray picture of the wire.

    Args:
        camera: the source as its centre, the detector as its image.
        room_from_camera: where it is.
        course_px: the wire as a polyline (n, 2), from its mouth to its tip.
        sigma_px: standard deviation of the polyline across its course.
    """

    camera: Camera
    room_from_camera: RigidTransform
    course_px: FloatArray
    sigma_px: float


def curve_from_projections(
    one: Projection, two: Projection, name: str = "wire", spacing_mm: float = 10.0
) -> Observation:
    """The wire as a curve in the room.

    Raises:
        BadInput: a course with fewer than two points.
        StageFailed: the views are nearly parallel, the courses do not belong together, or the wire runs along epipolar
            lines nearly everywhere (unobservable).
    """
    for seen in (one, two):
        if len(seen.course_px) < 2 or not np.isfinite(seen.course_px).all():
            raise BadInput("The course of a wire needs two or more finite points.")
    first, second = _evenly(one.course_px), _evenly(two.course_px)
    misses = _misses_px(one, two, first, second)
    matched, tangents = matched_course(misses, second)
    points = _met(one, two, first, matched, tangents)
    angle = float(np.median(_angles(one, two, points)))
    if angle < _LEAST_ANGLE_RAD:
        raise StageFailed(
            f"The two projections are {np.degrees(angle):.1f}° apart, and {np.degrees(_LEAST_ANGLE_RAD):.0f}° are "
            "needed; turn the C-arm farther.",
            Status.UNOBSERVABLE,
        )
    covariance, told = _covariance(one, two, first, matched, tangents, points)
    if told.mean() < 0.5:
        raise StageFailed(
            "The wire runs along the epipolar lines, where two projections do not tell its depth; turn the C-arm about "
            "another axis.",
            Status.UNOBSERVABLE,
        )
    found = smooth_curve(np.flatnonzero(told).astype(np.float64), points[told], covariance[told], spacing_mm)
    return found.observation(name, "room")


def _evenly(course_px: FloatArray) -> FloatArray:
    """Points (n, 2) evenly along a polyline."""
    arcs = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(course_px, axis=0), axis=1))])
    even = np.linspace(0.0, arcs[-1], _SAMPLES)
    return np.stack([np.interp(even, arcs, course_px[:, axis]) for axis in range(2)], axis=1)


def _misses_px(one: Projection, two: Projection, first: FloatArray, second: FloatArray) -> FloatArray:
    """How far (n, m) px each point of the second course is from the epipolar line of each of the first."""
    rays, others = (
        directions(seen.camera, pixels) @ seen.room_from_camera.rotation.T
        for seen, pixels in ((one, first), (two, second))
    )
    base = two.room_from_camera.translation_mm - one.room_from_camera.translation_mm
    normals = np.cross(base, rays)
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    misses: FloatArray = np.abs(normals @ others.T) * two.camera.focal_px.mean()
    return misses


def _met(one: Projection, two: Projection, first: FloatArray, second: FloatArray, tangents: FloatArray) -> FloatArray:
    """Where rays (n) through the first course meet the planes of the second source and the second course's tangents."""
    start, rays = _rays(one, first)
    other, at = _rays(two, second)
    _, ahead = _rays(two, second + tangents)
    normals = np.cross(at, ahead)
    far = (normals @ (other - start)) / (normals * rays).sum(axis=1)
    met: FloatArray = start + far[:, None] * rays
    return met


def _rays(seen: Projection, pixels: FloatArray) -> tuple[FloatArray, FloatArray]:
    pose = seen.room_from_camera
    return pose.translation_mm, directions(seen.camera, pixels) @ pose.rotation.T


def _angles(one: Projection, two: Projection, points: FloatArray) -> FloatArray:
    arms = [points - seen.room_from_camera.translation_mm for seen in (one, two)]
    unit = [arm / np.linalg.norm(arm, axis=1, keepdims=True) for arm in arms]
    angles: FloatArray = np.arccos(np.clip(np.abs((unit[0] * unit[1]).sum(axis=1)), 0.0, 1.0))
    return angles


def _covariance(
    one: Projection,
    two: Projection,
    first: FloatArray,
    second: FloatArray,
    tangents: FloatArray,
    points: FloatArray,
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Covariance (n, 3, 3), and whether (n,) the wire crosses the epipolar line steeply enough to tell its depth."""
    along = np.gradient(first, axis=0)
    across_first = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.linalg.norm(along, axis=1, keepdims=True)
    across_second = np.stack([-tangents[:, 1], tangents[:, 0]], axis=1)
    by_first = (_met(one, two, first + _STEP_PX * across_first, second, tangents) - points) / _STEP_PX
    by_second = (_met(one, two, first, second + _STEP_PX * across_second, tangents) - points) / _STEP_PX
    course = np.gradient(points, axis=0) * _ALONG
    covariance = sum(
        np.einsum("ni,nj->nij", arm, arm) for arm in (one.sigma_px * by_first, two.sigma_px * by_second, course)
    )
    rays = (points - one.room_from_camera.translation_mm) / 1e3
    room_from_second = two.room_from_camera.inverse()
    line = project(two.camera, room_from_second, points + _BEAM_MM * rays) - project(
        two.camera, room_from_second, points
    )
    line = line / np.linalg.norm(line, axis=1, keepdims=True)
    sine = np.abs(line[:, 0] * tangents[:, 1] - line[:, 1] * tangents[:, 0])
    return np.asarray(covariance) + 1e-6 * np.eye(3), sine > _FLATTEST_SINE
