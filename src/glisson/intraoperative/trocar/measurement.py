"""Sub-pixel corners of all crosses that a nearly known pose brings into view, as intersections of fitted edges."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.crosses import Cross, CrossLayout
from glisson.core.marker_colours import MARKER_COLOURS
from glisson.core.transform import RigidTransform
from glisson.intraoperative.cameras.projection import project, undistorted
from glisson.intraoperative.trocar.corners import SeenCorners
from glisson.intraoperative.trocar.edge_profiles import edge_offsets

_SAMPLES = 24
_FROM_CORNER_PX = 3.0
"""Nearer to a corner the other edge shows in the profile."""

_LEAST_SAMPLES, _LEAST_SPAN = 7, 0.45
"""An edge is used where this many samples and this share of its length fit to a line."""

_NEXT_CORNER = 0.35
"""It leads to a corner where samples fit up to this share of its length before it."""

_FLOOR_PX = 0.04
"""What paper, print and light leave of every edge, however many samples it has."""

_ROBUST_FITS = 4
_EDGE_ARMS = (1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4, 1)
"""The edge from a corner to the next bounds the ink of this one of the cross's colours."""


@dataclass(frozen=True, eq=False)
class _Lines:
    """Fitted edges: in the slopes, `normals` (e, 2) · x = `offsets` (e,), with the variance of the offset at both ends.

    `ends` (e, 2) tells whether an edge leads to its first and its last corner.
    """

    normals: FloatArray
    offsets: FloatArray
    variances: FloatArray
    ends: NDArray[np.bool_]


def measure_corners(
    image: NDArray[np.uint8], camera: Camera, layout: CrossLayout, camera_from_room: RigidTransform, reach_px: float
) -> SeenCorners:
    """Corners of all crosses in view, each with its information from the scatter of its two edges.

    Args:
        image: [row, column, red green blue].
        camera: has taken it.
        layout: the crosses.
        camera_from_room: about right: edges lie within `reach_px` less 1.5 px.
        reach_px: half of the length of the profiles.
    """
    numbers = [n for n, cross in enumerate(layout.crosses) if _is_in_view(cross, camera, camera_from_room, reach_px)]
    places = np.array([layout.crosses[n].corners_mm for n in numbers]).reshape(-1, 12, 3)
    lines = _fitted(image, camera, layout, numbers, places, camera_from_room, reach_px)
    pixel = 1.0 / float(camera.focal_px.mean())
    cross, corner, slopes, information, growth = [], [], [], [], []
    for one, number in enumerate(numbers):
        for k in range(12):
            edges = [12 * one + (k - 1) % 12, 12 * one + k]
            if not (lines.ends[edges[0], 1] and lines.ends[edges[1], 0]):
                continue
            normals = lines.normals[edges]
            weights = 1.0 / np.array([lines.variances[edges[0], 1], lines.variances[edges[1], 0]])
            grown = np.zeros((2, len(MARKER_COLOURS)))
            for row, edge in enumerate(edges):
                grown[row, MARKER_COLOURS.index(layout.crosses[number].colours[_EDGE_ARMS[edge % 12]])] = pixel
            cross.append(number)
            corner.append(k)
            slopes.append(np.linalg.solve(normals, lines.offsets[edges]))
            information.append((normals.T * weights) @ normals)
            growth.append(np.linalg.solve(normals, grown))
    return _seen(camera, layout, cross, corner, np.array(slopes), np.array(information), np.array(growth))


def _seen(
    camera: Camera, layout: CrossLayout, cross: list[int], corner: list[int], slopes: FloatArray,
    information: FloatArray, growth: FloatArray,
) -> SeenCorners:  # fmt: skip
    found, which = np.array(cross, dtype=np.int64), np.array(corner, dtype=np.int64)
    places = np.array([one.corners_mm for one in layout.crosses])
    slopes = slopes.reshape(-1, 2)
    rays = np.column_stack([slopes, np.ones(len(slopes))])
    pixels = project(camera, _NO_MOTION, rays) if len(rays) else np.zeros((0, 2))
    return SeenCorners(
        found, which, places[found, which], pixels, slopes, information.reshape(-1, 2, 2),
        growth.reshape(-1, 2, len(MARKER_COLOURS)),
    )  # fmt: skip


