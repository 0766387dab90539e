"""The study of trocar poses: how wrong they are, and whether any wrong one passes silently."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any, ClassVar

import numpy as np

from glisson.studies.page import png
from glisson.studies.point import Outcome, Point
from glisson.studies.study import Conclusion
from glisson.studies.tables import as_csv, distribution
from glisson.studies.trocar.recognition import RECOGNITION, recognition_values
from glisson.studies.trocar.rooms import ANY, RECOMMENDED, SURVEYED
from glisson.studies.trocar.tasks import CORNERS, IMAGES
from glisson.studies.trocar.telling import as_lines, as_page, draw_tips

WRONG_MM, WRONG_DEG = 5.0, 1.0
IMAGE_COUNT, CORNER_COUNT = 1000, 9000
QUICK_IMAGES, QUICK_CORNERS = 40, 600
_IMAGE_BLOCK, _CORNER_BLOCK = 10, 150
WHEELS, QUICK_WHEELS = (800, 200), (20, 10)
"""Views of instruments: before a ceiling out of focus, and before a room with its crosses."""
_WHEEL_BLOCK = 10
SHARES = {RECOMMENDED: 0.7, ANY: 0.2, SURVEYED: 0.1}
"""Parts of the views by layout."""

Row = Mapping[str, Any]


@dataclass(frozen=True)
class TrocarStudy:
    """So many rendered views, and so many of which the corners are drawn, from a seed."""

    name: ClassVar[str] = "trocar"

    seed: int = 0
    images: int = IMAGE_COUNT
    corners: int = CORNER_COUNT
    wheels: tuple[int, int] = WHEELS

    @classmethod
    def of(cls, quick: bool, seed: int) -> "TrocarStudy":
        """The quick or the usual form."""
        return cls(seed, QUICK_IMAGES, QUICK_CORNERS, QUICK_WHEELS) if quick else cls(seed)

    def preparations(self) -> Sequence[Point]:
        """One view, so that all is compiled before."""
        wheel = {"stream": self.seed, "in_room": True, "first": self.wheels[1], "count": 1}
        return [
            Point(IMAGES, {"stream": self.seed, "layout": RECOMMENDED, "first": self.images, "count": 1}),
            Point(RECOGNITION, wheel),
        ]

    def points(self, prepared: Mapping[str, Outcome]) -> Sequence[Point]:
        """Blocks of views, of all kinds in turn."""
        groups = []
        for task, total, size, cost in (
            (CORNERS, self.corners, _CORNER_BLOCK, 1.0),
            (IMAGES, self.images, _IMAGE_BLOCK, 5.0),
        ):
            for layout, share in SHARES.items():
                count = round(share * total)
                inputs = {"stream": self.seed, "layout": layout}
                groups.append(
                    [
                        Point(task, {**inputs, "first": first, "count": min(size, count - first)}, cost)
                        for first in range(0, count, size)
                    ]
                )
        for in_room, count in zip((False, True), self.wheels, strict=True):
            inputs = {"stream": self.seed, "in_room": in_room}
            groups.append(
                [
                    Point(RECOGNITION, {**inputs, "first": first, "count": min(_WHEEL_BLOCK, count - first)}, 5.0)
                    for first in range(0, count, _WHEEL_BLOCK)
                ]
            )
        return [point for turn in zip_longest(*groups) for point in turn if point is not None]

    def conclude(self, prepared: Mapping[str, Outcome], done: Mapping[str, Outcome]) -> Conclusion:
        """Errors of what is not flagged, by layout, source and number of crosses, and all silent errors."""
        points = self.points(prepared)
        outcomes = [done[point.key] for point in points if point.key in done]
        all_rows = [row for outcome in outcomes for row in outcome.values.get("rows", ())]
        rows, wheels = ([row for row in all_rows if ("in_room" in row) is is_wheel] for is_wheel in (False, True))
        best = [row for row in rows if row["layout"] == RECOMMENDED]
        enough = [row for row in best if row["visible"] >= 3]
        images = [row for row in rows if row["source"] == "image"]
        silent = [row for row in rows if _is_silent(row)]
        values: dict[str, Any] = {
            "views": len(rows),
            "rendered": len(images),
            "silent_wrong": len(silent),
            "flagged": _flagged(enough),
            "position_mm": spread(best, "position_mm"),
            "angle_deg": spread(best, "angle_deg"),
            "tip_mm": spread(best, "tip_mm"),
            "coverage90": _coverage(best),
            "recognised": sum(bool(row["right"]) for row in wheels) / len(wheels) if wheels else None,
            "recognition": recognition_values(wheels),
            "milliseconds": {
                "image": _milliseconds(images),
                "corners": _milliseconds([row for row in rows if row["source"] == "corners"]),
            },
            "groups": [_group(rows, layout, source, crosses) for layout, source, crosses in _groups()],
            "database": _database([row for row in images if row["layout"] == RECOMMENDED]),
            "silent": silent,
            "failed": [outcome.message for outcome in outcomes if not outcome.is_good],
            "unfinished": len(points) - len(outcomes),
        }
        shown = draw_tips(rows)
        names = list(dict.fromkeys(name for row in rows for name in row))
        files = {
            "instruments.csv": as_csv(wheels),
            "rows.csv": as_csv([{name: row.get(name) for name in names} for row in rows]),
            "report.html": as_page(values, shown),
            "tips.png": png(shown),
        }
        return Conclusion(values, "\n".join(as_lines(values)), files)


def spread(rows: Sequence[Row], name: str) -> dict[str, float] | None:
    """Median, 95th percentile and worst of what is not flagged."""
    return distribution([row[name] for row in rows if row["status"] == "converged"])


def _groups() -> list[tuple[str, str, str]]:
    return [
        (layout, source, crosses)
        for layout in SHARES
        for source in ("image", "corners")
        for crosses in ("0 or 1", "2", "3", "4", "5 or more")
    ]


def _crosses(row: Row) -> str:
    visible = row["visible"]
    return "0 or 1" if visible < 2 else "5 or more" if visible > 4 else str(visible)


def _group(rows: Sequence[Row], layout: str, source: str, crosses: str) -> dict[str, Any]:
    here = [row for row in rows if (row["layout"], row["source"], _crosses(row)) == (layout, source, crosses)]
    return {
        "layout": layout,
        "source": source,
        "crosses": crosses,
        "views": len(here),
        "flagged": _flagged(here),
        "silent_wrong": sum(_is_silent(row) for row in here),
        "coverage90": _coverage(here),
        **{name: spread(here, name) for name in ("position_mm", "angle_deg", "tip_mm")},
    }


def _is_silent(row: Row, prefix: str = "") -> bool:
    if row[f"{prefix}status"] != "converged":
        return False
    return bool(row[f"{prefix}position_mm"] > WRONG_MM or row[f"{prefix}angle_deg"] > WRONG_DEG)


def _flagged(rows: Sequence[Row]) -> float | None:
    return sum(row["status"] != "converged" for row in rows) / len(rows) if rows else None


def _coverage(rows: Sequence[Row]) -> float | None:
    """Share of the positions, flagged or not, within the ellipsoid that should hold 90 % of them."""
    inside = [row["inside90"] for row in rows if row["inside90"] is not None]
    return float(np.mean(inside)) if inside else None


def _milliseconds(rows: Sequence[Row]) -> dict[str, float] | None:
    return distribution([row["milliseconds"] for row in rows if row["milliseconds"] is not None])


def _database(rows: Sequence[Row]) -> dict[str, Any]:
    """The same rendered views of the recommended layout by the database of guesses."""
    good = [
        {name: row[f"database_{name}"] for name in ("status", "position_mm", "angle_deg", "tip_mm")} for row in rows
    ]
    return {
        "views": len(rows),
        "flagged": _flagged(good),
        "silent_wrong": sum(_is_silent(row, "database_") for row in rows),
        **{name: spread(good, name) for name in ("position_mm", "angle_deg", "tip_mm")},
    }
