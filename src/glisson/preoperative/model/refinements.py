"""Where a person wants smaller tetrahedra: about the tumours, or in a ball (where a tool will touch, say)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from scipy import ndimage

from glisson.core.fine_zone import FineZone
from glisson.core.image import LabelMap
from glisson.core.parameters import parameter


def _edge_length() -> float:
    """The field of a refinement that says how fine."""
    length: float = parameter(5.0, "Edge length aimed at there in mm.", 0.3, 100.0)
    return length


@dataclass(frozen=True)
class TumourRefinement:
    """About the surface of every tumour; inside a large one elements grow again."""

    reach_mm: float = parameter(5.0, "How far from a tumour's surface, mm.", 0.0, 100.0)
    edge_length_mm: float = _edge_length()

    def zone(self, tumours: LabelMap | None) -> FineZone | None:
        """The zone; None where there is no tumour."""
        if tumours is None or not tumours.voxels.any():
            return None
        inside = tumours.voxels > 0
        rim = np.argwhere(inside & ~ndimage.binary_erosion(inside))
        return FineZone(tumours.grid.points_from_indices(rim), self.reach_mm, self.edge_length_mm)


@dataclass(frozen=True)
class BallRefinement:
    """Inside a ball about a point in LPS mm."""

    centre_mm: tuple[float, float, float]
    radius_mm: float = parameter(20.0, "Radius of the ball, mm.", 0.1, 500.0)
    edge_length_mm: float = _edge_length()

    def zone(self, tumours: LabelMap | None) -> FineZone:
        """The zone, whatever the tumours."""
        return FineZone(np.array([self.centre_mm]), self.radius_mm, self.edge_length_mm)


Refinement = TumourRefinement | BallRefinement

REFINEMENT_KINDS: Mapping[str, type[Refinement]] = MappingProxyType(
    {"tumours": TumourRefinement, "ball": BallRefinement}
)
"""Value of `kind` → class."""


def fine_zones(refinements: Sequence[Refinement], tumours: LabelMap | None) -> tuple[FineZone, ...]:
    """The zones of all refinements that have one."""
    zones = [refinement.zone(tumours) for refinement in refinements]
    return tuple(zone for zone in zones if zone is not None)
