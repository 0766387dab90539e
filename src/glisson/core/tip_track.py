"""Where an instrument's tip was over time."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray, frozen_covariance, frozen_floats
from glisson.core.errors import BadInput
from glisson.core.transform import FRAMES, RigidTransform


@dataclass(frozen=True, eq=False)
class TipTrack:
    """Tips (n, 3) in mm with covariance (n, 3, 3) at times (n,) in s, which grow."""

    instrument: str
    frame: str
    times_s: FloatArray
    points_mm: FloatArray
    covariance_mm2: FloatArray

    def __post_init__(self) -> None:
        if self.frame not in FRAMES:
            raise BadInput(
                f"The track of {self.instrument!r} has an unknown frame {self.frame!r}; use one of {FRAMES}."
            )
        times = frozen_floats(self.times_s, (None,), f"times of {self.instrument!r}")
        if (np.diff(times) <= 0.0).any():
            raise BadInput(f"The times of the track of {self.instrument!r} must grow.")
        points = frozen_floats(self.points_mm, (len(times), 3), f"tips of {self.instrument!r}")
        covariance = frozen_covariance(
            self.covariance_mm2, (len(times), 3, 3), f"the tip covariance of {self.instrument!r}"
        )
        for name, value in (("times_s", times), ("points_mm", points), ("covariance_mm2", covariance)):
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self.times_s)

    def between(self, from_s: float, to_s: float) -> "TipTrack":
        """The part from one time to another, both included."""
        chosen = (self.times_s >= from_s) & (self.times_s <= to_s)
        return TipTrack(
            self.instrument, self.frame, self.times_s[chosen], self.points_mm[chosen], self.covariance_mm2[chosen]
        )

    def moved(self, target_from_source: RigidTransform) -> "TipTrack":
        """The same in another frame; the transform's error is added to that of each tip.

        Raises:
            BadInput: the transform does not begin in the track's frame.
        """
        if target_from_source.source != self.frame:
            raise BadInput(
                f"The track is in {self.frame!r}; give a transform from there, not {target_from_source.source!r}."
            )
        covariance = [
            target_from_source.point_covariance(point, own)
            for point, own in zip(self.points_mm, self.covariance_mm2, strict=True)
        ]
        return TipTrack(
            self.instrument,
            target_from_source.target,
            self.times_s,
            target_from_source.apply(self.points_mm),
            np.reshape(covariance, (-1, 3, 3)),
        )
