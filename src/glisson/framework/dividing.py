"""A case's liver divided into Couinaud's segments, and what resections take of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.image import LabelMap
from glisson.core.landmarks import Landmarks
from glisson.core.protocols import Progress, SegmentDivider, silent
from glisson.core.registry import make_technique
from glisson.core.structures import VesselTree
from glisson.framework.case import LANDMARKS, ORGAN, SEGMENTS, SEGMENTS_PICTURE, STRUCTURES, VESSEL_TREES, Case
from glisson.framework.preoperative_stages import labels_of
from glisson.framework.stages import PIPELINE
from glisson.io.images import read_labels, write_labels
from glisson.io.markups import NamedPoints, read_points, write_points
from glisson.io.vessel_files import read_vessels
from glisson.navigation.figures.segment_views import write_segment_views
from glisson.preoperative.segments.landmarks import landmarks_from_points
from glisson.preoperative.segments.numbering import SEGMENT_NAMES
from glisson.preoperative.segments.proposal import propose_landmarks
from glisson.preoperative.segments.resections import ResectionVolumes, resection_volumes
from glisson.preoperative.vessels.centrelines import centreline_trees

BY_BRANCHES, BY_PLANES = "nearest-branch", "planes"
_SMALLEST_TREE_MM = 10.0


@dataclass(frozen=True)
class DividedLiver:
    """The technique that was used, whether its landmarks were only proposed, and each segment's volume in ml."""

    technique: str
    proposed: bool
    volumes_ml: Mapping[str, float]


def divide_liver(
    case: Case,
    landmarks_file: str | Path | None = None,
    technique: str | None = None,
    parameters: Mapping[str, Any] | None = None,
    progress: Progress = silent,
) -> DividedLiver:
    """Write the segments, a picture of them and their landmarks into the case.

    Args:
        case: at least its liver has a mask.
        landmarks_file: a point list of 3D Slicer; none: that of the case, or else what the veins' shape proposes.
        technique: of the kind segment-divider; none: by branches where the portal vein is known, else by planes.
        parameters: of the technique.
        progress: told how far it is.

    Raises:
        BadInput: there is no mask of the liver, or a landmark or vein is missing or cannot be used.
        WriteFailed: the disk is full.
    """
    if not case.has(ORGAN):
        raise BadInput(f"The case has no liver mask yet; run: glisson segment {case.folder}.")
    organ = read_labels(case.path(ORGAN))
    progress(0.0, "centrelines")
    portal = _trees(case, organ, "portal")
    name = technique or (BY_BRANCHES if portal else BY_PLANES)
    divider: SegmentDivider = make_technique("segment-divider", name, parameters or {}, "--technique")
    place = landmarks_file or (case.path(LANDMARKS) if case.has(LANDMARKS) else None)
    if place is None:
        landmarks = propose_landmarks(organ, portal, _trees(case, organ, "hepatic"), _cava(case))
    else:
        given = read_points(place)
        landmarks = landmarks_from_points(given.labels, given.points_mm, str(place))
    progress(0.4, "dividing")
    segments = divider.divide(organ, portal, landmarks)
    _require_whole(segments, organ, name)
    progress(0.7, "drawing")
    if place is None or landmarks_file is not None:
        PIPELINE.replace(case, LANDMARKS, lambda path: write_points(path, _listed(landmarks), "landmarks"))
    PIPELINE.replace(case, SEGMENTS, lambda path: write_labels(path, segments))
    PIPELINE.replace(case, SEGMENTS_PICTURE, lambda path: write_segment_views(path, segments))
    volumes = {label: segments.volume_ml(label) for label in segments.names.values()}
    return DividedLiver(name, place is None, volumes)


def case_resections(case: Case, segments_file: str | Path | None = None) -> tuple[ResectionVolumes, ...]:
    """All resections of a case's segments, or of those in a file.

    Raises:
        BadInput: there are no segments, or they are not Couinaud's eight.
    """
    if segments_file is None and not case.has(SEGMENTS):
        raise BadInput(f"The case has no segments yet; run: glisson couinaud {case.folder}.")
    return resection_volumes(_numbered(read_labels(segments_file or case.path(SEGMENTS))))


def _trees(case: Case, organ: LabelMap, name: str) -> tuple[VesselTree, ...]:
    """Trees of a vein: those of `glisson vessels`, else of its mask inside the liver; none where it is not known."""
    if case.has(VESSEL_TREES):
        return tuple(tree for tree in read_vessels(case.path(VESSEL_TREES)) if tree.name.partition(" ")[0] == name)
    labels = labels_of(case, STRUCTURES)
    if labels is None or name not in labels.names.values():
        return ()
    found = centreline_trees(labels.mask(name) & organ.mask("liver"), organ.grid, _SMALLEST_TREE_MM)
    return tuple(
        VesselTree(f"{name} {n}", tree.points_mm, tree.radii_mm, tree.edges) for n, tree in enumerate(found, 1)
    )


def _cava(case: Case) -> FloatArray | None:
    labels = labels_of(case, STRUCTURES)
    if labels is None or "ivc" not in labels.names.values():
        return None
    return labels.grid.points_from_indices(np.argwhere(labels.mask("ivc")))


def _require_whole(segments: LabelMap, organ: LabelMap, technique: str) -> None:
    """Refuse segments of a technique (maybe a plug-in's) that do not fill the liver, or of which one is empty."""
    if not segments.grid.matches(organ.grid) or not np.array_equal(segments.voxels > 0, organ.mask("liver")):
        raise BadInput(f"The technique {technique!r} did not give every voxel of the liver a segment.")
    empty = [name for number, name in SEGMENT_NAMES.items() if not (segments.voxels == number).any()]
    if empty:
        raise BadInput(f"No voxel of the liver is {' or '.join(empty)}; check the landmarks.")


def _listed(landmarks: Landmarks) -> NamedPoints:
    names = [name for name, points in landmarks.points_mm.items() for _ in points]
    return NamedPoints(tuple(names), np.concatenate(list(landmarks.points_mm.values())))


def _numbered(labels: LabelMap) -> LabelMap:
    """Labels numbered as their names say ("segment 4" is 4), or as they are where no name says so."""
    numbers = {name: number for number, name in SEGMENT_NAMES.items()}
    if not set(numbers) <= set(labels.names.values()):
        return labels
    voxels = np.zeros(labels.grid.shape, dtype=np.uint8)
    for number, name in labels.names.items():
        if name in numbers:
            voxels[labels.voxels == number] = numbers[name]
    return LabelMap(voxels, labels.grid, SEGMENT_NAMES)
