"""A case's labels as one segmentation that other programs read."""

from pathlib import Path

from glisson.core.errors import BadInput
from glisson.framework.case import ORGAN, STRUCTURES, TUMOURS, Case
from glisson.io.images import read_labels, write_segments


def export_labels(
    case: Case, target: str | Path, scan: str | Path | None = None, series: str | None = None
) -> tuple[str, ...]:
    """Write organ, tumours and structures to a `.seg.nrrd` or DICOM file and give their names.

    Args:
        case: at least its liver has a mask.
        target: the file to make.
        scan: for DICOM the folder that the case was made of; patient and study are taken from it.
        series: which series (its UID), where that folder holds several.

    Raises:
        BadInput: there is no mask yet, the suffix or the scan is wrong, or the place cannot be written.
        WriteFailed: the disk is full.
    """
    if not case.has(ORGAN):
        raise BadInput(f"{case.folder} has no mask of the liver yet; run glisson segment first.")
    maps = [read_labels(case.path(name)) for name in (ORGAN, TUMOURS, STRUCTURES) if case.has(name)]
    write_segments(target, maps, scan, series)
    return tuple(name for labels in maps for name in labels.names.values())
