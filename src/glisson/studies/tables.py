"""Rows as a table that any program reads, and the distribution of a column."""

import csv
import io
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np


def as_csv(rows: Sequence[Mapping[str, Any]], leave_out: Collection[str] = ()) -> bytes:
    """Rows, which all have the same names, as comma-separated values with a header, but for some names."""
    stream = io.StringIO()
    names = [name for name in (rows[0] if rows else ()) if name not in leave_out]
    writer = csv.DictWriter(stream, names, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue().encode()


def distribution(values: Sequence[float], low: bool = False) -> dict[str, float] | None:
    """`median`, `p95` and `worst` of values; `p5` and the least where `low` ones are the bad ones."""
    if not values:
        return None
    percentile, worst = (5, min(values)) if low else (95, max(values))
    return {
        "median": float(np.median(values)),
        f"p{percentile}": float(np.percentile(values, percentile)),
        "worst": float(worst),
    }
