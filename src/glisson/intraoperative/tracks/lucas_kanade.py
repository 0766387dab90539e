"""Markers followed by pyramidal Lucas–Kanade, held to their look in the first frame, and found again when lost."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

import cv2
import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput, StageFailed
from glisson.core.parameters import parameter
from glisson.core.status import Status
from glisson.core.tracks import PointState, Tracks
from glisson.intraoperative.tracks.markers import BORDER_PX, grey_of
from glisson.intraoperative.tracks.patches import RADIUS_PX, Aligned, Patches
from glisson.intraoperative.tracks.searching import expected_places, search

_WINDOW_PX, _LEVELS = 21, 3
_SEARCHES = 3
"""So many lost markers are searched for in a frame; the others have their turn in the next ones."""

_AGAIN = 0.05
"""A marker that was lost must look so much more like itself to be believed."""

_SPOILT = 0.3
_STRETCH_PX = 2.5
"""A patch whose edge is carried by so much more than the other markers' motion carries it is on something else."""

_SYSTEMATIC_PX = 0.02
"""What the patch's covariance does not know of: interpolation, the video's compression."""

_SPOILT_PX = 25.0
"""Times the square of a patch's spoilt share: what glare and edges over a part of it do to its place."""


@dataclass(frozen=True)
class LucasKanadeParameters:
    """When a marker is believed."""

    back_px: float = parameter(1.0, "A marker followed there and back must come to within this of its place (px).", 0.0)
    likeness: float = parameter(0.85, "Least correlation with its look in the first frame.", 0.0, 1.0)
    reach_px: float = parameter(60.0, "How far from where it is expected a lost marker is searched for (px).", 1.0)


