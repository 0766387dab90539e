"""Colour pictures in and out (PNG, JPEG)."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from glisson.core.errors import BadInput
from glisson.io.atomic import atomic_path
from glisson.io.decoding import check_file_size, decoding

_MOST_PIXELS = 100_000_000


def read_picture(path: str | Path) -> NDArray[np.uint8]:
    """A picture [row, column, red green blue].

    Raises:
        BadInput: absent, damaged, no picture, or larger than any camera's.
    """
    file = Path(path)
    with decoding(file, "a picture"):
        check_file_size(file)
        decoded = cv2.imdecode(np.frombuffer(file.read_bytes(), dtype=np.uint8), cv2.IMREAD_COLOR)
        if decoded is None:
            raise BadInput("it is no PNG or JPEG that can be read.")
        if decoded.shape[0] * decoded.shape[1] > _MOST_PIXELS:
            raise BadInput("it is larger than any camera's picture.")
    return np.ascontiguousarray(decoded[:, :, ::-1], dtype=np.uint8)


def write_picture(path: str | Path, picture: NDArray[np.uint8]) -> None:
    """Write a picture [row, column, red green blue] as PNG; atomic.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    _, coded = cv2.imencode(".png", picture[:, :, ::-1])
    with atomic_path(path) as temporary:
        temporary.write_bytes(coded.tobytes())
