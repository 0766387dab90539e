"""Couinaud's segments by planes: for scans in which the portal branches cannot be followed.

The radiologist's scheme (Bismuth 1982; Soyer 1993): three fissures along the hepatic veins, and a plane across at the
height of the portal vein on either side.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from glisson.core.image import LabelMap
from glisson.core.landmarks import Landmarks
from glisson.core.parameters import parameter
from glisson.core.structures import VesselTree
from glisson.preoperative.segments.caudate import CAUDATE, in_caudate
from glisson.preoperative.segments.fissures import (
    LEFT,
    LEFT_ACROSS,
    MIDDLE,
    RIGHT,
    RIGHT_ACROSS,
    fissure,
    portal_plane,
)
from glisson.preoperative.segments.numbering import CAUDATE_NUMBER, segment_map


@dataclass(frozen=True)
class DividingPlanesParameters:
    """Where the cut runs."""

    right_of_middle_vein_mm: float = parameter(
        0.0, "How far right of the middle hepatic vein's axis the left and right liver part, mm.", 0.0, 20.0
    )


class DividingPlanes:
    """Fissures through the three hepatic veins, and planes through the portal vein."""

    name: ClassVar[str] = "planes"
    summary: ClassVar[str] = "Planes through the three hepatic veins and the portal vein (Bismuth), from landmarks."
    Parameters: ClassVar[type[DividingPlanesParameters]] = DividingPlanesParameters
    landmarks: ClassVar[tuple[str, ...]] = tuple(
        dict.fromkeys((*RIGHT, *MIDDLE, *LEFT, *RIGHT_ACROSS, *LEFT_ACROSS, *CAUDATE))
    )

    def __init__(self, parameters: DividingPlanesParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """None."""
        return ()

    def divide(self, organ: LabelMap, portal: tuple[VesselTree, ...], landmarks: Landmarks) -> LabelMap:
        """Segments of the liver; see `glisson.core.protocols.SegmentDivider`. The portal trees are not used."""
        landmarks.require(self.landmarks)
        mask = organ.mask("liver")
        points = organ.grid.points_from_indices(np.argwhere(mask))
        beside = self._parameters.right_of_middle_vein_mm
        right, middle, left = fissure(landmarks, RIGHT), fissure(landmarks, MIDDLE, beside), fissure(landmarks, LEFT)
        lateral, medial, anterior = (plane.distance_mm(points) > 0.0 for plane in (left, middle, right))
        above_right, above_left = (
            portal_plane(landmarks, names).distance_mm(points) > 0.0 for names in (RIGHT_ACROSS, LEFT_ACROSS)
        )
        right_liver = np.where(anterior, np.where(above_right, 8, 5), np.where(above_right, 7, 6))
        # The left fissure is asked first, so a point beyond it is 2 or 3 even where the planes cross.
        numbers = np.where(lateral, np.where(above_left, 2, 3), np.where(medial, 4, right_liver))
        numbers[in_caudate(points, landmarks)] = CAUDATE_NUMBER
        return segment_map(organ, numbers)
