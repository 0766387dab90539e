"""The study of the liver's segmentation: scores over scans that were not seen before, and failures that are flagged."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from glisson.phantom.family import DEFAULT_SPACING_MM
from glisson.studies.page import png
from glisson.studies.point import Outcome, Point
from glisson.studies.segmentation.failures import KINDS
from glisson.studies.segmentation.tasks import EXAMINE
from glisson.studies.segmentation.telling import as_lines, as_page, draw_scores
from glisson.studies.study import Conclusion
from glisson.studies.tables import as_csv, distribution

FIRST_CT, FIRST_MR = 700, 760
"""Members of the phantom family from here on are this study's; the segmenter and its flags were tuned on others."""

CTS, MRS = 30, 10
QUICK_CTS, QUICK_MRS = 2, 1
QUICK_SPACING_MM = (2.5, 2.5, 3.0)

GROUPS = (("CT", "no click"), ("CT", "one click"), ("MR", "one click"))
"""What is summed up apart: modality and start."""

_SCORES = {"dice": True, "asd_mm": False, "hd95_mm": False, "seconds": False}
"""Scores, and whether low ones are the bad ones."""


@dataclass(frozen=True)
class SegmentationStudy:
    """So many CTs and MRs with voxels of a size in mm."""

    name: ClassVar[str] = "segmentation"

    cts: int = CTS
    mrs: int = MRS
    spacing_mm: tuple[float, float, float] = DEFAULT_SPACING_MM

    @classmethod
    def of(cls, quick: bool) -> "SegmentationStudy":
        """The quick or the usual form."""
        return cls(QUICK_CTS, QUICK_MRS, QUICK_SPACING_MM) if quick else cls()

    def preparations(self) -> Sequence[Point]:
        """None."""
        return []

    def points(self, prepared: Mapping[str, Outcome]) -> Sequence[Point]:
        """One for each scan."""
        return [self._point("CT", FIRST_CT + n) for n in range(self.cts)] + [
            self._point("MR", FIRST_MR + n) for n in range(self.mrs)
        ]

    def conclude(self, prepared: Mapping[str, Outcome], done: Mapping[str, Outcome]) -> Conclusion:
        """A row for each segmentation and for each failure, and the distributions over them."""
        points = [point for point in self.points(prepared) if point.key in done]
        rows = [row for point in points for row in _case_rows(point, done[point.key])]
        flag_rows = [
            {"member": point.inputs["member"], **row}
            for point in points
            for row in done[point.key].values.get("flags", ())
        ]
        values: dict[str, Any] = {
            "rows": rows,
            "flag_rows": flag_rows,
            "scores": [_scores(rows, modality, start) for modality, start in GROUPS],
            "flags": [_recall(flag_rows, kind) for kind in (*KINDS, None)],
            "flagged_share": _ratio(sum(row["flagged"] or 0 for row in rows), sum(row["slices"] or 0 for row in rows)),
            "failed": [row for row in rows if row["dice"] is None],
            "unfinished": len(self.points(prepared)) - len(points),
        }
        picture = draw_scores(values)
        files = {
            "rows.csv": as_csv(rows),
            "flag_rows.csv": as_csv(flag_rows),
            "report.html": as_page(values, picture),
            "scores.png": png(picture),
        }
        return Conclusion(values, "\n".join(as_lines(values)), files)

    def _point(self, modality: str, member: int) -> Point:
        inputs = {"modality": modality, "member": member, "spacing_mm": list(self.spacing_mm)}
        return Point(EXAMINE, inputs, cost=2.0 if modality == "CT" else 1.0)


def _case_rows(point: Point, outcome: Outcome) -> list[dict[str, Any]]:
    scan = {name: outcome.values.get(name) for name in ("phase", "noise", "metal", "gas", "tumours")}
    measured = ("dice", "asd_mm", "hd95_mm", "seconds", "slices", "flagged")
    return [
        {
            "modality": point.inputs["modality"],
            "member": point.inputs["member"],
            "start": run.get("start"),
            **scan,
            **{name: run.get(name) for name in measured},
            "message": run.get("message", outcome.message),
        }
        for run in outcome.values.get("runs") or [{}]
    ]


def _scores(rows: Sequence[Mapping[str, Any]], modality: str, start: str) -> dict[str, Any]:
    here = [row for row in rows if (row["modality"], row["start"]) == (modality, start)]
    good = [row for row in here if row["dice"] is not None]
    return {
        "modality": modality,
        "start": start,
        "cases": len(here),
        **{name: distribution([row[name] for row in good], low) for name, low in _SCORES.items()},
    }


def _recall(rows: Sequence[Mapping[str, Any]], kind: str | None) -> dict[str, Any]:
    """Shares of slices over failures of a kind, or all; `noticed` counts failures with any slice flagged."""
    here = [row for row in rows if kind in (None, row["failure"])]

    def total(name: str) -> int:
        return sum(row[name] for row in here)

    return {
        "failure": kind or "all",
        "failures": len(here),
        "noticed": sum(row["failed_flagged"] > 0 for row in here),
        "failed_slices": total("failed"),
        "recall": _ratio(total("failed_flagged"), total("failed")),
        "good_flagged_share": _ratio(total("good_flagged"), total("good")),
    }


def _ratio(part: int, whole: int) -> float | None:
    return part / whole if whole else None
