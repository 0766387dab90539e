"""Couinaud's segments by their blood supply: each voxel belongs to the nearest labelled portal branch.

The approximation is that of Selle et al. (2002, IEEE Transactions on Medical Imaging 21:1344). Left and right liver are
parted along the middle hepatic vein, a little to its right, where surgeons cut (dissertation, section 2.2).
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from glisson.core.image import LabelMap
from glisson.core.landmarks import Landmarks
from glisson.core.parameters import parameter
from glisson.core.structures import VesselTree
from glisson.preoperative.segments.caudate import CAUDATE, in_caudate
from glisson.preoperative.segments.fissures import MIDDLE, fissure
from glisson.preoperative.segments.landmarks import BRANCHES
from glisson.preoperative.segments.numbering import CAUDATE_NUMBER, segment_map
from glisson.preoperative.segments.portal_branches import branch_segments
from glisson.preoperative.segments.territories import nearest_labels

_LEFT_LIVER = (2, 3, 4)


@dataclass(frozen=True)
class NearestBranchParameters:
    """Where the cut runs."""

    right_of_middle_vein_mm: float = parameter(
        3.0, "How far right of the middle hepatic vein's axis the left and right liver part, mm.", 0.0, 20.0
    )


class NearestBranch:
    """The territory of each segment's portal branches, left and right liver parted beside the middle hepatic vein."""

    name: ClassVar[str] = "nearest-branch"
    summary: ClassVar[str] = "The nearest portal branch, with left and right parted beside the middle hepatic vein."
    Parameters: ClassVar[type[NearestBranchParameters]] = NearestBranchParameters
    landmarks: ClassVar[tuple[str, ...]] = tuple(dict.fromkeys((*BRANCHES, *MIDDLE, *CAUDATE)))

    def __init__(self, parameters: NearestBranchParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """None."""
        return ()

    def divide(self, organ: LabelMap, portal: tuple[VesselTree, ...], landmarks: Landmarks) -> LabelMap:
        """Segments of the liver; see `glisson.core.protocols.SegmentDivider`."""
        landmarks.require(self.landmarks)
        branches, segments = branch_segments(portal, landmarks)
        mask = organ.mask("liver")
        points = organ.grid.points_from_indices(np.argwhere(mask))
        cut = fissure(landmarks, MIDDLE, self._parameters.right_of_middle_vein_mm)
        is_left = np.zeros_like(mask)
        is_left[mask] = cut.distance_mm(points) > 0.0
        feeds_left = np.isin(segments, _LEFT_LIVER)
        # Either side has its own branches, whatever is nearer beyond the cut; voxels outside a side stay 0.
        voxels = nearest_labels(is_left, organ.grid, branches[feeds_left], segments[feeds_left])
        voxels += nearest_labels(mask & ~is_left, organ.grid, branches[~feeds_left], segments[~feeds_left])
        numbers = voxels[mask]
        numbers[in_caudate(points, landmarks)] = CAUDATE_NUMBER
        return segment_map(organ, numbers)
