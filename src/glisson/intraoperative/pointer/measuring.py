"""Points, distances and strokes by the tip of a pointer, each with what it is sure of."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.observations import Observation, ObservationKind
from glisson.core.tip_track import TipTrack


@dataclass(frozen=True, eq=False)
class PointedAt:
    """A point (3,) in mm that the tip rested on, and its covariance (3, 3)."""

    point_mm: FloatArray
    covariance_mm2: FloatArray


@dataclass(frozen=True)
class Length:
    """A length in mm and its standard deviation."""

    mm: float
    sigma_mm: float


def pointed_at(track: TipTrack) -> PointedAt:
    """The point on which a tip rested: the mean of its places, weighted by their covariances.

    Play and the trocar's own place err alike all the while, so that many places are no surer than one; what they are
    spread by is added.

    Raises:
        BadInput: the track is empty.
    """
    if not len(track):
        raise BadInput("The tip was not seen in this time; choose another.")
    information = np.linalg.inv(track.covariance_mm2)
    typical = np.linalg.inv(information.mean(axis=0))
    point = typical @ np.einsum("nij,nj->i", information, track.points_mm) / len(track)
    off = track.points_mm - point
    return PointedAt(point, typical + off.T @ off / len(track) ** 2)


def distance(one: PointedAt, other: PointedAt) -> Length:
    """Between two points, whose errors are taken as independent.

    Raises:
        BadInput: both are the same point.
    """
    between = other.point_mm - one.point_mm
    length = float(np.linalg.norm(between))
    if length == 0.0:
        raise BadInput("Both ends of the distance are the same point.")
    way = between / length
    return Length(length, float(np.sqrt(way @ (one.covariance_mm2 + other.covariance_mm2) @ way)))


def stroke_length(track: TipTrack) -> Length:
    """Along a smoothed stroke. Errors that its points share do not count; all are taken as independent.

    Raises:
        BadInput: fewer than two points.
    """
    if len(track) < 2:
        raise BadInput("A stroke needs two tips at least.")
    steps = np.diff(track.points_mm, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    ways = steps / np.maximum(lengths, 1e-12)[:, None]
    # Each inner point pulls on the step before and on the one after.
    pulls = np.zeros((len(track), 3))
    pulls[:-1] -= ways
    pulls[1:] += ways
    variance = float(np.einsum("ni,nij,nj->", pulls, track.covariance_mm2, pulls))
    return Length(float(lengths.sum()), float(np.sqrt(variance)))


def as_observation(track: TipTrack, kind: ObservationKind, name: str) -> Observation:
    """A stroke as what was seen: "surface" where it was drawn on the organ, "curve" along a structure, "contact".

    Raises:
        BadInput: the track is empty.
    """
    if not len(track):
        raise BadInput("The tip was not seen in this time; choose another.")
    typical = float(np.sqrt(np.trace(track.covariance_mm2, axis1=1, axis2=2).mean() / 3.0))
    return Observation(
        kind, name, track.points_mm, typical, track.frame, float(track.times_s[0]), covariance_mm2=track.covariance_mm2
    )
