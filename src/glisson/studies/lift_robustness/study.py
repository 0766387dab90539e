"""The robustness study: how many of the drawn lifts converge, and what became of the others."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any, ClassVar

from glisson.core.status import Status
from glisson.studies.lift_robustness.cases import EASY_CASE, LiftCase, draw_case
from glisson.studies.lift_robustness.tasks import LIFT
from glisson.studies.lift_robustness.telling import as_lines, as_page
from glisson.studies.point import Outcome, Point
from glisson.studies.study import Conclusion
from glisson.studies.tables import as_csv

CASES, QUICK_CASES = 210, 8
"""Some are impossible, which is told before any load step: their lever would cut into a part that is held."""

_EDGE_MM, _QUICK_EDGE_MM = 24.0, 40.0
"""About 4,500 and 2,000 quadratic elements."""


@dataclass(frozen=True)
class LiftRobustness:
    """`count` lifts drawn from a seed, on meshes of that edge length."""

    name: ClassVar[str] = "lift-robustness"

    seed: int = 0
    count: int = CASES
    edge_length_mm: float = _EDGE_MM

    @classmethod
    def of(cls, quick: bool, seed: int) -> "LiftRobustness":
        """The quick or the usual form."""
        return cls(seed, QUICK_CASES, _QUICK_EDGE_MM) if quick else cls(seed)

    def preparations(self) -> Sequence[Point]:
        """One easy lift, with which the solver is compiled."""
        return [Point(LIFT, {"case": asdict(EASY_CASE), "edge_length_mm": _QUICK_EDGE_MM})]

    def points(self, prepared: Mapping[str, Outcome]) -> Sequence[Point]:
        """The lifts."""
        return [point for _, point in self._lifts]

    def conclude(self, prepared: Mapping[str, Outcome], done: Mapping[str, Outcome]) -> Conclusion:
        """Counts, and a row for each lift."""
        drawn = [_row(case, done[point.key]) for case, point in self._lifts if point.key in done]
        impossible = [row for row in drawn if row["status"] == Status.BAD_INPUT and row["load_steps"] == 0]
        rows = [row for row in drawn if row not in impossible]
        good = [row for row in rows if row["status"] == "converged"]
        values: dict[str, Any] = {
            "rows": rows,
            "cases": len(rows),
            "converged": len(good) / len(rows) if rows else None,
            "slipped_off": sum(row["slipped_off"] for row in good),
            "inverted": sum(row["inverted"] > 0 for row in good),
            "node_gap_mm": min((row["node_gap_mm"] for row in good), default=None),
            "penetrated": sum(row["least_gap_mm"] is not None and row["least_gap_mm"] <= 0.0 for row in good),
            "failed": [row for row in rows if row["status"] != "converged"],
            "impossible": impossible,
            "unfinished": len(self._lifts) - len(drawn),
        }
        files = {"rows.csv": as_csv(rows, leave_out=("events",)), "report.html": as_page(values)}
        return Conclusion(values, "\n".join(as_lines(values)), files)

    @cached_property
    def _lifts(self) -> list[tuple[LiftCase, Point]]:
        cases = [draw_case(self.seed, number) for number in range(self.count)]
        return [(case, Point(LIFT, {"case": asdict(case), "edge_length_mm": self.edge_length_mm})) for case in cases]


def _row(case: LiftCase, outcome: Outcome) -> dict[str, Any]:
    names = ("elements", "load_steps", "iterations", "least_gap_mm", "node_gap_mm", "inverted")
    events = outcome.values.get("events", [])
    return {
        **asdict(case),
        "status": outcome.status,
        "message": outcome.message,
        "events": events,
        "slipped_off": any(event["kind"] == "lost_contact" for event in events),
        **{name: outcome.values.get(name) for name in names},
        "seconds": outcome.seconds,
    }
