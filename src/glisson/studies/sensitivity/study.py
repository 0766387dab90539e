"""The sensitivity study: which points it has, and its conclusion."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from itertools import chain
from typing import Any, ClassVar

from glisson.core.errors import StageFailed
from glisson.core.status import Status
from glisson.phantom.lift_truths import lift_truth
from glisson.studies.page import png
from glisson.studies.point import Outcome, Point
from glisson.studies.sensitivity.choices import (
    LONG_SIZES,
    SIZES,
    SOFT,
    STIFF,
    Choice,
    Tissue,
    all_together,
    one_at_a_time,
)
from glisson.studies.sensitivity.figures import draw_charts
from glisson.studies.sensitivity.rows import Truth, compared, effects, truth_values
from glisson.studies.sensitivity.tasks import CALCULIX, LIFT, MESH, TWIN, choice_inputs
from glisson.studies.sensitivity.telling import as_page, as_text
from glisson.studies.study import Conclusion
from glisson.studies.tables import as_csv

PHANTOM = "demo"
"""The liver of the study: the member of the family whose lift CalculiX has solved."""

TWIN_ELEMENTS, QUICK_TWIN_ELEMENTS = 30_000, 12_000
"""Size of the twins, and of those that the quick form holds its coarse models against."""

_QUICK_SIZES = {"coarse": SIZES["coarse"]}


@dataclass(frozen=True)
class Sensitivity:
    """Models of one liver in several `sizes`, against CalculiX and against twins of `twin_elements` T10.

    The quick form has one size, and only the models that the charts show; without `combined` so has any.
    """

    name: ClassVar[str] = "sensitivity"

    sizes: Mapping[str, int] = field(default_factory=lambda: SIZES)
    twin_elements: int = TWIN_ELEMENTS
    element: str = "T10"
    combined: bool = True

    @classmethod
    def of(cls, quick: bool, long: bool, element: str) -> "Sensitivity":
        """The quick, the usual or the long form."""
        if quick:
            return cls(_QUICK_SIZES, QUICK_TWIN_ELEMENTS, element, combined=False)
        return cls(LONG_SIZES if long else SIZES, TWIN_ELEMENTS, element)

    def preparations(self) -> Sequence[Point]:
        """Meshes and truths."""
        return [*self._meshes.values(), *(point for _, _, point in self._truths)]

    def points(self, prepared: Mapping[str, Outcome]) -> Sequence[Point]:
        """The lifts, those of the charts first."""
        for name, mesh in self._meshes.items():
            made = prepared[mesh.key]
            if not made.is_good:
                raise StageFailed(f"The {name} mesh could not be made: {made.message}", made.status or Status.STAGNATED)
        return list(self._lifts.values())

    def conclude(self, prepared: Mapping[str, Outcome], done: Mapping[str, Outcome]) -> Conclusion:
        """The rows, what each parameter does, and the charts."""
        truths = [Truth(kind, tissue, prepared[point.key]) for kind, tissue, point in self._truths]
        lifts = [
            (choice, int(prepared[self._meshes[choice.mesh].key].values["elements"]), done[point.key])
            for choice, point in self._lifts.items()
            if point.key in done
        ]
        rows = compared(lifts, truths, self.element)
        values: dict[str, Any] = {
            "rows": rows,
            "truths": [truth_values(truth) for truth in truths],
            "effects": effects(rows, truths),
            "cases": len(lifts),
            "converged": sum(lift.is_good for _, _, lift in lifts) / len(lifts) if lifts else None,
            "unfinished": len(self._lifts) - len(lifts),
        }
        charts = draw_charts(rows, truths, tuple(self.sizes))
        files = {
            "rows.csv": as_csv(rows, leave_out=("events",)),
            "report.html": as_page(values, list(charts.values())),
            **{name: png(chart) for name, chart in charts.items()},
        }
        return Conclusion(values, as_text(values), files)

    @cached_property
    def _meshes(self) -> dict[str, Point]:
        return {
            name: Point(MESH, {"phantom": PHANTOM, "elements": count}, cost=20.0 + count / 300.0)
            for name, count in self.sizes.items()
        }

    @cached_property
    def _truths(self) -> list[tuple[str, Tissue, Point]]:
        known = lift_truth(PHANTOM)
        tissue = Tissue(known.young_modulus_kpa, known.poisson_ratio, known.friction, known.cohesion_kpa)
        return [
            ("calculix", tissue, Point(CALCULIX, {"phantom": PHANTOM}, cost=0.3)),
            *(("fine-t10", twin, self._twin(twin)) for twin in (STIFF, SOFT)),
        ]

    def _twin(self, tissue: Tissue) -> Point:
        inputs = {"phantom": PHANTOM, "elements": self.twin_elements, "tissue": asdict(tissue)}
        return Point(TWIN, inputs, cost=self.twin_elements / 40.0)

    @cached_property
    def _lifts(self) -> dict[Choice, Point]:
        return {
            choice: Point(
                LIFT,
                choice_inputs(choice, PHANTOM, self.element, self._meshes[choice.mesh].key),
                cost=self.sizes[choice.mesh] / 100.0,
            )
            for choice in dict.fromkeys(self._choices())
        }

    def _choices(self) -> Iterator[Choice]:
        charted = chain(one_at_a_time(STIFF, self.sizes), one_at_a_time(SOFT, self.sizes))
        return chain(charted, all_together(self.sizes)) if self.combined else charted
