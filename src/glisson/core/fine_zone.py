"""Where a mesh is to be finer than elsewhere."""

from dataclasses import dataclass

from glisson.core.arrays import FloatArray, frozen_floats
from glisson.core.errors import BadInput


@dataclass(frozen=True, eq=False)
class FineZone:
    """All within `reach_mm` of points (n, 3), LPS mm, where edges are to be about `edge_length_mm` long."""

    points_mm: FloatArray
    reach_mm: float
    edge_length_mm: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "points_mm", frozen_floats(self.points_mm, (None, 3), "points of a fine zone"))
        if not (len(self.points_mm) and self.reach_mm >= 0.0 and self.edge_length_mm > 0.0):
            raise BadInput(
                f"A fine zone needs points, a reach of at least 0 and an edge length above 0 mm, not "
                f"{len(self.points_mm)} points, {self.reach_mm} and {self.edge_length_mm}."
            )
