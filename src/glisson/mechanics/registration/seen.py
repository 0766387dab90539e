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

    def groups(self, first_shift: int) -> IntArray:
        """Nodes (k, a) that its rows may have in common; see `Seen.groups`."""

    def rows(self, positions: FloatArray, shifts_mm: FloatArray, first: int) -> Rows:
        """Its rows, with nodes and curves as in `Seen.rows`; its points are numbered from `first`."""


class Seen:
    """All that was seen.

    Args:
        places: of the organ.
        observations: in any frame.
        model_error: is added to each point's own.
    """

    def __init__(self, places: Places, observations: Observations, model_error: ModelError) -> None:
        self._matches: list[Match] = []
        counts: list[int] = []
        self.curves = 0
        """How many of the observations are curves."""
        for item in (item for item in observations.items if len(item.points_mm)):
            counts.append(len(item.points_mm))
            errors = _errors(item, model_error)
            if item.kind == "landmark":
                self._matches.append(PointMatch(item.points_mm, errors, places.landmark(item.name)))
            elif item.kind == "curve":
                self._matches.append(CurveMatch(item.points_mm, errors, places.curve(item.name), self.curves))
                self.curves += 1
            else:
                self._matches.append(SurfaceMatch(item.points_mm, errors, places.tree(item.name)))
        self.labels = [f"{item.kind} {item.name!r}" for item in observations.items if len(item.points_mm)]
        """What each observation is called."""
        self._firsts = np.cumsum([0, *counts[:-1]]).tolist()
        self.item = np.repeat(np.arange(len(counts)), counts)
        """The number of the observation (p,) that each observed point belongs to."""

    def groups(self, first_shift: int) -> list[IntArray]:
        """Nodes (k, a) that rows may have in common, beside those of one element; shifts are nodes from a number on."""
        found = [match.groups(first_shift) for match in self._matches]
        return [nodes for nodes in found if len(nodes)]

    @property
    def as_drawn(self) -> FloatArray:
        """Shifts (q, 3) of the curves that are none."""
        return np.zeros((self.curves, 3))

    def rows(self, positions: FloatArray, shifts_mm: FloatArray) -> Rows:
        """All rows, with the nodes at `positions` (n, 3) and the curves as far from where they were drawn."""
        parts = zip(self._matches, self._firsts, strict=True)
        return joined([match.rows(positions, shifts_mm, first) for match, first in parts])


class SurfaceMatch:
    """Points somewhere on a surface: each pulls at the nearest point of it, along the line between them."""

    def __init__(self, points_mm: FloatArray, errors: PointErrors, tree: SurfaceTree) -> None:
        self._points, self._errors, self._tree = points_mm, errors, tree

    def groups(self, first_shift: int) -> IntArray:
        """See `Match`."""
        return np.zeros((0, 1), dtype=np.int64)

    def rows(self, positions: FloatArray, shifts_mm: FloatArray, first: int) -> Rows:
        """See `Match`."""
        nearest = self._tree.moved(positions).nearest(self._points)
        nodes = self._tree.triangles[nearest.triangles]
        arms = self._points - nearest.closest_mm
        corners = positions[nodes]
        touching = np.flatnonzero(nearest.distance_mm < _TOUCHING_MM)
        arms[touching] = _normals(corners[touching])
        pulls = _along(_unit(arms), nearest.distance_mm, self._errors, nodes, nearest.barycentric, first)
        return joined([pulls, *self._held(pulls, corners, nearest.barycentric)])

    def _held(self, pulls: Rows, corners: FloatArray, barycentric: FloatArray) -> list[Rows]:
        """Rows without a gap: what is nearest to an edge or a corner stays so however the surface moves a little.

        With them the matrix of a Gauss–Newton step has the true curvature of the squared distance.
        """
        inner = (barycentric > _ON_EDGE).sum(axis=1)
        nearest = np.argsort(barycentric, axis=1)
        rows = np.arange(len(corners))
        edge = corners[rows, nearest[:, 2]] - corners[rows, nearest[:, 1]]
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
        values, self._axes = np.linalg.eigh(errors.covariance_mm2)
        self._sigma = np.sqrt(values)

    def groups(self, first_shift: int) -> IntArray:
        """See `Match`."""
        return self._place.nodes

    def rows(self, positions: FloatArray, shifts_mm: FloatArray, first: int) -> Rows:
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
            curve=np.full(3 * count, -1),
        )


class CurveMatch:
    """Points along a curve in the tissue, which may slide: each pulls at the nearest point of it."""

    def __init__(self, points_mm: FloatArray, errors: PointErrors, curve: MaterialCurve, number: int) -> None:
        self._points, self._errors, self._curve, self._number = points_mm, errors, curve, number

    def groups(self, first_shift: int) -> IntArray:
        """See `Match`."""
        segments = self._curve.segments
        nodes = self._curve.points.nodes[segments].reshape(len(segments), -1)
        return np.concatenate([nodes, np.full((len(nodes), 1), first_shift + self._number)], axis=1)

    def rows(self, positions: FloatArray, shifts_mm: FloatArray, first: int) -> Rows:
        """See `Match`: two rows for each, across the curve, which goes on straight beyond its ends."""
        places = self._curve.points.at(positions) + shifts_mm[self._number]
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
            _along(axis, np.einsum("pi,pi->p", arms, axis), self._errors, nodes, weights, first)
            for axis in (first_across, second_across)
        ]
        rows = joined(parts)
        return replace(rows, curve=np.full(len(rows.gaps_mm), self._number))


def _along(
    directions: FloatArray, gaps: FloatArray, errors: PointErrors, nodes: IntArray, weights: FloatArray, first: int
) -> Rows:
    """One row for each point, along its direction; it may be an outlier."""
    sigma = np.sqrt(np.einsum("pi,pij,pj->p", directions, errors.covariance_mm2, directions))
    numbers, may_lie = first + np.arange(len(gaps)), np.ones(len(gaps), dtype=np.bool_)
    return Rows(nodes, weights, directions, gaps, sigma, numbers, errors.worth, may_lie, np.full(len(gaps), -1))


def _across(along: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors (p, 3) across each of some directions (p, 3), and across each other."""
    unit = _unit(along)
    least = np.eye(3)[np.abs(unit).argmin(axis=1)]
    one = _unit(np.cross(unit, least))
    return one, np.cross(unit, one)


def _normals(corners: FloatArray) -> FloatArray:
    """Normals (t, 3), of any length, of triangles with corners (t, 3, 3)."""
    normals: FloatArray = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return normals


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
    # Points that are off together by the same error tell no more than one of them does.
    worth = (variance + shared) / (variance + near * shared)
    return PointErrors(own + shared * np.eye(3), worth)
