"""Poses: 4 × 4 matrices of trackers as text, and `.toml` files of ours with covariance."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from glisson.core import BadInput
from glisson.core.arrays import FloatArray
from glisson.core.transform import RigidTransform
from glisson.io.decoding import decoding
from glisson.io.records import read_record, write_toml
from glisson.io.tables import read_table

SCHEMA = 1
"""Version of the layout of pose files that is written; older ones are read."""

_ORTHONORMAL = 1e-2
"""Rounding to three digits is forgiven; more is no rotation."""


def read_poses(paths: Iterable[str | Path], target: str, source: str) -> tuple[RigidTransform, ...]:
    """All poses `target_from_source` of text files, in order; rotations are made orthonormal to all digits.

    A file holds 4 × 4 matrices below each other, or one matrix a line (16 numbers, row by row). A folder stands for
    its `.txt` files, in the order of the numbers in their names.

    Raises:
        BadInput: a file is absent or damaged, or a pose has NaN, is of another shape, or is no rigid transform.
    """
    poses: list[RigidTransform] = []
    for file in files_of(paths, (".txt",)):
        with decoding(file, "poses"):
            matrices = _matrices(read_table(file))
            for number, matrix in enumerate(matrices, start=1):
                what = "the pose" if len(matrices) == 1 else f"pose {number}"
                poses.append(_pose(matrix, what, target, source))
    return tuple(poses)


def files_of(paths: Iterable[str | Path], suffixes: tuple[str, ...]) -> list[Path]:
    """The files that are named, with those of named folders, in the order of the numbers in their names.

    Raises:
        BadInput: a folder has no such file.
    """
    files: list[Path] = []
    for path in map(Path, paths):
        if path.is_dir():
            inside = sorted((one for one in path.iterdir() if one.suffix.lower() in suffixes), key=_in_order)
            if not inside:
                raise BadInput(f"{path} has no file of the kind {' or '.join(suffixes)}.")
            files += inside
        else:
            files.append(path)
    return files


def read_pose(path: str | Path) -> RigidTransform:
    """A pose with its frames and its covariance from a file of ours.

    Raises:
        BadInput: absent, damaged, of a newer Glisson, or an entry that is refused, named by its key path.
    """
    with read_record(Path(path), "a pose", SCHEMA) as record:
        return RigidTransform(
            record.text("target"),
            record.text("source"),
            record.floats("rotation", 3, 3),
            record.floats("translation_mm", 3),
            record.floats("covariance", 6, 6) if record.has("covariance") else None,
        )


def write_pose(path: str | Path, pose: RigidTransform) -> None:
    """Write a pose with all digits; atomic.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    table: dict[str, Any] = {
        "schema": SCHEMA,
        "target": pose.target,
        "source": pose.source,
        "rotation": pose.rotation.tolist(),
        "translation_mm": pose.translation_mm.tolist(),
    }
    if pose.covariance is not None:
        table["covariance"] = pose.covariance.tolist()
    write_toml(path, table)


def _matrices(rows: list[list[float]]) -> list[FloatArray]:
    if rows and all(len(row) == 16 for row in rows):
        return [np.array(row).reshape(4, 4) for row in rows]
    if rows and len(rows) % 4 == 0 and all(len(row) == 4 for row in rows):
        return list(np.array(rows).reshape(-1, 4, 4))
    raise BadInput("a pose is 4 lines of 4 numbers, or one line of 16.")


def _pose(matrix: FloatArray, what: str, target: str, source: str) -> RigidTransform:
    if not np.isfinite(matrix).all():
        raise BadInput(f"{what} is not finite (NaN): the tracker did not see the marker; leave this pose out.")
    left, _, right = np.linalg.svd(matrix[:3, :3])
    rotation = left @ right
    off = max(np.abs(rotation - matrix[:3, :3]).max(), np.abs(matrix[3] - [0.0, 0.0, 0.0, 1.0]).max())
    if off > _ORTHONORMAL or np.linalg.det(rotation) < 0.0:
        raise BadInput(
            f"{what} is no rigid transform: its first three columns must be a rotation, its last row 0 0 0 1."
        )
    return RigidTransform(target, source, rotation, matrix[:3, 3])


def _in_order(path: Path) -> tuple[list[int], str]:
    digits = "".join(letter if letter.isdigit() else " " for letter in path.name)
    return [int(number) for number in digits.split()], path.name
