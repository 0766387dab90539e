"""Layouts of crosses (`layout.toml`): for each its colours, size and place in the room."""

from pathlib import Path
from typing import Any

import numpy as np

from glisson.core.arrays import FloatArray, unit_vector
from glisson.core.crosses import Cross, CrossLayout
from glisson.core.errors import BadInput
from glisson.core.transform import RigidTransform
from glisson.io.records import Record, read_record, write_toml

_SCHEMA = 1
_UPRIGHT = 1e-3
"""`right` and `down` may be this far from perpendicular (as a cosine): people write few digits."""


def read_layout(path: str | Path) -> CrossLayout:
    """The crosses of a room.

    Raises:
        BadInput: absent, damaged, or crosses that may be mistaken for each other.
    """
    with read_record(Path(path), "a layout of crosses", _SCHEMA) as record:
        return CrossLayout(tuple(_cross(entry) for entry in record.records("crosses")))


def write_layout(path: str | Path, layout: CrossLayout) -> None:
    """Write a layout; atomic.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    values = {"schema": _SCHEMA, "crosses": [_table(cross) for cross in layout.crosses]}
    write_toml(path, values)


def _cross(record: Record) -> Cross:
    with record.building():
        covariance = record.floats("covariance", 6, 6) if record.has("covariance") else None
        rotation = _rotation(record.floats("right", 3), record.floats("down", 3))
        pose = RigidTransform("room", "cross", rotation, record.floats("centre_mm", 3), covariance)
        return Cross(record.text("name"), record.texts("colours"), record.number("size_mm"), pose)


def _rotation(right: FloatArray, down: FloatArray) -> FloatArray:
    x, y = unit_vector(right, "right"), unit_vector(down, "down")
    if abs(float(x @ y)) > _UPRIGHT:
        raise BadInput("right and down must be perpendicular.")
    z = unit_vector(np.cross(x, y), "the direction into the wall")
    return np.column_stack([x, np.cross(z, x), z])


def _table(cross: Cross) -> dict[str, Any]:
    pose = cross.room_from_cross
    table: dict[str, Any] = {
        "name": cross.name,
        "colours": list(cross.colours),
        "size_mm": float(cross.size_mm),
        "centre_mm": pose.translation_mm.tolist(),
        "right": pose.rotation[:, 0].tolist(),
        "down": pose.rotation[:, 1].tolist(),
    }
    return table if pose.covariance is None else table | {"covariance": pose.covariance.tolist()}
