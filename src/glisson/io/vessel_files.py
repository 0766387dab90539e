"""Vessel trees as JSON: for each tree its name, points (LPS mm), radii (mm) and edges parent → child; 0 is the root."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from glisson.core import VesselTree
from glisson.io.records import Record, read_record, write_json

SCHEMA = 1
"""Version of the layout that is written; older ones are read."""


def write_vessels(path: str | Path, trees: Sequence[VesselTree]) -> None:
    """Write trees with all digits; atomic.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    write_json(Path(path), {"schema": SCHEMA, "trees": [tree_table(tree) for tree in trees]})


def read_vessels(path: str | Path) -> tuple[VesselTree, ...]:
    """Read what `write_vessels` wrote.

    Raises:
        BadInput: the file is absent, damaged or of a newer Glisson.
    """
    with read_record(Path(path), "vessel trees", SCHEMA) as record:
        return tuple(tree_of_table(entry) for entry in record.records("trees"))


def tree_table(tree: VesselTree) -> dict[str, Any]:
    """A tree as plain values."""
    return {"name": tree.name, "points_mm": tree.points_mm, "radii_mm": tree.radii_mm, "edges": tree.edges}


def tree_of_table(record: Record) -> VesselTree:
    """The tree of such values.

    Raises:
        BadInput: something is missing, or does not fit.
    """
    with record.building():
        return VesselTree(
            record.text("name"),
            record.floats("points_mm", -1, 3),
            record.floats("radii_mm", -1),
            record.wholes("edges", -1, 2),
        )
