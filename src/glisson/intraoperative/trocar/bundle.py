"""Bundle adjustment of crosses and views (Triggs et al. 2000): poses of both and a common factor of the sizes."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.crosses import CrossLayout, unit_corners
from glisson.core.marker_colours import MARKER_COLOURS
from glisson.core.transform import RigidTransform, cross_matrix
from glisson.geometry.rotations import nearest_rotation
from glisson.intraoperative.cameras.adjustment import Minimum, NormalEquations, minimum
from glisson.intraoperative.cameras.projection import project_with_jacobian
from glisson.intraoperative.trocar.corners import SeenCorners
from glisson.intraoperative.trocar.growth import LIKELY_GROWTH_PX

_ROBUST = 3.0
"""Corners that err by more standard deviations weigh less (Huber)."""


@dataclass(frozen=True, eq=False)
class Bundle:
    """Corners of each view, `camera_from_room` of each, and `room_from_cross` of each cross of the layout.

    Unknowns are the poses of all crosses but the first, of all views, the factor of the sizes, and how far each ink
    seems to have grown.
    """

    views: Sequence[SeenCorners]
    poses: Sequence[RigidTransform]
    places: Sequence[RigidTransform]
    size_factor: float = 1.0
    growth_px: FloatArray = field(default_factory=lambda: np.zeros(len(MARKER_COLOURS)))


@dataclass(frozen=True, eq=False)
class Adjusted:
    """Places with covariance, the factor of the sizes, and the corners' error."""

    places: tuple[RigidTransform, ...]
    size_factor: float
    size_sigma: float
    residual_px: float


def adjusted(
    bundle: Bundle, camera: Camera, layout: CrossLayout, first: int, second: int, length_mm: float, sigma_mm: float
) -> Adjusted:
    """The bundle of least error, with the distance of two crosses (numbers) known.

    Raises:
        StageFailed: it does not converge.
    """
    known = (first, second, length_mm, sigma_mm)
    found = minimum(bundle, lambda state: _equations(state, camera, layout, known)[0], _moved)
    return _told(found, camera, layout, _equations(found.state, camera, layout, known)[1])


def _told(found: Minimum[Bundle], camera: Camera, layout: CrossLayout, errors: FloatArray) -> Adjusted:
    bundle, equations = found.state, found.equations
    freedom = max(2 * len(errors) + 1 - len(equations.gradient), 1)
    covariance = np.linalg.inv(equations.matrix) * max(1.0, 2.0 * equations.cost / freedom)
    size_sigma = float(np.sqrt(covariance[-1 - len(MARKER_COLOURS), -1 - len(MARKER_COLOURS)]))
    count = len(bundle.places)
    of_places = np.zeros((6 * count, 6 * count))
    of_places[6:, 6:] = covariance[: 6 * count - 6, : 6 * count - 6]
    designed = [cross.room_from_cross for cross in layout.crosses]
    residual = float(np.sqrt(np.mean(errors**2)) * camera.focal_px.mean())
    places = in_frame_of(designed, bundle.places, of_places)
    return Adjusted(places, bundle.size_factor, size_sigma, residual)


def in_frame_of(
    designed: Sequence[RigidTransform], places: Sequence[RigidTransform], covariance: FloatArray
) -> tuple[RigidTransform, ...]:
    """Places moved together so that their middles are nearest to the designed ones, with covariance in that frame.

    A frame that one cross alone held would pass its errors on to all others; the middles of all hold it better
    (the S-transformation of geodesy, Baarda 1973).

    Args:
        designed: where the crosses should hang.
        places: where they hang, in a frame of their own.
        covariance: of all places (6n, 6n).
    """
    have, want = (np.array([place.translation_mm for place in some]) for some in (places, designed))
    middle, aim = have.mean(axis=0), want.mean(axis=0)
    rotation = nearest_rotation((want - aim).T @ (have - middle))
    motion = RigidTransform("room", "room", rotation, aim - rotation @ middle)
    moved = [motion.after(place) for place in places]
    turned = np.kron(np.eye(2 * len(places)), rotation)
    # A common motion g of all changes the places by `common` g; what the middles have of it is taken away.
    common = np.concatenate(
        [
            np.block([[np.eye(3), np.zeros((3, 3))], [-cross_matrix(place.translation_mm - aim), np.eye(3)]])
            for place in moved
        ]
    )
    middles = common * np.tile([0.0, 0.0, 0.0, 1.0, 1.0, 1.0], len(places))[:, None]
    kept = np.eye(len(covariance)) - common @ np.linalg.solve(middles.T @ common, middles.T)
    kept = kept @ turned
    spread = kept @ covariance @ kept.T
    return tuple(
        replace(place, covariance=spread[6 * n : 6 * n + 6, 6 * n : 6 * n + 6]) for n, place in enumerate(moved)
    )