_NO_MOTION = RigidTransform("camera", "camera", np.eye(3), np.zeros(3))


def _is_in_view(cross: Cross, camera: Camera, camera_from_room: RigidTransform, reach_px: float) -> bool:
    """Whether a cross shows its front, is at least partly in the image, and large enough for profiles of this reach."""
    corners = camera_from_room.apply(cross.corners_mm)
    into_wall = camera_from_room.rotation @ cross.room_from_cross.rotation[:, 2]
    if (corners[:, 2] <= 1.0).any() or corners[0] @ into_wall <= 0.0:
        return False
    # The distortion's polynomial holds within the image only.
    widest = np.abs(undistorted(camera, [[0.0, 0.0], [camera.width - 1.0, camera.height - 1.0]])).max(axis=0)
    if (np.abs(corners[:, :2] / corners[:, 2:]) > 1.5 * widest).any():
        return False
    pixels = project(camera, camera_from_room, cross.corners_mm)
    inside = ((pixels >= 0.0) & (pixels <= [camera.width - 1.0, camera.height - 1.0])).all(axis=1)
    edges = np.linalg.norm(np.roll(pixels, -1, axis=0) - pixels, axis=1)
    return bool(inside.sum() >= 3 and edges.min() > 2.0 * (reach_px + 1.5))


def _fitted(
    image: NDArray[np.uint8], camera: Camera, layout: CrossLayout, numbers: list[int], places: FloatArray,
    camera_from_room: RigidTransform, reach_px: float,
) -> _Lines:  # fmt: skip
    """The edges from each corner of the crosses to the next."""
    first, last = places.reshape(-1, 3), np.roll(places, -1, axis=1).reshape(-1, 3)
    colours = np.array(
        [MARKER_COLOURS.index(layout.crosses[n].colours[arm]) for n in numbers for arm in _EDGE_ARMS], dtype=np.int64
    )
    pixels, normals = _samples(camera, camera_from_room, first, last)
    offsets = edge_offsets(
        image, pixels.reshape(-1, 2), normals.reshape(-1, 2), np.repeat(colours, _SAMPLES), reach_px
    ).reshape(-1, _SAMPLES)
    there = np.isfinite(offsets)
    edge = pixels + np.where(there, offsets, 0.0)[:, :, None] * normals
    slopes = undistorted(camera, edge.reshape(-1, 2)).reshape(edge.shape)
    return _lines(slopes, there, _slopes(camera_from_room, first), _slopes(camera_from_room, last), camera)


