"""Photographs: single images of a camera, pixel by pixel as its sensor gave them."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from glisson.core import BadInput
from glisson.io.decoding import check_file_size, decoding

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
"""Files that are taken for photographs where a folder is named."""


def read_photograph(path: str | Path) -> NDArray[np.uint8]:
    """A photograph [row, column, red green blue], not turned by what the file says of the camera's attitude.

    Raises:
        BadInput: absent, damaged, or of a kind that OpenCV does not read.
    """
    source = Path(path)
    with decoding(source, "a photograph"):
        check_file_size(source)
        content = np.frombuffer(source.read_bytes(), dtype=np.uint8)
        image = None
        if len(content):
            image = cv2.imdecode(content, cv2.IMREAD_COLOR_RGB | cv2.IMREAD_IGNORE_ORIENTATION)
        if image is None:
            raise BadInput("it is no image of a kind that is read (PNG, JPEG, BMP, TIFF), or it is damaged.")
        return np.asarray(image, dtype=np.uint8)
