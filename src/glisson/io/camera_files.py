"""Calibrated cameras (`camera.toml`)."""

from pathlib import Path

import numpy as np
import tomli_w

from glisson.core.camera import Camera
from glisson.io.atomic import atomic_path
from glisson.io.records import read_record

_SCHEMA = 1


def read_camera(path: str | Path) -> Camera:
    """A camera.

    Raises:
        BadInput: absent, damaged, or no camera.
    """
    with read_record(Path(path), "a camera", _SCHEMA) as record:
        return Camera(
            record.whole("width"),
            record.whole("height"),
            record.floats("focal_px", 2),
            record.floats("centre_px", 2),
            record.floats("distortion", 5) if record.has("distortion") else np.zeros(5),
            record.floats("covariance", 9, 9) if record.has("covariance") else None,
        )


def write_camera(path: str | Path, camera: Camera) -> None:
    """Write a camera; atomic.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    values = {"schema": _SCHEMA, "width": camera.width, "height": camera.height}
    values |= {name: getattr(camera, name).tolist() for name in ("focal_px", "centre_px", "distortion")}
    if camera.covariance is not None:
        values["covariance"] = camera.covariance.tolist()
    with atomic_path(path) as temporary:
        temporary.write_text(tomli_w.dumps(values), encoding="utf-8")
