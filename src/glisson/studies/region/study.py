"""The study of the region of interest: times as fast, millimetres apart, and what was estimated of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from glisson.studies.page import Page, Table, number, page_as_html
from glisson.studies.point import Outcome, Point
from glisson.studies.region.tasks import COMPARE
from glisson.studies.study import Conclusion
from glisson.studies.tables import as_csv, distribution

FIRST_MEMBER = 600
"""Members of the phantom family from here on are this study's; the technique was tuned on earlier ones."""

MEMBERS, QUICK_MEMBERS = 8, 2
ELEMENTS, QUICK_ELEMENTS = 18_599, 3_000
"""The first as many as the dissertation's finest mesh of its section 4.4."""


@dataclass(frozen=True)
class RegionStudy:
    """`members` lifts on meshes of about so many elements."""

    name: ClassVar[str] = "region"

    members: int = MEMBERS
    elements: int = ELEMENTS

    @classmethod
    def of(cls, quick: bool) -> "RegionStudy":
        """The quick or the usual form."""
        return cls(QUICK_MEMBERS, QUICK_ELEMENTS) if quick else cls()

    def preparations(self) -> Sequence[Point]:
        """A small lift, with which both techniques are compiled."""
        return [Point(COMPARE, {"member": 0, "elements": QUICK_ELEMENTS})]

    def points(self, prepared: Mapping[str, Outcome]) -> Sequence[Point]:
        """One for each member."""
        return [Point(COMPARE, {"member": FIRST_MEMBER + n, "elements": self.elements}) for n in range(self.members)]

    def conclude(self, prepared: Mapping[str, Outcome], done: Mapping[str, Outcome]) -> Conclusion:
        """A row for each tumour of each member, and the distributions over them."""
        points = self.points(prepared)
        rows = [row for point in points if point.key in done for row in _rows(point, done[point.key])]
        good = [row for row in rows if row["apart_mm"] is not None]
        faster = [row["times_as_fast"] for row in good if row["tumour"] == 0]
        factors = [_factor(row["estimated_mm"], row["apart_mm"]) for row in good if row["estimated_mm"]]
        values: dict[str, Any] = {
            "rows": rows,
            "times_as_fast": distribution(faster, low=True),
            "apart_mm": distribution([row["apart_mm"] for row in good]),
            "estimate_off_by": distribution(factors),
            "failed": [row for row in rows if row["apart_mm"] is None],
            "unfinished": sum(point.key not in done for point in points),
        }
        files = {"rows.csv": as_csv(rows), "report.html": _page(values)}
        return Conclusion(values, "\n".join(_lines(values)), files)


def _rows(point: Point, outcome: Outcome) -> list[dict[str, Any]]:
    given = outcome.values
    whole, region = given.get("whole_seconds"), given.get("region_seconds")
    names = ("moved_mm", "apart_mm", "estimated_mm")
    tumours = given.get("tumours") or [dict.fromkeys(names)]
    return [
        {
            "member": point.inputs["member"],
            "elements": given.get("elements"),
            "whole_seconds": whole,
            "region_seconds": region,
            "times_as_fast": whole / region if whole and region else None,
            "tumour": count,
            **{name: tumour[name] for name in names},
            "status": outcome.status,
            "message": outcome.message,
        }
        for count, tumour in enumerate(tumours)
    ]


def _factor(estimated: float, true: float) -> float:
    """By which factor an estimate is off, whichever way."""
    return max(estimated / true, true / estimated)


def _lines(values: Mapping[str, Any]) -> list[str]:
    names = {"times_as_fast": "faster", "apart_mm": "apart (mm)", "estimate_off_by": "estimate off by a factor"}
    lines = [
        f"{words:25} median {spread['median']:.3g}, {tail[1:]}th percentile {spread[tail]:.3g}, worst "
        f"{spread['worst']:.3g}"
        for name, words in names.items()
        if (spread := values[name]) is not None
        for tail in spread.keys() - {"median", "worst"}
    ]
    lines += [f"failed    member {row['member']}: {row['message']}" for row in values["failed"]]
    if values["unfinished"]:
        lines.append(f"note      {values['unfinished']} points are not done yet; run again to go on")
    return lines


def _page(values: Mapping[str, Any]) -> bytes:
    columns = ["member", "elements", "whole (s)", "region (s)", "times as fast", "moved (mm)", "apart (mm)"]
    rows = [
        [
            str(row["member"]),
            str(row["elements"]),
            *(number(row[name]) for name in ("whole_seconds", "region_seconds", "times_as_fast", "moved_mm")),
            number(row["apart_mm"], 3),
            number(row["estimated_mm"], 3),
            str(row["status"]),
        ]
        for row in values["rows"]
    ]
    table = Table("All tumours of all members.", [*columns, "estimated (mm)", "status"], rows)
    return page_as_html(Page("Region of interest", _lines(values), (), [table]))
