"""The twin of the sparse-data problem as a study: every technique on every case, and what no technique knows."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any, ClassVar

from glisson.core.errors import StageFailed
from glisson.core.registry import list_techniques
from glisson.core.status import Status
from glisson.framework.registering import DEFAULT
from glisson.mechanics.registration.forces import Forces
from glisson.mechanics.registration.scenario import AdjustedScenario
from glisson.navigation.figures.picture import Picture
from glisson.phantom.sparse_data.design import CaseDesign, Design
from glisson.studies.page import png
from glisson.studies.point import Outcome, Point
from glisson.studies.registration.figures import PICTURE
from glisson.studies.registration.rows import flat, scores, table_rows, totals
from glisson.studies.registration.scoring import HARDNESS, SCORE
from glisson.studies.registration.solving_model import model_point
from glisson.studies.registration.starts import STARTS, starts
from glisson.studies.registration.telling import as_lines, as_page
from glisson.studies.registration.truths import truth_point
from glisson.studies.study import Conclusion
from glisson.studies.tables import as_csv

_STARTED = 4
"""One case in so many is begun from bad starts, too."""

QUICK = {"livers": 1, "packings": 1, "views": 4, "bends": 2}


def available_techniques() -> tuple[str, ...]:
    """Names of the registrations that can be used where no manoeuvre is known, nor what holds the organ."""
    listed = [found.name for found in list_techniques(("registration",)) if found.is_available]
    return tuple(name for name in listed if name not in (Forces.name, AdjustedScenario.name))


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
        scored = [point for case in self.design.cases() for point in self._of_case(case)]
        return [*self._shown, *scored, *self._started]

    def conclude(self, prepared: Mapping[str, Outcome], done: Mapping[str, Outcome]) -> Conclusion:
        """Rows for machines, and the table as the challenge prints it."""
        points = [point for point in self.points(prepared) if point.task not in (PICTURE, STARTS)]
        begun = [done[point.key].values.get("apart_mm") for point in self._started if point.key in done]
        found = scores((point, done[point.key]) for point in points if point.key in done)
        values: dict[str, Any] = {
            "rows": table_rows(found),
            "totals": totals(found),
            "starts": starts([apart for apart in begun if apart is not None]),
            "cases": len(self.design.cases()),
            "redrawn": sum(prepared[point.key].values["redrawn"] for point in self._truths.values()),
            "failed": [f"{s.technique}, case {s.case.number}: {s.message}" for s in found if not s.errors_mm],
            "unfinished": sum(point.key not in done for point in [*points, *self._started]),
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

    @property
    def _started(self) -> list[Point]:
        """The default technique from bad starts, on some of the cases."""
        if DEFAULT not in self.techniques:
            return []
        return [
            Point(
                STARTS, {**self._inputs(case), "technique": DEFAULT, "model": self._models[case.member].key}, cost=8.0
            )
            for case in self.design.cases()[::_STARTED]
        ]

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