def _samples(
    camera: Camera, camera_from_room: RigidTransform, first: FloatArray, last: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Pixels and normals (edges, samples, 2) on edges between two corners."""
    ends = project(camera, camera_from_room, np.vstack([first, last])).reshape(2, -1, 2)
    length = np.linalg.norm(ends[1] - ends[0], axis=1)
    margin = np.minimum(_FROM_CORNER_PX / np.maximum(length, 1e-9), 0.3)[:, None]
    shares = margin + (1.0 - 2.0 * margin) * np.linspace(0.0, 1.0, _SAMPLES)
    places = first[:, None] + shares[:, :, None] * (last - first)[:, None]
    pixels = project(camera, camera_from_room, places.reshape(-1, 3)).reshape(-1, _SAMPLES, 2)
    along = np.gradient(pixels, axis=1)
    along /= np.maximum(np.linalg.norm(along, axis=2, keepdims=True), 1e-12)
    # Clockwise round the ink, with v downwards, paper is on the left.
    return pixels, np.stack([along[:, :, 1], -along[:, :, 0]], axis=2)


def _slopes(camera_from_room: RigidTransform, places: FloatArray) -> FloatArray:
    in_camera = camera_from_room.apply(places)
    return np.asarray(in_camera[:, :2] / in_camera[:, 2:])


def _lines(slopes: FloatArray, there: NDArray[np.bool_], first: FloatArray, last: FloatArray, camera: Camera) -> _Lines:
    """Lines through samples (edges, samples, 2) beside the expected edges from `first` to `last` (edges, 2)."""
    pixel = 1.0 / float(camera.focal_px.mean())
    length = np.linalg.norm(last - first, axis=1)
    along = (last - first) / length[:, None]
    normals = np.column_stack([along[:, 1], -along[:, 0]])
    s = np.einsum("esk,ek->es", slopes - first[:, None], along) / length[:, None]
    h = np.einsum("esk,ek->es", slopes - first[:, None], normals)
    level, slant, used, scatter = _robust_lines(s, h, there, 0.02 * pixel)
    count = used.sum(axis=1)
    middle = np.sum(s * used, axis=1) / np.maximum(count, 1)
    spread = np.sum((s - middle[:, None]) ** 2 * used, axis=1)
    low = np.where(used, s, np.inf).min(axis=1)
    high = np.where(used, s, -np.inf).max(axis=1)
    good = (count >= _LEAST_SAMPLES) & (high - low > _LEAST_SPAN) & (count > 0.6 * there.sum(axis=1))
    # Samples nearer to each other than the blur share their noise.
    shared = np.maximum(1.0, _SAMPLES * 1.5 * pixel / length)
    ends = np.stack([good & (low < _NEXT_CORNER), good & (high > 1.0 - _NEXT_CORNER)], axis=1)
    variances = (
        np.stack(
            [
                scatter**2 * shared * (1.0 / np.maximum(count, 1) + (end - middle) ** 2 / np.maximum(spread, 1e-9))
                for end in (0.0, 1.0)
            ],
            axis=1,
        )
        + (_FLOOR_PX * pixel) ** 2
    )
    # h = level + slant · s, as a line of its own in the slopes.
    tilted = normals - (slant / length)[:, None] * along
    size = np.linalg.norm(tilted, axis=1)
    offsets = (np.einsum("ek,ek->e", first, tilted) + level) / size
    return _Lines(tilted / size[:, None], offsets, variances, ends)


def _robust_lines(
    s: FloatArray, h: FloatArray, there: NDArray[np.bool_], least: float
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_], FloatArray]:
    """Lines h = level + slant · s (edges,) by what lies within three standard deviations, which samples, and these.

    The standard deviation of an edge is taken together with that of all edges, since it has few samples of its own.
    """
    used = there
    for _ in range(_ROBUST_FITS):
        weight = used.astype(np.float64)
        total = np.maximum(weight.sum(axis=1), 1.0)
        mean_s, mean_h = (s * weight).sum(axis=1) / total, (h * weight).sum(axis=1) / total
        ds = s - mean_s[:, None]
        slant = (ds * weight * (h - mean_h[:, None])).sum(axis=1) / np.maximum((ds**2 * weight).sum(axis=1), 1e-9)
        level = mean_h - slant * mean_s
        rest = h - level[:, None] - slant[:, None] * s
        own, common = _deviations(rest, used), _deviations(rest.reshape(1, -1), used.reshape(1, -1))
        scatter = np.maximum(np.sqrt(0.5 * own**2 + 0.5 * common**2), least)
        used = there & (np.abs(rest) < 3.0 * scatter[:, None])
    return level, slant, used, scatter


def _deviations(rest: FloatArray, used: NDArray[np.bool_]) -> FloatArray:
    """Standard deviation of each row's residuals (edges, n) that are used, as their median has it; 0 of none."""
    ordered = np.sort(np.where(used, np.abs(rest), np.inf), axis=1)
    count = used.sum(axis=1)
    middle = np.stack([np.maximum(count - 1, 0) // 2, count // 2], axis=1)
    middle = np.minimum(middle, rest.shape[1] - 1)
    medians = np.take_along_axis(ordered, middle, axis=1).mean(axis=1)
    result: FloatArray = np.where(count > 0, 1.4826 * medians, 0.0)
    return result
