"""What was pointed at and drawn with an instrument's tip, from its track to observations, a plane and a surface."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.observations import Observation, Observations
from glisson.core.tip_track import TipTrack
from glisson.intraoperative.pointer.measuring import (
    Length,
    PointedAt,
    as_observation,
    distance,
    pointed_at,
    stroke_length,
)
from glisson.intraoperative.pointer.resection import DrawnPlane, plane_of, surface_of
from glisson.intraoperative.pointer.smoothing import smoothed
from glisson.io.observation_files import write_observations
from glisson.io.surfaces import write_surface
from glisson.io.tip_files import read_tips

OBSERVATIONS, SURFACE = "observations.json", "surface.vtp"


@dataclass(frozen=True)
class Span:
    """A name for what the tip did from one time to another (s)."""

    name: str
    from_s: float
    to_s: float


@dataclass(frozen=True, eq=False)
class Resection:
    """A direction (3,) to the removed side; and perhaps one into the organ with a depth, for a surface."""

    stroke: str
    towards: FloatArray
    into: FloatArray | None = None
    depth_mm: float = 0.0


@dataclass(frozen=True, eq=False)
class Pointed:
    """Points, distances between them, lengths of strokes, and the plane of one of them."""

    frame: str
    points: dict[str, PointedAt]
    distances: dict[tuple[str, str], Length]
    strokes: dict[str, Length]
    plane: DrawnPlane | None
    files: tuple[Path, ...]


def point_and_draw(
    tips: str | Path,
    instrument: str,
    points: Sequence[Span],
    strokes: Sequence[Span],
    resection: Resection | None,
    out: str | Path,
) -> Pointed:
    """Read the track of a tip, and write what was pointed at and drawn into a folder.

    `observations.json` has points as landmarks and strokes as surface points; `surface.vtp` the resection surface.

    Args:
        tips: `tips.json`, as `glisson instruments timeline` writes it.
        instrument: whose tip was the pointer.
        points: when it rested on which point.
        strokes: when it drew which line.
        resection: the stroke that is a resection line, if any.
        out: the folder.

    Raises:
        BadInput: a file cannot be used, the tip was not seen in a span, a stroke is one straight line, or the
            direction to the removed side does not tell it.
        WriteFailed: the disk is full.
    """
    track = _track(tips, instrument)
    rested = {span.name: pointed_at(_part(track, span)) for span in points}
    drawn = {span.name: _drawn(_part(track, span)) for span in strokes}
    if len(rested) + len(drawn) < len(points) + len(strokes):
        raise BadInput("Two points or strokes have the same name.")
    items = [_landmark(track.frame, name, point, points) for name, point in rested.items()]
    items += [as_observation(stroke, "surface", name) for name, stroke in drawn.items()]
    plane, folder = None, Path(out)
    files = [folder / OBSERVATIONS]
    if resection is not None:
        if resection.stroke not in drawn:
            raise BadInput(f"There is no stroke {resection.stroke!r} to make a plane of.")
        plane = plane_of(drawn[resection.stroke], resection.towards)
        if resection.into is not None:
            surface = surface_of(drawn[resection.stroke], resection.into, resection.depth_mm)
            files.append(folder / SURFACE)
            write_surface(files[-1], surface)
    write_observations(files[0], Observations(tuple(items)))
    lengths = {name: stroke_length(stroke) for name, stroke in drawn.items()}
    between = {(a, b): distance(rested[a], rested[b]) for a, b in combinations(rested, 2)}
    return Pointed(track.frame, rested, between, lengths, plane, tuple(files))


def _track(tips: str | Path, instrument: str) -> TipTrack:
    tracks = {track.instrument: track for track in read_tips(tips)}
    if instrument not in tracks:
        raise BadInput(f"{tips} has no track of {instrument!r}; it has {', '.join(tracks) or 'none'}.")
    return tracks[instrument]


def _part(track: TipTrack, span: Span) -> TipTrack:
    part = track.between(span.from_s, span.to_s)
    if not len(part):
        raise BadInput(
            f"The tip of {track.instrument!r} was not seen from {span.from_s:g} to {span.to_s:g} s ({span.name!r})."
        )
    return part


def _drawn(part: TipTrack) -> TipTrack:
    """A stroke without noise. Its covariances stay those of the tips: what these share, smoothing does not lessen."""
    return replace(part, points_mm=smoothed(part).points_mm)


def _landmark(frame: str, name: str, point: PointedAt, spans: Sequence[Span]) -> Observation:
    time = next(span.from_s for span in spans if span.name == name)
    sigma = float(np.sqrt(np.trace(point.covariance_mm2) / 3.0))
    return Observation(
        "landmark", name, point.point_mm[None], sigma, frame, time, covariance_mm2=point.covariance_mm2[None]
    )
