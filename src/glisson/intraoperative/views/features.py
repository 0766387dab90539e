"""Points of the surface that are found in several pictures without a person's help."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from glisson.core.arrays import FloatArray
from glisson.core.views import Sightings, View
from glisson.intraoperative.cameras.projection import undistorted
from glisson.intraoperative.views.epipolar import epipolar_statistics

SIGMA_PX = 0.2
"""Of a matched feature's place; a test measures it on rendered views."""

_DETECTED = 4000
_CONTRAST = 0.01
"""Tissue is dull; features that are worth nothing fall out later."""

_ALIKE = 8
_RATIO = 0.8
_SIFT_PX = 1.0
_HALF, _MARGIN = 10, 6
_LIKENESS = 0.9
_LEAST_PAIRS, _OFF_PX = 8, 1.0
_GLARE, _DARK = 245, 12
_CELLS = 16
_PER_CELL = 2
_GATE = float(chi2.isf(1e-3, 1))


def match_features(
    images: Sequence[NDArray[np.uint8]], views: Sequence[View], hand_eye: FloatArray | None = None
) -> Sightings:
    """Features of the first picture that are found in others, evenly spread over it.

    SIFT (Lowe 2004) proposes pairs, the measured poses refuse those off the epipolar line, and the patches about the
    others are brought to coincide.

    Args:
        images: (h, w, 3) red green blue.
        views: where they were taken from.
        hand_eye: (6, 6) as in `ViewSet`.
    """
    grey = [np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), dtype=np.uint8) for image in images]
    sift = cv2.SIFT.create(_DETECTED, contrastThreshold=_CONTRAST)
    found = [_found(sift, image) for image in grey]
    first = found[0].places
    matched = np.full((len(images), len(first), 2), np.nan)
    matched[0] = first
    for number in range(1, len(images)):
        pair = (views[0], views[number])
        rows, places = _pairs(found[0], found[number], pair, hand_eye)
        if len(rows):
            places, alike = _refined(grey[0], grey[number], first[rows], places)
            rows, places = rows[alike], places[alike]
            good = epipolar_statistics(*pair, (first[rows], places), SIGMA_PX, hand_eye) < _GATE
            good[good] = _consistent(pair, first[rows[good]], places[good])
            matched[number, rows[good]] = places[good]
    return _sightings(matched, found[0].strengths)


@dataclass(frozen=True, eq=False)
class _Found:
    """Features of a picture: places (n, 2), strengths (n,) and descriptors (n, 128)."""

    places: FloatArray
    strengths: FloatArray
    descriptors: NDArray[np.float32]


def _found(sift: cv2.SIFT, grey: NDArray[np.uint8]) -> _Found:
    keys, descriptors = sift.detectAndCompute(grey, _usable(grey))
    return _Found(
        np.array([key.pt for key in keys], dtype=np.float64).reshape(-1, 2),
        np.array([key.response for key in keys], dtype=np.float64),
        np.asarray(descriptors if len(keys) else np.zeros((0, 128)), dtype=np.float32),
    )


