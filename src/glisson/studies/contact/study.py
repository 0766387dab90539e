"""The study of contact: how far the tumour is apart with signed distances and with the IPC Toolkit."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, ClassVar

from glisson.studies.contact.tasks import COMPARE
from glisson.studies.lift_robustness.cases import draw_case
from glisson.studies.page import Page, Table, number, page_as_html
from glisson.studies.point import Outcome, Point
from glisson.studies.study import Conclusion
from glisson.studies.tables import as_csv, distribution

CASES, QUICK_CASES = 20, 2
EDGE_MM, QUICK_EDGE_MM = 40.0, 60.0
"""About 2,000 and 800 quadratic elements."""


@dataclass(frozen=True)
class ContactStudy:
    """`count` of the lifts of the robustness study, from a seed, without cohesion."""

    name: ClassVar[str] = "contact"

    seed: int = 0
    count: int = CASES
    edge_length_mm: float = EDGE_MM

    @classmethod
    def of(cls, quick: bool, seed: int) -> "ContactStudy":
        """The quick or the usual form."""
        return cls(seed, QUICK_CASES, QUICK_EDGE_MM) if quick else cls(seed)

    def preparations(self) -> Sequence[Point]:
        """None."""
        return ()

    def points(self, prepared: Mapping[str, Outcome]) -> Sequence[Point]:
        """One for each lift."""
        cases = [draw_case(self.seed, n) for n in range(self.count)]
        return [Point(COMPARE, {"case": asdict(case), "edge_length_mm": self.edge_length_mm}) for case in cases]

    def conclude(self, prepared: Mapping[str, Outcome], done: Mapping[str, Outcome]) -> Conclusion:
        """A row for each lift, the distribution of the distances, and where branches differ."""
        points = self.points(prepared)
        rows = [_row(point, done[point.key]) for point in points if point.key in done]
        good = [row for row in rows if row["status"] == "converged"]
        same = [row for row in good if row["our_branch"] == row["ipc_branch"]]
        apart = [row["apart_mm"] for row in same]
        values: dict[str, Any] = {
            "rows": rows,
            "lifts": len(rows),
            "apart_mm": distribution(apart),
            "other_branch": [row for row in good if row not in same],
            "failed": [row for row in rows if row["status"] != "converged"],
            "unfinished": len(points) - len(rows),
        }
        return Conclusion(values, "\n".join(_lines(values)), {"rows.csv": as_csv(rows), "report.html": _page(values)})


def _row(point: Point, outcome: Outcome) -> dict[str, Any]:
    given = outcome.values
    names = ("elements", "our_branch", "ipc_branch", "our_seconds", "ipc_seconds", "our_status", "ipc_status")
    case = {name: value for name, value in point.inputs["case"].items() if name != "cohesion_kpa"}
    return {
        **case,
        **{name: given.get(name) for name in names},
        # Of the first tumour, the target, which lies in the lobe that is lifted.
        "moved_mm": given["moved_mm"][0] if "moved_mm" in given else None,
        "apart_mm": given["apart_mm"][0] if "apart_mm" in given else None,
        "status": outcome.status,
        "message": outcome.message,
    }


def _lines(values: Mapping[str, Any]) -> list[str]:
    lines = [f"lifts     {values['lifts']}, {len(values['other_branch'])} of them on different branches"]
    if values["apart_mm"]:
        spread = values["apart_mm"]
        lines.append(
            f"apart     median {spread['median']:.2f} mm, 95th percentile {spread['p95']:.2f} mm, "
            f"worst {spread['worst']:.2f} mm, where the branch is the same"
        )
    lines += [
        f"branch    member {row['member']}: {row['our_branch']} with ours, {row['ipc_branch']} with ipctk; "
        f"{row['apart_mm']:.2f} mm apart"
        for row in values["other_branch"]
    ]
    lines += [
        f"failed    member {row['member']}: ours {row['our_status']}, ipctk {row['ipc_status']}; {row['message']}"
        for row in values["failed"]
    ]
    if values["unfinished"]:
        lines.append(f"note      {values['unfinished']} points are not done yet; run again to go on")
    return lines


def _page(values: Mapping[str, Any]) -> bytes:
    columns = ["member", "angle", "E (kPa)", "ν", "µ", "ours", "ipctk", "moved (mm)", "apart (mm)", "status"]
    rows = [
        [
            str(row["member"]),
            f"{row['angle_deg']:.1f}°",
            f"{row['young_modulus_kpa']:.3g}",
            number(row["poisson_ratio"], 3),
            number(row["friction"]),
            str(row["our_branch"]),
            str(row["ipc_branch"]),
            number(row["moved_mm"], 2),
            number(row["apart_mm"], 3),
            str(row["status"]),
        ]
        for row in values["rows"]
    ]
    return page_as_html(Page("Two contacts", _lines(values), (), [Table("All lifts.", columns, rows)]))
