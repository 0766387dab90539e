"""What was seen, held against a model: which material point each seen point belongs to."""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from scipy.spatial import KDTree

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.observations import Observation, Observations
from glisson.geometry.distance import SurfaceTree
from glisson.mechanics.registration.places import MaterialCurve, MaterialPoints, Places
from glisson.mechanics.registration.rows import Rows, joined

_TOUCHING_MM = 1e-6
_ON_EDGE = 1e-9

DRAWN_MM = 1.5
"""A curve of the model, drawn by hand in the scan, is off by so much in each coordinate, all of it alike."""


@dataclass(frozen=True)
class ModelError:
    """How far the model cannot follow the organ, however well it is fitted.

    Args:
        sigma_mm: standard deviation of a material point.
        length_mm: points nearer to each other than this are off together.
    """

    sigma_mm: float
    length_mm: float


@dataclass(frozen=True, eq=False)
class PointErrors:
    """Covariance (p, 3, 3) of each point, the model's error within, and how much it counts beside its neighbours."""

    covariance_mm2: FloatArray
    worth: FloatArray


class Match(Protocol):
    """One observation, held against the model."""

    groups: IntArray
    """Nodes (k, a) that its rows may have in common, beside those of one element."""

    def rows(self, positions: FloatArray, first: int) -> Rows:
        """Its rows, with the nodes at `positions` (n, 3); its points are numbered from `first`."""


class Seen:
    """All that was seen.

    Args:
        places: of the organ.
        observations: in any frame.
        model_error: is added to each point's own.
    """

    def __init__(self, places: Places, observations: Observations, model_error: ModelError) -> None:
        self._matches: list[Match] = []
        counts = []
        for item in (item for item in observations.items if len(item.points_mm)):
            counts.append(len(item.points_mm))
            errors = _errors(item, model_error)
            if item.kind == "landmark":
                self._matches.append(PointMatch(item.points_mm, errors, places.landmark(item.name)))
            elif item.kind == "curve":
                self._matches.append(CurveMatch(item.points_mm, errors, places.curve(item.name)))
            else:
                self._matches.append(SurfaceMatch(item.points_mm, errors, places.tree(item.name)))
        self.labels = [f"{item.kind} {item.name!r}" for item in observations.items if len(item.points_mm)]
        """What each observation is called."""
        self._firsts = np.cumsum([0, *counts[:-1]]).tolist()
        self.item = np.repeat(np.arange(len(counts)), counts)
        """The number of the observation (p,) that each observed point belongs to."""

    @property
    def groups(self) -> list[IntArray]:
        """Nodes (k, a) that rows may have in common, beside those of one element."""
        return [match.groups for match in self._matches if len(match.groups)]

    def rows(self, positions: FloatArray) -> Rows:
        """All rows, with the nodes at `positions` (n, 3)."""
        parts = zip(self._matches, self._firsts, strict=True)
        return joined([match.rows(positions, first) for match, first in parts])


class SurfaceMatch:
    """Points somewhere on a surface: each pulls at the nearest point of it, along the line between them."""

    def __init__(self, points_mm: FloatArray, errors: PointErrors, tree: SurfaceTree) -> None:
        self._points, self._errors, self._tree = points_mm, errors, tree
        self.groups = np.zeros((0, 1), dtype=np.int64)

    def rows(self, positions: FloatArray, first: int) -> Rows:
        """See `Match`."""
        nearest = self._tree.moved(positions).nearest(self._points)
        nodes = self._tree.triangles[nearest.triangles]
        arms = self._points - nearest.closest_mm
        corners = positions[nodes]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        touching = nearest.distance_mm < _TOUCHING_MM
        directions = np.where(touching[:, None], normals, arms)
        pulls = _along(_unit(directions), nearest.distance_mm, self._errors, nodes, nearest.barycentric, first, True)
        return joined([pulls, *self._held(pulls, corners, nearest.barycentric)])

    def _held(self, pulls: Rows, corners: FloatArray, barycentric: FloatArray) -> list[Rows]:
        """Rows without a gap: what is nearest to an edge or a corner stays so however the surface moves a little.

        With them the matrix of a Gauss–Newton step has the true curvature of the squared distance.
        """
        inner = (barycentric > _ON_EDGE).sum(axis=1)
        longest = np.argsort(barycentric, axis=1)
        rows = np.arange(len(corners))
        edge = corners[rows, longest[:, 2]] - corners[rows, longest[:, 1]]
        across_edge = np.cross(edge, pulls.directions)
        found = []
        for chosen, axes in ((inner == 2, (across_edge,)), (inner == 1, _across(pulls.directions))):
            found += [
                replace(pulls, directions=_unit(axis), gaps_mm=np.zeros(len(axis))).some(np.flatnonzero(chosen))
                for axis in axes
            ]
        return found


