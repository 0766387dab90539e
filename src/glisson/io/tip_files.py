"""`tips.json`: where the tips of instruments were over time (mm, s)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from glisson.core.tip_track import TipTrack
from glisson.io.records import Record, read_record, write_json

SCHEMA = 1
"""Version of the layout of `tips.json` that is written; older ones are read."""


def read_tips(path: str | Path) -> tuple[TipTrack, ...]:
    """Read tracks.

    Raises:
        BadInput: absent, damaged, of a newer Glisson, or with an entry that is refused, named by its key path.
    """
    with read_record(Path(path), "tracks of tips", SCHEMA) as record:
        return tuple(_track(entry) for entry in record.records("tracks"))


def write_tips(path: str | Path, tracks: Sequence[TipTrack]) -> None:
    """Write tracks with all digits; atomic.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    write_json(Path(path), {"schema": SCHEMA, "tracks": [_table(track) for track in tracks]})


def _track(record: Record) -> TipTrack:
    with record.building():
        return TipTrack(
            record.text("instrument"),
            record.text("frame"),
            record.floats("times_s", -1),
            record.floats("points_mm", -1, 3),
            record.floats("covariance_mm2", -1, 3, 3),
        )


def _table(track: TipTrack) -> dict[str, Any]:
    return {
        "instrument": track.instrument,
        "frame": track.frame,
        "times_s": track.times_s,
        "points_mm": track.points_mm,
        "covariance_mm2": track.covariance_mm2,
    }
