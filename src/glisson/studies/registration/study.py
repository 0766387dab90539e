"""The twin of the sparse-data problem as a study: every technique on every case, and what no technique knows."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any, ClassVar

from glisson.core.errors import StageFailed
from glisson.core.registry import list_techniques
from glisson.core.status import Status
from glisson.mechanics.registration.scenario import AdjustedScenario
from glisson.navigation.figures.picture import Picture
from glisson.phantom.sparse_data.design import CaseDesign, Design
from glisson.studies.page import png
from glisson.studies.point import Outcome, Point
from glisson.studies.registration.figures import PICTURE
from glisson.studies.registration.rows import flat, scores, table_rows, totals
from glisson.studies.registration.scoring import HARDNESS, SCORE
from glisson.studies.registration.solving_model import model_point
from glisson.studies.registration.telling import as_lines, as_page
from glisson.studies.registration.truths import truth_point
from glisson.studies.study import Conclusion
from glisson.studies.tables import as_csv

QUICK = {"livers": 1, "packings": 1, "views": 4, "bends": 2}


def available_techniques() -> tuple[str, ...]:
    """Names of the registrations that can be used here: there is no manoeuvre that could be adjusted."""
    listed = [found.name for found in list_techniques(("registration",)) if found.is_available]
    return tuple(name for name in listed if name != AdjustedScenario.name)


@dataclass(frozen=True)
class SparseDataTwin:
    """Techniques, by name, on the cases of a design."""

    name: ClassVar[str] = "sparse-data"

    design: Design = field(default_factory=Design)
    techniques: tuple[str, ...] = field(default_factory=available_techniques)

    @classmethod
    def of(cls, quick: bool, seed: int) -> "SparseDataTwin":
        """The quick or the usual form."""
        return cls(Design(seed, **QUICK) if quick else Design(seed))

    def preparations(self) -> Sequence[Point]:
        """Truths and models of the livers."""
        return [*self._truths.values(), *self._models.values()]

    def points(self, prepared: Mapping[str, Outcome]) -> Sequence[Point]:
        """Every technique on each case, and how hard it is."""
        for point in self.preparations():
            made = prepared[point.key]
            if not made.is_good:
                status = made.status or Status.STAGNATED
                raise StageFailed(f"A liver of the twin could not be made: {made.message}", status)
        return [*self._shown, *(point for case in self.design.cases() for point in self._of_case(case))]

    def conclude(self, prepared: Mapping[str, Outcome], done: Mapping[str, Outcome]) -> Conclusion:
        """Rows for machines, and the table as the challenge prints it."""
        points = [point for point in self.points(prepared) if point.task != PICTURE]
        found = scores((point, done[point.key]) for point in points if point.key in done)
        values: dict[str, Any] = {
            "rows": table_rows(found),
            "totals": totals(found),
            "cases": len(self.design.cases()),
            "redrawn": sum(prepared[point.key].values["redrawn"] for point in self._truths.values()),
            "failed": [f"{s.technique}, case {s.case.number}: {s.message}" for s in found if not s.errors_mm],
            "unfinished": sum(point.key not in done for point in points),
        }
        shown = [done[point.key] for point in self._shown if point.key in done]
        pictures = [Picture(**outcome.values) for outcome in shown if outcome.is_good]
        files = {"rows.csv": as_csv(flat(values["rows"])), "report.html": as_page(values, pictures)}
        files |= {f"case-{number}.png": png(one) for number, one in enumerate(pictures)}
        return Conclusion(values, "\n".join(as_lines(values)), files)

    @property
    def _shown(self) -> list[Point]:
        """A picture of the first case of each kind."""
        first = {case.origin: case for case in reversed(self.design.cases())}
        return [Point(PICTURE, self._inputs(case)) for _, case in sorted(first.items(), reverse=True)]

    def _inputs(self, case: CaseDesign) -> dict[str, Any]:
        truth = self._truths[case.member].key if case.origin == "packed" else None
        return {"case": asdict(case), "truth": truth}

    def _of_case(self, case: CaseDesign) -> list[Point]:
        inputs = self._inputs(case)
        model = self._models[case.member].key
        more = [{"technique": name, "parameters": {}, "model": model} for name in self.techniques]
        return [Point(HARDNESS, inputs), *(Point(SCORE, {**inputs, **one}, cost=5.0) for one in more)]

    @cached_property
    def _truths(self) -> dict[int, Point]:
        design = self.design
        return {m: truth_point(design.seed, m, design.packings) for m in design.members} if design.packings else {}

    @cached_property
    def _models(self) -> dict[int, Point]:
        return {member: model_point(self.design.seed, member) for member in self.design.members}
