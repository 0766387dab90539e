"""A case's scan replaced by one with fewer streaks, the record of what was done, and the way back."""

import numpy as np

from glisson.core.errors import BadInput
from glisson.core.image import LabelMap
from glisson.core.protocols import Progress, silent
from glisson.framework.case import ARTEFACTS, ARTEFACTS_PICTURE, LOST, SCAN, Case
from glisson.framework.case_warnings import ARTEFACTS_SCHEMA
from glisson.framework.pipeline import previous
from glisson.framework.stages import PIPELINE
from glisson.io.images import read_volume, write_labels, write_volume
from glisson.io.records import write_json
from glisson.navigation.figures.streak_views import write_streak_views
from glisson.preoperative.artefacts.cleaning import CleanedScan, cleaned_scan
from glisson.preoperative.imaging.axial import slice_axis


def clean_case(case: Case, progress: Progress = silent) -> CleanedScan:
    """Replace the case's CT by one with fewer streaks; the original stays beside it, named `previous-…`.

    A scan without metal and streaks stays as it is.

    Raises:
        BadInput: the scan is no CT, its values are no HU, or it was cleaned already.
        WriteFailed: the disk is full.
    """
    if case.has(ARTEFACTS):
        raise BadInput(f"The scan was cleaned already; to start anew: glisson artefacts {case.folder} --undo.")
    before = read_volume(case.path(SCAN))
    cleaned = cleaned_scan(before, progress)
    if cleaned.sentences:
        axis = slice_axis(before.grid)
        lost = LabelMap(cleaned.lost.astype(np.uint8), before.grid, {1: "lost"})
        PIPELINE.replace_together(
            case,
            {
                SCAN: lambda path: write_volume(path, cleaned.volume),
                LOST: lambda path: write_labels(path, lost),
                ARTEFACTS_PICTURE: lambda path: write_streak_views(path, before, cleaned.volume, cleaned.lost, axis),
                ARTEFACTS: lambda path: write_json(
                    path, {"schema": ARTEFACTS_SCHEMA, "sentences": list(cleaned.sentences)}
                ),
            },
        )
    return cleaned


def restore_scan(case: Case) -> None:
    """Put the scan back that `clean_case` replaced.

    Raises:
        BadInput: it was not replaced.
        WriteFailed: the disk is failing.
    """
    if not case.has(ARTEFACTS):
        raise BadInput(f"The scan of {case.folder} was not cleaned; there is nothing to undo.")
    if previous(case.path(SCAN)).is_file():  # else an earlier attempt was interrupted after this step
        PIPELINE.restore(case, SCAN)
    for name in (LOST, ARTEFACTS_PICTURE, ARTEFACTS):
        case.path(name).unlink(missing_ok=True)
