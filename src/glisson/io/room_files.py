"""Rooms for which layouts of crosses are designed (`room.toml`)."""

from pathlib import Path

import numpy as np

from glisson.core.room import HangingArea, Room
from glisson.io.records import Record, read_record

_SCHEMA = 1


def read_room(path: str | Path) -> Room:
    """A room.

    Raises:
        BadInput: absent, damaged, or its trocar's region lies outside.
    """
    with read_record(Path(path), "a room", _SCHEMA) as record:
        areas = tuple(_area(entry) for entry in record.records("areas"))
        trocar = record.record("trocar")
        with trocar.building():
            low, high = trocar.floats("low_mm", 3), trocar.floats("high_mm", 3)
            tilt_rad = float(np.deg2rad(trocar.number("tilt_deg")))
        return Room(record.floats("size_mm", 3), areas, low, high, tilt_rad)


def _area(record: Record) -> HangingArea:
    with record.building():
        return HangingArea(
            record.text("name"),
            record.floats("centre_mm", 3),
            record.floats("right", 3),
            record.floats("down", 3),
            record.number("width_mm"),
            record.number("height_mm"),
        )