def _moved(bundle: Bundle, step: FloatArray) -> Bundle:
    """The bundle after a step."""
    crosses = 6 * (len(bundle.places) - 1)
    places = [place.moved(step[6 * n : 6 * n + 6]) for n, place in enumerate(bundle.places[1:])]
    poses = [pose.moved(step[crosses + 6 * v : crosses + 6 * v + 6]) for v, pose in enumerate(bundle.poses)]
    factor = bundle.size_factor + float(step[-1 - len(MARKER_COLOURS)])
    return Bundle(
        bundle.views, poses, [bundle.places[0], *places], factor, bundle.growth_px + step[-len(MARKER_COLOURS) :]
    )


def _equations(
    bundle: Bundle, camera: Camera, layout: CrossLayout, known: tuple[int, int, float, float]
) -> tuple[NormalEquations, FloatArray]:
    """The normal equations of the robust squared error over all unknowns, and the errors (n, 2) of the slopes."""
    crosses = 6 * (len(bundle.places) - 1)
    size = crosses + 6 * len(bundle.poses) + 1 + len(MARKER_COLOURS)
    normal, gradient, cost = np.zeros((size, size)), np.zeros(size), 0.0
    errors = []
    slopes_of = Camera(camera.width, camera.height, np.ones(2), np.zeros(2))
    for v, (view, pose) in enumerate(zip(bundle.views, bundle.poses, strict=True)):
        for number in view.crosses:
            rows = view.cross == number
            flat = unit_corners()[view.corner[rows]] * layout.crosses[number].size_mm
            place = bundle.places[number]
            turned = np.column_stack([flat, np.zeros(len(flat))]) @ place.rotation.T
            arms = turned * bundle.size_factor
            seen, by_all = project_with_jacobian(slopes_of, pose, arms + place.translation_mm)
            growth = np.zeros((len(flat), 2, len(MARKER_COLOURS))) if view.growth is None else view.growth[rows]
            off = seen + growth @ bundle.growth_px - view.slopes[rows]
            by_point = by_all[:, :, 3:6] @ pose.rotation
            columns = [crosses + 6 * v + k for k in range(6)]
            jacobian = [by_all[:, :, :6]]
            if number > 0:
                columns += [6 * (number - 1) + k for k in range(6)]
                jacobian += [by_point @ -np.array([cross_matrix(arm) for arm in arms]), by_point]
            columns += range(size - 1 - len(MARKER_COLOURS), size)
            jacobian += [by_point @ turned[:, :, None], growth]
            by_unknowns = np.concatenate(jacobian, axis=2)
            information = view.information[rows]
            squares = np.einsum("ni,nij,nj->n", off, information, off)
            sigmas = np.sqrt(np.maximum(squares, 1e-12))
            weights = np.minimum(1.0, _ROBUST / sigmas)
            cost += float(np.where(sigmas < _ROBUST, squares, _ROBUST * (2.0 * sigmas - _ROBUST)).sum())
            weighted = np.einsum("n,nij,njk->nik", weights, information, by_unknowns)
            normal[np.ix_(columns, columns)] += np.einsum("nij,nik->jk", by_unknowns, weighted)
            gradient[columns] += np.einsum("nik,ni->k", weighted, off)
            errors.append(off)
    cost += _add_distance(bundle, known, normal, gradient)
    last = slice(size - len(MARKER_COLOURS), size)
    normal[last, last] += np.eye(len(MARKER_COLOURS)) / LIKELY_GROWTH_PX**2
    gradient[last] += bundle.growth_px / LIKELY_GROWTH_PX**2
    cost += float(np.sum((bundle.growth_px / LIKELY_GROWTH_PX) ** 2))
    return NormalEquations(0.5 * cost, gradient, normal), np.concatenate(errors)


def _add_distance(
    bundle: Bundle, known: tuple[int, int, float, float], normal: FloatArray, gradient: FloatArray
) -> float:
    first, second, length_mm, sigma_mm = known
    apart = bundle.places[second].translation_mm - bundle.places[first].translation_mm
    distance = float(np.linalg.norm(apart))
    row = np.zeros(len(gradient))
    for number, sign in ((first, -1.0), (second, 1.0)):
        if number > 0:
            row[6 * (number - 1) + 3 : 6 * number] = sign * apart / distance
    off = distance - length_mm
    normal += np.outer(row, row) / sigma_mm**2
    gradient += row * off / sigma_mm**2
    return (off / sigma_mm) ** 2
