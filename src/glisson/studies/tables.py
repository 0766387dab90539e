"""Rows as a table that any program reads."""

import csv
import io
from collections.abc import Collection, Mapping, Sequence
from typing import Any


def as_csv(rows: Sequence[Mapping[str, Any]], leave_out: Collection[str] = ()) -> bytes:
    """Rows, which all have the same names, as comma-separated values with a header, but for some names."""
    stream = io.StringIO()
    names = [name for name in (rows[0] if rows else ()) if name not in leave_out]
    writer = csv.DictWriter(stream, names, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue().encode()
