"""Where the circles of a wheel are in an image: edges across each predicted circle, to a fraction of a pixel."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.instruments import RINGS
from glisson.core.transform import RigidTransform
from glisson.intraoperative.cameras.projection import project

CIRCLES = ((RINGS.white, -1.0), (RINGS.outer, 1.0), (RINGS.inner, -1.0))
"""Radii in wheel radii at which white paper ends, and whether it is darker (−1) or lighter outside."""

ANGLES = 120
_STEP_PX = 0.5
_BLUR_PX = 0.8
_LEAST_CONTRAST = 0.3
"""Edges with less than this share of the median contrast are none."""


@dataclass(frozen=True, eq=False)
class RimEdges:
    """Points of the wheel's circles and where the image has them.

    Args:
        points: (n, 3) in the wheel's frame, in wheel radii.
        predicted_px: (n, 2) where the pose has them.
        normals: (n, 2) unit vectors across the circles in the image, outwards.
        off_px: (n,) how far the edge is beyond, along the normal.
        growing: (n,) 1 where the white lies inside the circle, so that it grows outwards, −1 where it lies outside.
        share: of the points looked for that have an edge.
    """

    points: FloatArray
    predicted_px: FloatArray
    normals: FloatArray
    off_px: FloatArray
    growing: FloatArray
    share: float


def white_paper(image: NDArray[np.uint8], white: FloatArray | None = None) -> NDArray[np.float32]:
    """The darkest channel (h, w) of an image: bright where the paper is white, dark under any ink.

    Args:
        image: (h, w, 3).
        white: what the paper looks like (3,). Without it, coloured light makes one channel the darkest on paper and
            another one on ink, which shifts the edge between them by some tenths of a pixel.
    """
    balance = np.ones(3) if white is None else white.max() / white
    channels = [balance[n] * image[:, :, n].astype(np.float32) for n in range(3)]
    darkest: NDArray[np.float32] = np.minimum(np.minimum(channels[0], channels[1]), channels[2]).astype(np.float32)
    return darkest


def rim_edges(
    paper: NDArray[np.float32], camera: Camera, trocar_from_wheel: RigidTransform, radius_mm: float, window: float
) -> RimEdges:
    """The edges within a window, in wheel radii, to both sides of each circle.

    Args:
        paper: as `white_paper` has it.
        camera: its camera.
        trocar_from_wheel: a pose near the true one.
        radius_mm: the wheel's radius.
        window: how far to look, in wheel radii.
    """
    angles = np.arange(ANGLES) * 2.0 * np.pi / ANGLES
    round_ = np.stack([np.cos(angles), np.sin(angles), np.zeros(ANGLES)], axis=1)
    points = np.concatenate([share * round_ for share, _ in CIRCLES])
    circle = np.repeat(np.arange(len(CIRCLES)), ANGLES)
    away = project(camera, trocar_from_wheel, points * radius_mm)
    normals, per_radius = _across(camera, trocar_from_wheel, points, circle, radius_mm)
    reach = max(window * float(np.median(per_radius)), 3.0 * _STEP_PX)
    steps = np.arange(-np.ceil(reach / _STEP_PX), np.ceil(reach / _STEP_PX) + 1.0) * _STEP_PX
    places = away[:, None, :] + steps[:, None] * normals[:, None, :]
    profiles = cv2.remap(
        paper, places[..., 0].astype(np.float32), places[..., 1].astype(np.float32), cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )  # fmt: skip
    signs = np.array([sign for _, sign in CIRCLES])[circle]
    slopes = gaussian_filter1d(profiles.astype(np.float64), _BLUR_PX / _STEP_PX, axis=1, order=1) * signs[:, None]
    off, strength = _peaks(slopes, steps)
    inside = ((away > reach) & (away < np.array([camera.width, camera.height]) - 1.0 - reach)).all(axis=1)
    typical = np.median(strength[inside]) if inside.any() else np.inf
    good = inside & np.isfinite(off) & (strength > _LEAST_CONTRAST * typical)
    return RimEdges(points[good], away[good], normals[good], off[good], -signs[good], float(good.mean()))


def _across(
    camera: Camera, pose: RigidTransform, points: FloatArray, circle: NDArray[np.intp], radius_mm: float
) -> tuple[FloatArray, FloatArray]:
    """Unit vectors (n, 2) across the circles, outwards, and pixels (n,) for a wheel radius."""
    small = 1e-3
    turned = points @ np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    ahead, behind, out, here = (
        project(camera, pose, radius_mm * places)
        for places in (points + small * turned, points - small * turned, points * (1.0 + small), points)
    )
    along = ahead - behind
    normals = np.stack([-along[:, 1], along[:, 0]], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    outward = np.einsum("ij,ij->i", normals, out - here)
    shares = np.array([share for share, _ in CIRCLES])[circle]
    return normals * np.sign(outward)[:, None], np.abs(outward) / (small * shares)


def _peaks(slopes: FloatArray, steps: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Offset (n,) and height (n,) of the highest peak of each row (n, m), by a parabola; NaN at the window's end."""
    at = slopes.argmax(axis=1)
    rows = np.arange(len(slopes))
    inner = np.clip(at, 1, len(steps) - 2)
    before, top, after = (slopes[rows, inner + shift] for shift in (-1, 0, 1))
    bend = before - 2.0 * top + after
    shift = np.divide(0.5 * (before - after), bend, out=np.zeros_like(top), where=bend < 0.0)
    off = steps[inner] + np.clip(shift, -1.0, 1.0) * (steps[1] - steps[0])
    off[(at != inner) | (top <= 0.0)] = np.nan
    return off, top
