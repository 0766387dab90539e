"""What was seen during surgery: points, curves and contacts, each with time, sigma and frame."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from glisson.core.arrays import FloatArray, frozen_floats
from glisson.core.errors import BadInput
from glisson.core.transform import FRAMES

ObservationKind = Literal["surface", "landmark", "curve", "contact"]


@dataclass(frozen=True, eq=False)
class Observation:
    """Points (n, 3) in mm seen together.

    Args:
        kind: "surface" (somewhere on the organ's surface), "landmark" (the material point `name`),
            "curve" (along the structure `name`, may slide), "contact" (the tool `name` touches here).
        sigma_mm: standard deviation of each coordinate, used where `covariance_mm2` is None.
        covariance_mm2: (n, 3, 3) per point.
        normals: (n, 3) outward unit normals, if known.
    """

    kind: ObservationKind
    name: str
    points_mm: FloatArray
    sigma_mm: float
    frame: str = "patient"
    time_s: float = 0.0
    normals: FloatArray | None = None
    covariance_mm2: FloatArray | None = None

    def __post_init__(self) -> None:
        if self.kind not in ("surface", "landmark", "curve", "contact"):
            raise BadInput(f"Observation {self.name!r} has an unknown kind {self.kind!r}.")
        if self.frame not in FRAMES:
            raise BadInput(f"Observation {self.name!r} has an unknown frame {self.frame!r}; use one of {FRAMES}.")
        if not (np.isfinite(self.sigma_mm) and self.sigma_mm > 0.0 and np.isfinite(self.time_s)):
            raise BadInput(f"Observation {self.name!r} needs a positive sigma and a finite time.")
        points = frozen_floats(self.points_mm, (None, 3), f"points of observation {self.name!r}")
        object.__setattr__(self, "points_mm", points)
        if self.normals is not None:
            normals = frozen_floats(self.normals, (len(points), 3), "observation normals")
            object.__setattr__(self, "normals", normals)
        if self.covariance_mm2 is not None:
            covariance = frozen_floats(self.covariance_mm2, (len(points), 3, 3), "point covariance")
            if not _is_covariance(covariance):
                raise BadInput(
                    f"A covariance of observation {self.name!r} is not symmetric, or negative along an axis."
                )
            object.__setattr__(self, "covariance_mm2", covariance)


@dataclass(frozen=True)
class Observations:
    """All that was seen, in one frame."""

    items: tuple[Observation, ...]

    def __post_init__(self) -> None:
        frames = {item.frame for item in self.items}
        if len(frames) > 1:
            raise BadInput(f"Observations mix the frames {sorted(frames)}; transform them into one first.")

    @property
    def frame(self) -> str:
        """The frame that all items share ("patient" when there are none)."""
        return self.items[0].frame if self.items else "patient"


def _is_covariance(matrices: FloatArray) -> bool:
    """Whether all of (n, 3, 3) are symmetric and without a negative eigenvalue, up to rounding."""
    size = 1e-9 * np.abs(matrices).max(initial=0.0)
    symmetric = np.abs(matrices - matrices.transpose(0, 2, 1)).max(initial=0.0) <= size
    return bool(symmetric and np.linalg.eigvalsh(matrices).min(initial=0.0) >= -size)
