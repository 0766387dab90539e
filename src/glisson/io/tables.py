"""Lines of numbers in plain text, parted by spaces or commas."""

from pathlib import Path

import numpy as np

from glisson.core import BadInput
from glisson.core.arrays import FloatArray
from glisson.io.decoding import check_file_size, decoding


def read_table(path: str | Path) -> list[list[float]]:
    """The numbers of each line that has some; "#" begins a comment. NaN is read, too. Run inside `decoding`.

    Raises:
        BadInput: a line holds what is no number.
    """
    source = Path(path)
    check_file_size(source)
    rows = []
    for number, line in enumerate(source.read_text(encoding="utf-8").splitlines(), start=1):
        words = line.partition("#")[0].replace(",", " ").split()
        try:
            rows.append([float(word) for word in words])
        except ValueError:
            raise BadInput(f"line {number} holds what is no number.") from None
    return [row for row in rows if row]


def read_points(path: str | Path, columns: int) -> FloatArray:
    """Points (n, columns) from text, one a line.

    Raises:
        BadInput: absent, empty, lines of another length, or numbers that are not finite.
    """
    with decoding(path, "points"):
        rows = read_table(path)
        if not rows or any(len(row) != columns for row in rows):
            raise BadInput(f"points are lines of {columns} numbers.")
        points = np.array(rows)
        if not np.isfinite(points).all():
            raise BadInput(f"point {int((~np.isfinite(points)).any(axis=1).argmax()) + 1} is not finite.")
        return points
