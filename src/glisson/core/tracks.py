"""Markers followed through a video."""

from dataclasses import dataclass
from enum import IntEnum
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray, frozen_floats
from glisson.core.errors import BadInput


class PointState(IntEnum):
    """What became of a marker in a frame."""

    FOLLOWED = 0
    FOUND_AGAIN = 1
    """Followed again from this frame on, after it was lost."""
    LOST = 2
    """Covered, out of the image, or not to be told from its surroundings: it has no place."""


@dataclass(frozen=True, eq=False)
class Tracks:
    """Where markers were seen, frame by frame.

    Args:
        times_s: (n,), increasing.
        places: (n, m, 2) in `unit`, u to the right and v down; NaN where a marker is lost.
        covariance: (n, m, 2, 2) of the places; NaN where a marker is lost.
        states: (n, m) `PointState`.
        unit: "px" of the video's frames, or "mm" in the plane of the tissue.
    """

    times_s: FloatArray
    places: FloatArray
    covariance: FloatArray
    states: NDArray[np.int8]
    unit: Literal["px", "mm"] = "px"

    def __post_init__(self) -> None:
        times = frozen_floats(self.times_s, (None,), "times of tracks")
        if (np.diff(times) <= 0.0).any():
            raise BadInput("The times of tracks must increase from frame to frame.")
        states = np.array(self.states, dtype=np.int8)
        count = (len(times), *states.shape[1:])
        if states.ndim != 2 or states.shape != count:
            raise BadInput(f"The states of tracks must have shape n × m with n = {len(times)}.")
        places = np.array(self.places, dtype=np.float64)
        covariance = np.array(self.covariance, dtype=np.float64)
        if places.shape != (*count, 2) or covariance.shape != (*count, 2, 2):
            raise BadInput("Places and covariances of tracks must have shapes n × m × 2 and n × m × 2 × 2.")
        seen = states != PointState.LOST
        if not (np.isfinite(places[seen]).all() and np.isfinite(covariance[seen]).all()):
            raise BadInput("Tracks have places that are not finite for markers that are not lost.")
        places[~seen] = np.nan
        covariance[~seen] = np.nan
        for name, array in (("times_s", times), ("places", places), ("covariance", covariance), ("states", states)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Whether each marker has a place (n, m)."""
        return np.asarray(self.states != PointState.LOST)

    @property
    def frames_per_s(self) -> float:
        """Frames per second, by the middle one of the times between frames."""
        if len(self.times_s) < 2:
            raise BadInput("A single frame has no frame rate.")
        return float(1.0 / np.median(np.diff(self.times_s)))
