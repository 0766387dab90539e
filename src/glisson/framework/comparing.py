"""What can be said of a case's liver mask: its volume, and how it agrees with a reference of any origin."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glisson.core.errors import BadInput
from glisson.core.image import Grid
from glisson.framework.case import ORGAN, Case
from glisson.framework.segmentation_scores import SegmentationScores, segmentation_scores
from glisson.io.images import read_label_maps, read_labels
from glisson.io.label_groups import on_grid_of
from glisson.preoperative.model.regions import ORGAN as LIVER


def compare_with_reference(case: Case, path: str | Path) -> SegmentationScores:
    """Scores of the case's liver against a mask: a label map with "liver", or one with a single label.

    Raises:
        BadInput: the mask cannot be read, has several labels and none is the liver, or lies on another grid.
    """
    found = read_labels(case.path(ORGAN))
    return segmentation_scores(found.mask(LIVER), liver_mask(path, found.grid, "the reference"), found.grid)


def liver_mask(path: str | Path, grid: Grid, what: str) -> NDArray[np.bool_]:
    """The liver [i, j, k] of a label map with "liver", or of one with a single label, on a scan's grid.

    Args:
        path: a file, or a DICOM folder.
        grid: the scan's.
        what: what it is, for the sentence ("the reference").

    Raises:
        BadInput: it cannot be read, has several labels and none is the liver, or lies on another grid.
    """
    maps = read_label_maps(path)
    named = next((labels for labels in maps if LIVER in labels.names.values()), None)
    if named is None and len(maps) == 1 and len(maps[0].names) == 1:
        named = maps[0]
    if named is None:
        raise BadInput(f"{what.capitalize()} {path} has no label {LIVER!r}; give a mask of the liver alone.")
    named = on_grid_of(grid, named, f"{what} {path}")
    return named.mask(LIVER if LIVER in named.names.values() else next(iter(named.names.values())))


def given_mask_facts(case: Case) -> dict[str, Any]:
    """The facts of the segment stage where a person gave or corrected the mask: nothing was flagged."""
    return {"volume_ml": read_labels(case.path(ORGAN)).volume_ml(LIVER), "flagged_slices": [], "flags": []}
