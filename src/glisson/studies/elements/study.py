"""The study of the elements: error over seconds for T4 and T10 at two of Poisson's ratios."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from glisson.core.errors import StageFailed
from glisson.core.status import Status
from glisson.studies.elements.tasks import SOLVE, counts_of
from glisson.studies.elements.telling import as_lines, as_page, draw_errors
from glisson.studies.page import png
from glisson.studies.point import Outcome, Point
from glisson.studies.study import Conclusion
from glisson.studies.tables import as_csv

RATIOS = (0.45, 0.499)
_CUBES = {"T4": (4, 6, 8, 12, 16, 19), "T10": (2, 3, 4, 6, 8)}
_REFERENCE_CUBES = 12
_QUICK_CUBES = {"T4": (3, 4), "T10": (1, 2)}
_QUICK_REFERENCE_CUBES = 4


@dataclass(frozen=True)
class Elements:
    """Blocks with so many `cubes` across, against T10 with `reference` cubes."""

    name: ClassVar[str] = "elements"

    cubes: Mapping[str, tuple[int, ...]]
    reference: int

    @classmethod
    def of(cls, quick: bool) -> "Elements":
        """The quick or the usual form."""
        return cls(_QUICK_CUBES, _QUICK_REFERENCE_CUBES) if quick else cls(_CUBES, _REFERENCE_CUBES)

    def preparations(self) -> Sequence[Point]:
        """The references."""
        return [_point("T10", self.reference, ratio) for ratio in RATIOS]

    def points(self, prepared: Mapping[str, Outcome]) -> Sequence[Point]:
        """The coarser solutions.

        Raises:
            StageFailed: a reference did not converge.
        """
        for point in self.preparations():
            outcome = prepared[point.key]
            if not outcome.is_good:
                raise StageFailed(f"A reference failed: {outcome.message}", outcome.status or Status.STAGNATED)
        return [
            _point(element, cubes, ratio, reference.key)
            for ratio, reference in zip(RATIOS, self.preparations(), strict=True)
            for element, all_cubes in self.cubes.items()
            for cubes in all_cubes
        ]

    def conclude(self, prepared: Mapping[str, Outcome], done: Mapping[str, Outcome]) -> Conclusion:
        """A row for each solution, and by how much the error of T4 at equal time is larger than that of T10."""
        rows = [_row(point, done[point.key]) for point in self.points(prepared) if point.key in done]
        values: dict[str, Any] = {
            "rows": rows,
            "advantage": [advantage for ratio in RATIOS for advantage in _advantages(rows, ratio)],
            "unfinished": len(self.points(prepared)) - len(rows),
        }
        picture = draw_errors(rows)
        files = {"rows.csv": as_csv(rows), "report.html": as_page(values, picture), "errors.png": png(picture)}
        return Conclusion(values, "\n".join(as_lines(values)), files)


def _point(element: str, cubes: int, ratio: float, reference: str | None = None) -> Point:
    nodes = np.prod(np.array(counts_of(cubes)) * (2 if element == "T10" else 1) + 1)
    beside = {} if reference is None else {"reference": reference}
    inputs = {"element": element, "cubes": cubes, "poisson_ratio": ratio} | beside
    return Point(SOLVE, inputs, cost=float(nodes))


def _row(point: Point, outcome: Outcome) -> dict[str, Any]:
    measured = ("elements", "unknowns", "solve_seconds", "target_mm", "whole_mm")
    return {
        **{name: point.inputs[name] for name in ("element", "cubes", "poisson_ratio")},
        **{name: outcome.values.get(name) for name in measured},
        "status": outcome.status,
        "message": outcome.message,
    }


def _advantages(rows: Sequence[Mapping[str, Any]], ratio: float) -> list[dict[str, Any]]:
    """For each T10 solution within T4's range of times: T4's error at that time over its own."""
    of = {
        element: sorted(
            (row["solve_seconds"], row["whole_mm"])
            for row in rows
            if row["element"] == element and row["poisson_ratio"] == ratio and row["whole_mm"] is not None
        )
        for element in ("T4", "T10")
    }
    if len(of["T4"]) < 2:
        return []
    times, errors = (np.log(column) for column in zip(*of["T4"], strict=True))
    found = []
    for seconds, error in of["T10"]:
        if times[0] <= np.log(seconds) <= times[-1]:
            beside = float(np.exp(np.interp(np.log(seconds), times, errors)))
            found.append({"poisson_ratio": ratio, "seconds": seconds, "t4_mm": beside, "t10_mm": error})
    return found