def _usable(grey: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Neither glare nor darkness; glare wanders over the surface as the scope moves."""
    spots = cv2.dilate((grey >= _GLARE).astype(np.uint8), np.ones((15, 15), np.uint8))
    usable: NDArray[np.uint8] = ((spots == 0) & (grey > _DARK)).astype(np.uint8) * 255
    return usable


def _pairs(
    one: _Found, two: _Found, views: tuple[View, View], hand_eye: FloatArray | None
) -> tuple[NDArray[np.intp], FloatArray]:
    """Rows of the first picture's features and where the second has them (n, 2).

    Of the features that look most alike the poses choose; lines that repeat look alike everywhere.
    """
    if len(one.places) < 1 or len(two.places) < _ALIKE:
        return np.zeros(0, dtype=np.intp), np.zeros((0, 2))
    alike = cv2.BFMatcher(cv2.NORM_L2).knnMatch(one.descriptors, two.descriptors, k=_ALIKE)
    column = np.array([[match.trainIdx for match in row] for row in alike])
    distance = np.array([[match.distance for match in row] for row in alike])
    pixels = (np.repeat(one.places, _ALIKE, axis=0), two.places[column.reshape(-1)])
    missed = epipolar_statistics(*views, pixels, SIGMA_PX + _SIFT_PX, hand_eye).reshape(column.shape)
    distance = np.where(missed < _GATE, distance, np.inf)
    order = np.argsort(distance, axis=1)[:, :2]
    least, next_least = np.take_along_axis(distance, order, axis=1).T
    chosen = column[np.arange(len(column)), order[:, 0]]
    good = np.isfinite(least) & (least < _RATIO * np.minimum(next_least, 1e9))
    # Of several that claim one feature the most alike has it.
    rows = np.flatnonzero(good)[np.argsort(least[good], kind="stable")]
    _, unique = np.unique(chosen[rows], return_index=True)
    rows = rows[unique]
    return rows, two.places[chosen[rows]]


def _refined(
    one: NDArray[np.uint8], two: NDArray[np.uint8], places: FloatArray, guesses: FloatArray
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Places (n, 2) in the second picture to a fraction of a pixel, and whether the patches are alike (n,).

    A patch may change by an affine map (Evangelidis and Psarakis 2008, IEEE PAMI 30:1858), as tilted surfaces do.
    """
    found, alike = guesses.copy(), np.zeros(len(guesses), dtype=bool)
    whole, reach = 2 * _HALF + 1, 2 * (_HALF + _MARGIN) + 1
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, 1e-3)
    for row, (place, guess) in enumerate(zip(places.tolist(), guesses.tolist(), strict=True)):
        patch, about = cv2.getRectSubPix(one, (whole, whole), place), cv2.getRectSubPix(two, (reach, reach), guess)
        everywhere = np.ones((reach, reach), dtype=np.uint8)
        start = np.array([[1.0, 0.0, _MARGIN], [0.0, 1.0, _MARGIN]], dtype=np.float32)
        try:
            likeness, warp = cv2.findTransformECC(patch, about, start, cv2.MOTION_AFFINE, criteria, everywhere, 1)
        except cv2.error:  # it ran out of the picture
            continue
        moved = warp @ np.array([_HALF, _HALF, 1.0]) - (_HALF + _MARGIN)
        found[row] += moved
        alike[row] = likeness > _LIKENESS and np.linalg.norm(moved) < _MARGIN
    return found, alike


def _consistent(views: tuple[View, View], one: FloatArray, two: FloatArray) -> NDArray[np.bool_]:
    """Which pairs (n, 2) agree on some motion of the scope, before which they all lie (RANSAC, Nistér 2004)."""
    if len(one) < _LEAST_PAIRS:
        return np.zeros(len(one), dtype=bool)
    flat = [undistorted(view.camera, pixels) for view, pixels in zip(views, (one, two), strict=True)]
    tolerance = _OFF_PX / min(float(view.camera.focal_px.mean()) for view in views)
    cv2.setRNGSeed(0)
    motion, mask = cv2.findEssentialMat(flat[0], flat[1], np.eye(3), cv2.RANSAC, 0.9999, tolerance)
    if motion is None or motion.shape != (3, 3):
        return np.zeros(len(one), dtype=bool)
    _, _, _, before, _ = cv2.recoverPose(motion, flat[0], flat[1], np.eye(3), distanceThresh=1e4, mask=mask)
    agreed: NDArray[np.bool_] = before.ravel() > 0
    return agreed


def _sightings(matched: FloatArray, strengths: FloatArray) -> Sightings:
    """The strongest features of each cell of the first picture; NaN stands for not seen."""
    seen = np.isfinite(matched[:, :, 0])
    usable = np.flatnonzero(seen[1:].any(axis=0))
    if not len(usable):
        return Sightings.none()
    order = usable[np.argsort(-strengths[usable], kind="stable")]
    size = matched[0].max() / _CELLS
    counts: dict[tuple[int, int], int] = {}
    chosen = []
    for row in order:
        cell = (int(matched[0, row, 0] / size), int(matched[0, row, 1] / size))
        if counts.get(cell, 0) < _PER_CELL:
            counts[cell] = counts.get(cell, 0) + 1
            chosen.append(row)
    view, point = np.nonzero(seen[:, chosen])
    return Sightings(point.astype(np.int64), view.astype(np.int64), matched[view, np.array(chosen)[point]], SIGMA_PX)
