"""DICOM files without what tells who the patient is, and a look at what may still tell it."""

from pathlib import Path

from glisson.core.errors import BadInput
from glisson.core.image import Volume
from glisson.core.protocols import Progress, silent
from glisson.io.burned_in import burned_in_text
from glisson.io.deidentification import Deidentified, deidentify_folder
from glisson.io.images import read_volume


def deidentify(folder: str | Path, out: str | Path, progress: Progress = silent) -> tuple[Deidentified, list[str]]:
    """Copy a folder's DICOM files (see `deidentify_folder`) and look for text that was drawn into their pixels.

    Returns:
        What was copied, and a sentence for each series that seems to have text in its pixels.

    Raises:
        BadInput: nothing to copy, a damaged file, or a place that cannot be used.
        WriteFailed: the disk is full.
    """
    made = deidentify_folder(folder, out, progress)
    told = [(place, burned_in_text(place, _volume(place))) for place in made.folders]
    return made, [f"{place}: {sentence}" for place, sentence in told if sentence is not None]


def _volume(folder: Path) -> Volume | None:
    """The scan in a folder; None for a segmentation, a localizer and whatever else makes no volume."""
    try:
        return read_volume(folder)
    except BadInput:
        return None
