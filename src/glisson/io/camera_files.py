"""`camera.toml`, and the text files of intrinsics and distortion that other calibration programs write."""

from pathlib import Path
from typing import Any

import numpy as np

from glisson.core import BadInput
from glisson.core.camera import Camera
from glisson.io.decoding import decoding
from glisson.io.records import read_record, write_toml
from glisson.io.tables import read_table

SCHEMA = 1
"""Version of the layout of `camera.toml` that is written; older ones are read."""


def read_camera(path: str | Path) -> Camera:
    """Read `camera.toml`.

    Raises:
        BadInput: absent, damaged, of a newer Glisson, or an entry that is refused, named by its key path.
    """
    with read_record(Path(path), "a camera", SCHEMA) as record:
        return Camera(
            record.whole("width"),
            record.whole("height"),
            record.floats("focal_px", 2),
            record.floats("centre_px", 2),
            record.floats("distortion", 5) if record.has("distortion") else np.zeros(5),
            record.floats("covariance", 9, 9) if record.has("covariance") else None,
        )


def write_camera(path: str | Path, camera: Camera) -> None:
    """Write `camera.toml` with all digits; atomic.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    table: dict[str, Any] = {
        "schema": SCHEMA,
        "width": camera.width,
        "height": camera.height,
        "focal_px": camera.focal_px.tolist(),
        "centre_px": camera.centre_px.tolist(),
        "distortion": camera.distortion.tolist(),
    }
    if camera.covariance is not None:
        table["covariance"] = camera.covariance.tolist()
    write_toml(path, table)


def read_opencv_camera(intrinsics: str | Path, distortion: str | Path | None, width: int, height: int) -> Camera:
    """A camera from text: the matrix (3 × 3) and the distortion k1, k2, p1, p2 and perhaps k3.

    Where `distortion` is None, a fourth line of the first file is taken for it.

    Raises:
        BadInput: absent, damaged, of another shape, or a matrix that is skew.
    """
    with decoding(intrinsics, "camera intrinsics"):
        rows = read_table(intrinsics)
        if len(rows) not in (3, 4) or any(len(row) != 3 for row in rows[:3]):
            raise BadInput("intrinsics are three lines of three numbers.")
        matrix = np.array(rows[:3])
        if np.abs(matrix[[0, 1, 2, 2, 2], [1, 0, 0, 1, 2]] - [0.0, 0.0, 0.0, 0.0, 1.0]).max() > 1e-9:
            raise BadInput("only focal lengths and principal point may be set in the matrix, and 1 at its end.")
    terms = np.zeros(5)
    given = rows[3] if len(rows) == 4 else []
    if distortion is not None:
        with decoding(distortion, "camera distortion"):
            given = [number for row in read_table(distortion) for number in row]
            if len(given) not in (4, 5):
                raise BadInput(f"distortion has 4 or 5 terms, not {len(given)}.")
    if given:
        terms[: len(given)] = given
    return Camera(width, height, matrix[[0, 1], [0, 1]], matrix[:2, 2], terms)
