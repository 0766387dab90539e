"""Named points that a person placed in a scan, or that were proposed (LPS mm)."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from glisson.core.arrays import FloatArray, frozen_floats
from glisson.core.errors import BadInput


@dataclass(frozen=True, eq=False)
class Landmarks:
    """One or more points (n, 3) under each name."""

    points_mm: Mapping[str, FloatArray]

    def __post_init__(self) -> None:
        points = {name: frozen_floats(found, (None, 3), f"landmark {name}") for name, found in self.points_mm.items()}
        object.__setattr__(self, "points_mm", MappingProxyType(points))

    def require(self, names: tuple[str, ...]) -> None:
        """Raise BadInput unless all names are there, those without a point being told."""
        missing = [name for name in names if len(self.points_mm.get(name, ())) == 0]
        if missing:
            raise BadInput(f"The landmarks lack {', '.join(map(repr, missing))}; add points with these names.")

    def one(self, name: str) -> FloatArray:
        """The point (3,) of a name, or the mean of its points.

        Raises:
            BadInput: there is none.
        """
        self.require((name,))
        point: FloatArray = self.points_mm[name].mean(axis=0)
        return point
