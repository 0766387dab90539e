"""What can be said of a case's liver mask and vessels: how they agree with a reference of any origin."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glisson.core.errors import BadInput
from glisson.core.image import Grid
from glisson.framework.case import ORGAN, VESSELS, Case
from glisson.framework.segmentation_scores import SegmentationScores, centreline_dice, segmentation_scores
from glisson.io.images import read_label_maps, read_labels
from glisson.io.label_groups import on_grid_of
from glisson.preoperative.model.regions import ORGAN as LIVER
from glisson.preoperative.vessels.systems import SYSTEMS, UNTOLD


def compare_with_reference(case: Case, path: str | Path) -> SegmentationScores:
    """Scores of the case's liver against a mask: a label map with "liver", or one with a single label.

    Raises:
        BadInput: the mask cannot be read, has several labels and none is the liver, or lies on another grid.
    """
    found = read_labels(case.path(ORGAN))
    return segmentation_scores(found.mask(LIVER), named_mask(path, found.grid, LIVER, "the reference"), found.grid)


def named_mask(path: str | Path, grid: Grid, name: str, what: str) -> NDArray[np.bool_]:
    """A structure [i, j, k] of a label map with that name, or of one with a single label, on a scan's grid.

    Args:
        path: a file, or a DICOM folder.
        grid: the scan's.
        name: the structure's.
        what: what the label map is, for the sentence ("the reference").

    Raises:
        BadInput: it cannot be read, has several labels and none is of that name, or lies on another grid.
    """
    maps = read_label_maps(path)
    named = next((labels for labels in maps if name in labels.names.values()), None)
    if named is None and len(maps) == 1 and len(maps[0].names) == 1:
        named = maps[0]
    if named is None:
        raise BadInput(f"{what.capitalize()} {path} has no label {name!r}; give a mask of that alone.")
    named = on_grid_of(grid, named, f"{what} {path}")
    return named.mask(name if name in named.names.values() else next(iter(named.names.values())))


def given_mask_facts(case: Case) -> dict[str, Any]:
    """The facts of the segment stage where a person gave or corrected the mask: nothing was flagged."""
    return {"volume_ml": read_labels(case.path(ORGAN)).volume_ml(LIVER), "flagged_slices": [], "flags": []}


def compare_vessels(case: Case, path: str | Path) -> dict[str, float | None]:
    """Overlap of the case's vessels with masks of portal and hepatic veins, inside the liver.

    `dice` and `centreline_dice` are those of all vessels together, `right_system` the share of the voxels in both
    whose system is that of the reference (None where it does not tell them apart).

    Raises:
        BadInput: the masks cannot be read, hold no vessels, or lie on another grid.
    """
    found, inside = read_labels(case.path(VESSELS)), read_labels(case.path(ORGAN)).mask(LIVER)
    masks: dict[str, NDArray[np.bool_]] = {}
    for labels in read_label_maps(path):
        for name in set(labels.names.values()) & {*SYSTEMS, UNTOLD}:
            placed = on_grid_of(found.grid, labels, f"the reference {path}")
            masks[name] = placed.mask(name) & inside
    if not any(mask.any() for mask in masks.values()):
        raise BadInput(f"The reference {path} has no label {', '.join((*SYSTEMS, UNTOLD))} inside the liver.")
    reference = np.logical_or.reduce(list(masks.values()))
    whole = (found.voxels > 0) & inside
    right = None
    if set(SYSTEMS) <= set(masks):
        agreeing = sum(int((found.mask(name) & masks[name]).sum()) for name in SYSTEMS)
        right = agreeing / max(int((whole & reference).sum()), 1)
    return {
        "dice": segmentation_scores(whole, reference, found.grid).dice,
        "centreline_dice": centreline_dice(whole, reference),
        "right_system": right,
    }