class LucasKanade:
    """Frame to frame by pyramidal Lucas–Kanade there and back, then laid onto the first frame (`Patches`)."""

    name: ClassVar[str] = "lucas-kanade"
    summary: ClassVar[str] = "pyramidal optical flow there and back, held to the first frame"
    Parameters: ClassVar[type[LucasKanadeParameters]] = LucasKanadeParameters

    def __init__(self, parameters: LucasKanadeParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """None."""
        return ()

    def track(self, frames: Iterable[tuple[float, NDArray[np.uint8]]], markers_px: FloatArray) -> Tracks:
        """As `glisson.core.protocols.MarkerTracker.track`."""
        run: _Run | None = None
        times = []
        for time_s, image in frames:
            grey = grey_of(image)
            if run is None:
                run = _Run(self._parameters, grey, markers_px)
            else:
                run.follow(grey)
            times.append(time_s)
        if run is None or len(times) < 2:
            raise StageFailed("The video has fewer than two frames that can be read.", Status.UNOBSERVABLE)
        return Tracks(np.array(times), np.array(run.places), np.array(run.covariances), np.array(run.states))


class _Run:
    """The markers in the frame last seen, and what was noted of all frames."""

    def __init__(self, parameters: LucasKanadeParameters, grey: NDArray[np.uint8], markers_px: FloatArray) -> None:
        first = np.asarray(markers_px, dtype=np.float64)
        _check_markers(first, grey.shape)
        self._parameters, self._previous, self._first = parameters, grey, first
        self._patches = Patches(grey, first)
        self._now, self._warps = first.copy(), np.zeros((len(first), 2, 2))
        self._lost_for = np.zeros(len(first), dtype=np.int64)
        self._turn = 0
        self.places, self.states = [first.copy()], [np.full(len(first), PointState.FOLLOWED, dtype=np.int8)]
        # The first place is the marker's by definition.
        self.covariances = [np.broadcast_to(_SYSTEMATIC_PX**2 * np.eye(2), (len(first), 2, 2))]

    def follow(self, grey: NDArray[np.uint8]) -> None:
        """The next frame."""
        states = np.full(len(self._first), PointState.LOST, dtype=np.int8)
        covariance = np.full((len(self._first), 2, 2), np.nan)
        known = np.flatnonzero(self._lost_for == 0)
        if len(known):
            moved, sure = self._flow(grey, known)
            found = self._patches.aligned(grey, known, moved, self._warps[known])
            near = np.linalg.norm(found.places - moved, axis=1) < RADIUS_PX / 3.0
            followed = np.zeros(len(self._first), dtype=bool)
            followed[known[sure]] = True
            self._now[known[sure]] = moved[sure]
            _, warps = expected_places(self._first, self._now, followed, known)
            good = sure & near & self._believed(found, warps, grey.shape, 0.0)
            self._take(known[good], found, good, states, covariance, PointState.FOLLOWED)
        lost = np.flatnonzero(states == PointState.LOST)
        if len(lost):
            self._find_again(grey, lost, states, covariance)
        self._lost_for = np.where(states == PointState.LOST, self._lost_for + 1, 0)
        self._previous = grey
        self.places.append(np.where(states[:, None] == PointState.LOST, np.nan, self._now))
        self.covariances.append(covariance)
        self.states.append(states)

    def _flow(self, grey: NDArray[np.uint8], known: NDArray[np.int64]) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Where the known markers (k,) went (k, 2), and whether they come back from there."""
        start = self._now[known].astype(np.float32)
        there, good = _flow(self._previous, grey, start)
        back, good_back = _flow(grey, self._previous, there)
        off = np.linalg.norm(back - start, axis=1)
        return there.astype(np.float64), good & good_back & (off < self._parameters.back_px)

    def _find_again(
        self, grey: NDArray[np.uint8], lost: NDArray[np.int64], states: NDArray[np.int8], covariance: FloatArray
    ) -> None:
        """Look where the other markers say that a lost one should be, then around there."""
        followed = states != PointState.LOST
        everywhere, warps = expected_places(self._first, self._now, followed, np.arange(len(self._first)))
        guesses, warps = everywhere[lost], warps[lost]
        found = self._patches.aligned(grey, lost, guesses, warps)
        near = np.linalg.norm(found.places - guesses, axis=1) < RADIUS_PX / 2.0
        good = near & self._believed(found, warps, grey.shape, _AGAIN)
        self._take(lost[good], found, good, states, covariance, PointState.FOUND_AGAIN)
        left = np.roll(np.flatnonzero(~good), -self._turn)[:_SEARCHES]
        self._turn += _SEARCHES
        for n in left:
            marker = lost[[n]]
            template = self._patches.templates(marker)[0]
            reach = min(RADIUS_PX + 2.0 * self._lost_for[marker[0]], self._parameters.reach_px)
            place = search(grey, template, guesses[n], reach, self._parameters.likeness)
            # Burnt spots look alike: what lies where another marker should be is taken for that.
            if place is None or np.argmin(np.linalg.norm(everywhere - place, axis=1)) != marker[0]:
                continue
            found = self._patches.aligned(grey, marker, place[None], warps[[n]])
            good = self._believed(found, warps[[n]], grey.shape, _AGAIN)
            self._take(marker[good], found, good, states, covariance, PointState.FOUND_AGAIN)

    def _believed(self, found: Aligned, warps: FloatArray, shape: tuple[int, ...], more: float) -> NDArray[np.bool_]:
        """Whether patches look like the first frame where they lie, are stretched as the others are, and inside."""
        size = np.array([shape[1], shape[0]])
        inside = ((found.places > RADIUS_PX / 2) & (found.places < size - RADIUS_PX / 2)).all(axis=1)
        stretched = np.abs(found.warps - warps).max(axis=(1, 2)) > _STRETCH_PX
        alike = found.likeness > min(self._parameters.likeness + more, 1.0)
        return np.asarray(inside & alike & ~stretched & (found.spoilt < _SPOILT))

    def _take(
        self,
        markers: NDArray[np.int64],
        found: Aligned,
        good: NDArray[np.bool_],
        states: NDArray[np.int8],
        covariance: FloatArray,
        state: PointState,
    ) -> None:
        self._now[markers], self._warps[markers] = found.places[good], found.warps[good]
        more = _SYSTEMATIC_PX**2 + (_SPOILT_PX * found.spoilt[good] ** 2) ** 2
        covariance[markers] = found.covariance[good] + more[:, None, None] * np.eye(2)
        states[markers] = state


def _flow(
    before: NDArray[np.uint8], after: NDArray[np.uint8], places: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Where places (k, 2) of a frame went in another, and whether that is known at all."""
    guess = np.zeros_like(places)
    window = (_WINDOW_PX, _WINDOW_PX)
    there, good, _ = cv2.calcOpticalFlowPyrLK(before, after, places, guess, winSize=window, maxLevel=_LEVELS)
    return np.asarray(there, dtype=np.float32).reshape(-1, 2), np.asarray(good).ravel() > 0


def _check_markers(markers: FloatArray, shape: tuple[int, ...]) -> None:
    if markers.ndim != 2 or markers.shape[1] != 2 or len(markers) == 0 or not np.isfinite(markers).all():
        raise BadInput("Markers are given as one or more finite places u, v in the first frame.")
    size = np.array([shape[1], shape[0]])
    outside = ((markers < BORDER_PX) | (markers > size - 1 - BORDER_PX)).any(axis=1)
    if outside.any():
        u, v = markers[outside][0]
        raise BadInput(
            f"The marker at ({u:.0f}, {v:.0f}) lies less than {BORDER_PX} px from the border of the video's "
            f"{shape[1]} × {shape[0]} px, or outside it."
        )
