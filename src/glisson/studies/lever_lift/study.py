"""The lever-lift twin: unseen livers, lifted; how well the adjusted manoeuvre tells what has become of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from glisson.studies.lever_lift.cases import FIRST_MEMBER, LeverCase, draw_case
from glisson.studies.lever_lift.planning import plan_point
from glisson.studies.lever_lift.scoring import score_point
from glisson.studies.lever_lift.telling import as_lines, as_page
from glisson.studies.lever_lift.truths import truth_point
from glisson.studies.point import Outcome, Point
from glisson.studies.study import Conclusion
from glisson.studies.tables import as_csv, distribution

CASES, QUICK_CASES = 50, 1
_MEMBERS_A_SEED = 1000

_TRUTH_MESH_MM, _MODEL_MESH_MM = (22.0, 1.0), (36.0, 1.8)
"""Edge lengths and envelopes: some 6,500 and 3,300 quadratic elements."""

_FIGURES = ("tumour_mm", "plane_deg", "removed_points", "rigid_mm", "uncorrected_mm")


@dataclass(frozen=True)
class LeverLift:
    """So many lifts of livers of their own; the livers of one seed are no other seed's."""

    name: ClassVar[str] = "lever-lift"

    seed: int = 0
    count: int = CASES
    first_member: int = FIRST_MEMBER
    truth_mesh_mm: tuple[float, float] = _TRUTH_MESH_MM
    model_mesh_mm: tuple[float, float] = _MODEL_MESH_MM

    @classmethod
    def of(cls, quick: bool, seed: int) -> "LeverLift":
        """The quick or the usual form."""
        return cls(seed, QUICK_CASES if quick else CASES)

    def preparations(self) -> Sequence[Point]:
        """Truths and plans, case by case."""
        return [point for _, truth, plan in self._cases for point in (truth, plan)]

    def points(self, prepared: Mapping[str, Outcome]) -> Sequence[Point]:
        """The registrations of all cases that have a truth and a plan."""
        return [
            score_point(plan, truth)
            for _, truth, plan in self._cases
            if prepared[truth.key].is_good and prepared[plan.key].is_good
        ]

    def conclude(self, prepared: Mapping[str, Outcome], done: Mapping[str, Outcome]) -> Conclusion:
        """Distributions over the cases that came to rest, and a row for each."""
        rows, errors, unfinished = [], [], 0
        for case, truth, plan in self._cases:
            point = score_point(plan, truth)
            failed = next((prepared[p.key] for p in (truth, plan) if not prepared[p.key].is_good), None)
            outcome = failed or done.get(point.key)
            if outcome is None:
                unfinished += 1
                continue
            rows.append(_row(case, outcome, truth))
            if outcome.is_good:
                errors += outcome.values["surface_errors_mm"]
        good = [row for row in rows if row["status"] == "converged"]
        values: dict[str, Any] = {
            "cases": len(rows),
            "calculix": sum(row["truth"] == "calculix" for row in rows),
            "converged": len(good) / len(rows) if rows else None,
            **{name: distribution([row[name] for row in good if row[name] is not None]) for name in _FIGURES},
            "surface_mm": distribution(errors),
            "coverage90": float(np.mean([row["covered90"] for row in good])) if good else None,
            "rows": rows,
            "failed": [f"liver {r['member']}: {r['message']}" for r in rows if r["status"] != "converged"],
            "unfinished": unfinished,
        }
        files = {"rows.csv": as_csv(rows, leave_out=("notes",)), "report.html": as_page(values)}
        return Conclusion(values, "\n".join(as_lines(values)), files)

    @cached_property
    def _cases(self) -> list[tuple[LeverCase, Point, Point]]:
        first = self.first_member + _MEMBERS_A_SEED * self.seed
        cases = [draw_case(member) for member in range(first, first + self.count)]
        truths = [truth_point(case, *self.truth_mesh_mm) for case in cases]
        plans = [plan_point(truth, {}, *self.model_mesh_mm) for truth in truths]
        return list(zip(cases, truths, plans, strict=True))


def _row(case: LeverCase, outcome: Outcome, truth: Point) -> dict[str, Any]:
    found = outcome.values
    surface = found.get("surface_errors_mm")
    names = (*_FIGURES, "covered90", "radius90_mm", "elements")
    return {
        "member": case.member,
        "truth": "own" if case.calculix is None else "calculix",
        "angle_deg": case.angle_deg,
        "angle_off_deg": case.angle_off_deg,
        "status": outcome.status,
        "message": outcome.message,
        **{name: found.get(name) for name in names},
        "surface_p95_mm": None if surface is None else float(np.percentile(surface, 95)),
        "seconds": outcome.seconds,
        "notes": found.get("notes", []),
    }
