"""The classes of TotalSegmentator's task "total", version 2 (Wasserthal et al., Radiology: AI 5(5), 2023)."""

import csv
from functools import cache
from importlib.resources import files


@cache
def class_names() -> dict[int, str]:
    """TotalSegmentator's own names of its 117 classes by number (liver is 5)."""
    table = files("glisson.io").joinpath("data", "totalsegmentator_v2.csv").read_text(encoding="utf-8")
    return {int(row["number"]): row["name"] for row in csv.DictReader(table.splitlines())}
