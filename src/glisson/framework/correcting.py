"""A case's liver mask corrected by clicks or by drawn slices."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from glisson.core.errors import BadInput
from glisson.core.image import LabelMap
from glisson.core.protocols import Progress, silent
from glisson.framework.case import ORGAN, SCAN, Case
from glisson.framework.comparing import named_mask
from glisson.framework.stages import PIPELINE
from glisson.io.images import read_labels, read_volume, write_labels
from glisson.preoperative.correction.clicked_mask import Click, ClickedMask
from glisson.preoperative.correction.drawn_slices import DrawnSlices
from glisson.preoperative.model.regions import ORGAN as LIVER


def correct_by_clicks(case: Case, clicks: Sequence[Click], progress: Progress = silent) -> tuple[float, float]:
    """Apply clicks to the case's liver, all or none, and tell its volumes (ml) before and after.

    The mask before stays beside the new one, named `previous-…`. The stages after it are out of date then.

    Raises:
        BadInput: the case has no mask or its scan is no CT, or a click cannot be applied.
        WriteFailed: the disk is full.
    """
    before = _mask_before(case)
    progress(0.0, "smoothing")
    clicked = ClickedMask(read_volume(case.path(SCAN)), before.mask(LIVER))
    for number, click in enumerate(clicks):
        progress(0.5 + 0.5 * number / len(clicks), f"click {number + 1} of {len(clicks)}")
        clicked.apply(click)
    return _replaced(case, before, clicked.mask)


def correct_by_slices(
    case: Case, drawn: str | Path, numbers: Sequence[int] | None, progress: Progress = silent
) -> tuple[float, float]:
    """Take slices of a drawn mask as right, let the others follow, and tell the volumes (ml) before and after.

    Args:
        case: the case; the mask before stays beside the new one, and the stages after it are out of date then.
        drawn: a label map with "liver", or with a single label, on the scan's grid.
        numbers: which of its slices are right; None: all that have a voxel.
        progress: told how far it is.

    Raises:
        BadInput: the case has no mask, or the drawn one cannot be used.
        WriteFailed: the disk is full.
    """
    before = _mask_before(case)
    slices = _drawn_slices(before, drawn, numbers)
    return _replaced(case, before, slices.followed(read_volume(case.path(SCAN)), progress))


def suggest_slices(case: Case, count: int, drawn: str | Path | None, numbers: Sequence[int] | None) -> tuple[int, ...]:
    """The slices to draw next, the most useful first; with those drawn so far as in `correct_by_slices`.

    Raises:
        BadInput: the case has no mask, or the drawn one cannot be used.
    """
    return _drawn_slices(_mask_before(case), drawn, numbers).suggested(count)


def _mask_before(case: Case) -> LabelMap:
    if not case.has(ORGAN):
        raise BadInput(f"The case has no liver mask yet; run: glisson segment {case.folder}.")
    return read_labels(case.path(ORGAN))


def _drawn_slices(before: LabelMap, drawn: str | Path | None, numbers: Sequence[int] | None) -> DrawnSlices:
    mask = before.mask(LIVER)
    if drawn is None:
        return DrawnSlices(mask, mask, (), before.grid)
    slices = DrawnSlices(mask, named_mask(drawn, before.grid, LIVER, "the drawn mask"), numbers, before.grid)
    if not slices.numbers:
        raise BadInput(f"The drawn mask {drawn} is empty; draw the liver in some of its slices.")
    return slices


def _replaced(case: Case, before: LabelMap, mask: NDArray[np.bool_]) -> tuple[float, float]:
    after = LabelMap(mask.astype(np.uint8), before.grid, {1: LIVER})
    PIPELINE.replace(case, ORGAN, lambda path: write_labels(path, after))
    return before.volume_ml(LIVER), after.volume_ml(LIVER)
