"""A video's markers followed from its first frame to its last."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.errors import BadInput, StageFailed
from glisson.core.protocols import MarkerTracker, Progress, silent
from glisson.core.registry import make_technique
from glisson.core.status import Status
from glisson.core.tracks import Tracks
from glisson.intraoperative.tracks.markers import corners, dark_spots
from glisson.io.video import Frame, open_video

TECHNIQUE = "lucas-kanade"
MOST = 20
FINDERS = {"spots": dark_spots, "corners": corners}
"""How markers are found in the first frame."""


@dataclass(frozen=True, eq=False)
class TrackedVideo:
    """What came of a video: tracks, its first frame, sentences on it, and how fast it went.

    `frames_per_s` is of the whole work, reading and decoding the file among it; `following_per_s` without these.
    """

    tracks: Tracks
    first: NDArray[np.uint8]
    notes: tuple[str, ...]
    frames_per_s: float
    following_per_s: float


def track_video(
    path: str | Path,
    markers_px: FloatArray | None = None,
    find: str = "spots",
    count: int | None = None,
    technique: str = TECHNIQUE,
    camera: Camera | None = None,
    progress: Progress = silent,
) -> TrackedVideo:
    """Follow markers: those given (m, 2) px in the first frame, or `count` that are found there (None: up to 20).

    `camera` is what took the video, if that is known.

    Raises:
        BadInput: the video cannot be read or is not of the camera's size, or a marker lies outside.
        StageFailed: too few markers are found, or the video has fewer than two frames.
    """
    tracker: MarkerTracker = make_technique("marker-tracker", technique, {}, "--technique")
    with open_video(path, progress) as video:
        if camera is not None and (video.width, video.height) != (camera.width, camera.height):
            raise BadInput(
                f"{path} has {video.width} × {video.height} px, its camera was calibrated at {camera.width} × "
                f"{camera.height} px; give the camera that took it."
            )
        frames = iter(video)
        first = next(frames, None)
        if first is None:
            raise StageFailed(f"{path} has no frame that can be read.", Status.UNOBSERVABLE)
        markers = FINDERS[find](first.image, count or MOST, count or 1) if markers_px is None else markers_px
        timed = _Timed(chain([first], frames))
        started = perf_counter()
        tracks = tracker.track(timed.frames(), markers)
        seconds = perf_counter() - started
        notes = () if video.early_end is None else (video.early_end,)
    number = len(tracks.times_s)
    return TrackedVideo(tracks, first.image, notes, number / seconds, number / max(seconds - timed.seconds, 1e-9))


class _Timed:
    """Frames as a tracker takes them, and the seconds that reading them took."""

    def __init__(self, frames: Iterator[Frame]) -> None:
        self._frames = frames
        self.seconds = 0.0

    def frames(self) -> Iterator[tuple[float, NDArray[np.uint8]]]:
        """Times and pictures."""
        while True:
            started = perf_counter()
            frame = next(self._frames, None)
            self.seconds += perf_counter() - started
            if frame is None:
                return
            yield frame.time_s, frame.image
