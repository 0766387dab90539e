"""A case's liver mask corrected by clicks."""

from collections.abc import Sequence

import numpy as np

from glisson.core.errors import BadInput
from glisson.core.image import LabelMap
from glisson.core.protocols import Progress, silent
from glisson.framework.case import ORGAN, SCAN, Case
from glisson.framework.stages import PIPELINE
from glisson.io.images import read_labels, read_volume, write_labels
from glisson.preoperative.correction.clicked_mask import Click, ClickedMask
from glisson.preoperative.model.regions import ORGAN as LIVER


def correct_by_clicks(case: Case, clicks: Sequence[Click], progress: Progress = silent) -> tuple[float, float]:
    """Apply clicks to the case's liver, all or none, and tell its volumes (ml) before and after.

    The mask before stays beside the new one, named `previous-…`. The stages after it are out of date then.

    Raises:
        BadInput: the case has no mask or its scan is no CT, or a click cannot be applied.
        WriteFailed: the disk is full.
    """
    if not case.has(ORGAN):
        raise BadInput(f"The case has no liver mask yet; run: glisson segment {case.folder}.")
    before = read_labels(case.path(ORGAN))
    progress(0.0, "smoothing")
    clicked = ClickedMask(read_volume(case.path(SCAN)), before.mask(LIVER))
    for number, click in enumerate(clicks):
        progress(0.5 + 0.5 * number / len(clicks), f"click {number + 1} of {len(clicks)}")
        clicked.apply(click)
    after = LabelMap(clicked.mask.astype(np.uint8), before.grid, {1: LIVER})
    PIPELINE.replace(case, ORGAN, lambda path: write_labels(path, after))
    return before.volume_ml(LIVER), after.volume_ml(LIVER)