class PointMatch:
    """A material point that is seen, perhaps several times."""

    def __init__(self, points_mm: FloatArray, errors: PointErrors, place: MaterialPoints) -> None:
        self._points, self._place, self._worth = points_mm, place, errors.worth
        self.groups = place.nodes
        values, self._axes = np.linalg.eigh(errors.covariance_mm2)
        self._sigma = np.sqrt(values)

    def rows(self, positions: FloatArray, first: int) -> Rows:
        """See `Match`: three rows for each, along the axes of its ellipsoid."""
        count = len(self._points)
        gaps = np.einsum("pia,pi->pa", self._axes, self._points - self._place.at(positions))
        return Rows(
            nodes=np.repeat(self._place.nodes, 3 * count, axis=0),
            weights=np.repeat(self._place.weights, 3 * count, axis=0),
            directions=self._axes.transpose(0, 2, 1).reshape(-1, 3),
            gaps_mm=gaps.ravel(),
            sigma_mm=self._sigma.ravel(),
            point=first + np.repeat(np.arange(count), 3),
            worth=np.repeat(self._worth, 3),
            robust=np.zeros(3 * count, dtype=np.bool_),
        )


class CurveMatch:
    """Points along a curve in the tissue, which may slide: each pulls at the nearest point of it."""

    def __init__(self, points_mm: FloatArray, errors: PointErrors, curve: MaterialCurve) -> None:
        self._points, self._errors, self._curve = points_mm, errors, curve
        self.groups = curve.points.nodes[curve.segments].reshape(len(curve.segments), -1)

    def rows(self, positions: FloatArray, first: int) -> Rows:
        """See `Match`: two rows for each, across the curve; beyond its ends the nearest end."""
        places = self._curve.points.at(positions)
        begin, end = (places[self._curve.segments[:, side]] for side in (0, 1))
        along = end - begin
        squared = np.maximum((along**2).sum(axis=1), 1e-12)
        reach = np.einsum("psi,si->ps", self._points[:, None] - begin[None], along) / squared
        share = np.clip(reach, 0.0, 1.0)
        off = np.linalg.norm(self._points[:, None] - begin - share[:, :, None] * along, axis=2)
        nearest = off.argmin(axis=1)
        share = np.take_along_axis(share, nearest[:, None], axis=1)[:, 0]
        ends = self._curve.segments[nearest]
        nodes = np.concatenate([self._curve.points.nodes[ends[:, side]] for side in (0, 1)], axis=1)
        weights = np.concatenate(
            [
                (1.0 - share)[:, None] * self._curve.points.weights[ends[:, 0]],
                share[:, None] * self._curve.points.weights[ends[:, 1]],
            ],
            axis=1,
        )
        arms = self._points - begin[nearest] - share[:, None] * along[nearest]
        first_across, second_across = _across(along[nearest])
        parts = [
            _along(axis, np.einsum("pi,pi->p", arms, axis), self._errors, nodes, weights, first, True)
            for axis in (first_across, second_across)
        ]
        return joined(parts)


def _along(
    directions: FloatArray, gaps: FloatArray, errors: PointErrors, nodes: IntArray, weights: FloatArray, first: int,
    robust: bool,
) -> Rows:  # fmt: skip
    """One row for each point, along its direction."""
    sigma = np.sqrt(np.einsum("pi,pij,pj->p", directions, errors.covariance_mm2, directions))
    numbers, may_lie = first + np.arange(len(gaps)), np.full(len(gaps), robust)
    return Rows(nodes, weights, directions, gaps, sigma, numbers, errors.worth, may_lie)


def _across(along: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors (p, 3) across each of some directions (p, 3), and across each other."""
    unit = _unit(along)
    least = np.eye(3)[np.abs(unit).argmin(axis=1)]
    one = _unit(np.cross(unit, least))
    return one, np.cross(unit, one)


def _unit(vectors: FloatArray) -> FloatArray:
    unit: FloatArray = vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)
    return unit


def _errors(item: Observation, model: ModelError) -> PointErrors:
    count = len(item.points_mm)
    own = item.covariance_mm2
    if own is None:
        own = np.tile(item.sigma_mm**2 * np.eye(3), (count, 1, 1))
    near = KDTree(item.points_mm).query_ball_point(item.points_mm, model.length_mm, return_length=True)
    variance, shared = np.trace(own, axis1=1, axis2=2) / 3.0, model.sigma_mm**2
    drawn = DRAWN_MM**2 if item.kind == "curve" else 0.0
    # Points that are off together by the same error tell no more than one of them does.
    worth = (variance + shared + drawn) / (variance + near * shared + count * drawn)
    return PointErrors(own + (shared + drawn) * np.eye(3), worth)
