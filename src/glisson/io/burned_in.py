"""Text that was drawn into a scan's pixels: no header that is left out takes it away."""

from pathlib import Path

import numpy as np

from glisson.core.image import Volume
from glisson.io.dicom import quiet
from glisson.io.dicom_headers import image_files

_FEWEST_SLICES = 5
_FEWEST_PIXELS = 30
"""A few letters; single dead pixels of a detector are fewer."""

_MOST = 0.05
"""Text fills a smaller part of a slice; a picture that was computed may be the same in many slices."""

_ABOVE_LEAST = 100
"""What is constant is text where it is so much brighter than the padding about a round field of view."""


def burned_in_text(scan: str | Path, volume: Volume | None) -> str | None:
    """A sentence where text seems to be drawn into the pixels, None where nothing speaks for it.

    Headers of DICOM may say so (BurnedInAnnotation, PS3.3 C.7.6.1.1.5). Pixels do where they have the same value in
    all slices, as noise never has.

    Args:
        scan: the file or folder that was read.
        volume: what was read from it, None where its headers alone can be.
    """
    look = "look at the images before you hand the case on."
    folder = Path(scan)
    if folder.is_dir():
        with quiet():
            if any(file.has_burned_in_text for file in image_files(folder)):
                return f"The scan's headers say that text is drawn into its pixels: {look}"
    pixels = 0 if volume is None else _constant_pixels(volume)
    if pixels >= _FEWEST_PIXELS:
        return f"{pixels} pixels are the same in all slices, as text that was drawn into them would be: {look}"
    return None


def _constant_pixels(volume: Volume) -> int:
    """Pixels that are the same in all slices along any axis that is long enough, and no padding."""
    voxels = volume.voxels
    least, most = float(voxels.min()), 0
    for axis in range(3):
        if voxels.shape[axis] < _FEWEST_SLICES:
            continue
        first = np.take(voxels, 0, axis=axis)
        constant = (voxels == np.expand_dims(first, axis)).all(axis=axis) & (first > least + _ABOVE_LEAST)
        if constant.mean() < _MOST:
            most = max(most, int(constant.sum()))
    return most
