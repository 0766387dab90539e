"""`observations.json`: what was seen during surgery (mm, s), all in one frame."""

from pathlib import Path
from typing import Any, cast

from glisson.core import Observation, Observations
from glisson.io.records import Record, read_record, write_json

SCHEMA = 1
"""Version of the layout of `observations.json` that is written; older ones are read."""


def read_observations(path: str | Path) -> Observations:
    """Read observations.

    Raises:
        BadInput: absent, damaged, of a newer Glisson, or with an entry that is refused, named by its key path.
    """
    with read_record(Path(path), "observations", SCHEMA) as record:
        return Observations(tuple(_observation(entry) for entry in record.records("items")))


def write_observations(path: str | Path, observations: Observations) -> None:
    """Write observations with all digits; atomic.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    write_json(Path(path), {"schema": SCHEMA, "items": [_table(item) for item in observations.items]})


def _observation(record: Record) -> Observation:
    with record.building():
        return Observation(
            kind=cast(Any, record.text("kind")),  # the core type checks the choice
            name=record.text("name"),
            points_mm=record.floats("points_mm", -1, 3),
            sigma_mm=record.number("sigma_mm"),
            frame=record.text("frame"),
            time_s=record.number("time_s"),
            normals=record.floats("normals", -1, 3) if record.has("normals") else None,
            covariance_mm2=record.floats("covariance_mm2", -1, 3, 3) if record.has("covariance_mm2") else None,
        )


def _table(item: Observation) -> dict[str, Any]:
    optional = {"normals": item.normals, "covariance_mm2": item.covariance_mm2}
    return {
        "kind": item.kind,
        "name": item.name,
        "frame": item.frame,
        "time_s": item.time_s,
        "sigma_mm": item.sigma_mm,
        "points_mm": item.points_mm,
    } | {key: value for key, value in optional.items() if value is not None}
