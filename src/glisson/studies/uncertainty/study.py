"""The study: cases of many livers, each with an error bar that is held against the truth."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any, ClassVar

from glisson.mechanics.registration.posterior import INFLATION
from glisson.studies.page import png
from glisson.studies.point import Outcome, Point
from glisson.studies.registration.solving_model import model_point
from glisson.studies.registration.truths import truth_point
from glisson.studies.study import Conclusion
from glisson.studies.tables import as_csv
from glisson.studies.uncertainty.design import SPARSE, UncertaintyDesign
from glisson.studies.uncertainty.scores import Row, inflation, parts, scores, touch
from glisson.studies.uncertainty.tasks import LIVER
from glisson.studies.uncertainty.telling import as_lines, as_page, draw_calibration

QUICK = {"livers": 2, "tuning_livers": 1, "cases_each": 4}

TRUTH_EDGE_MM = 18.0
"""Some 6,000 quadratic elements: cheaper than the sparse-data study's, still finer than the models under test."""


@dataclass(frozen=True)
class UncertaintyStudy:
    """The error bars of the default technique on the cases of a design."""

    name: ClassVar[str] = "uncertainty"

    design: UncertaintyDesign = field(default_factory=UncertaintyDesign)

    @classmethod
    def of(cls, quick: bool, seed: int) -> "UncertaintyStudy":
        """The quick or the usual form."""
        return cls(UncertaintyDesign(seed, **QUICK) if quick else UncertaintyDesign(seed))

    def preparations(self) -> Sequence[Point]:
        """Models and packings of the livers."""
        return [*self._models.values(), *self._truths.values()]

    def points(self, prepared: Mapping[str, Outcome]) -> Sequence[Point]:
        """One for each liver that could be made; without its packing a liver has its bends."""
        return [self._point(member, prepared) for member in self._members if prepared[self._models[member].key].is_good]

    def conclude(self, prepared: Mapping[str, Outcome], done: Mapping[str, Outcome]) -> Conclusion:
        """Coverage, prediction and touches over the reported livers, and the inflation that the others ask for."""
        points = self.points(prepared)
        found = [done[point.key] for point in points if point.key in done]
        rows: list[Row] = [row for outcome in found for row in outcome.values.get("rows", ())]
        reported = [row for row in rows if row["member"] in self.design.reported]
        tuning = [row for row in rows if row["member"] in self.design.tuning]
        wanted = inflation(tuning)
        values: dict[str, Any] = {
            **scores(reported),
            "inflation": INFLATION,
            "touch": touch([row for row in reported if row["bin"] < SPARSE]),
            "touch_denser": touch([row for row in reported if row["bin"] >= SPARSE]),
            "parts": {name: scores(some) for name, some in parts(reported).items()},
            "tuning": scores(tuning) | {"inflation": None if wanted is None else INFLATION * wanted},
            "failed": self._failed(prepared, rows, found),
            "unfinished": len(points) - len(found),
        }
        shown = draw_calibration(reported)
        files = {
            "rows.csv": as_csv([_flat(row) for row in rows]),
            "report.html": as_page(values, shown),
            "calibration.png": png(shown),
        }
        return Conclusion(values, "\n".join(as_lines(values)), files)

    def _point(self, member: int, prepared: Mapping[str, Outcome]) -> Point:
        truth = self._truths[member].key
        is_packed = prepared[truth].is_good
        cases = [case for case in self.design.cases(member) if is_packed or case.origin != "packed"]
        inputs = {
            "cases": [asdict(case) for case in cases],
            "model": self._models[member].key,
            "truth": truth if is_packed else None,
            "touched": list(self.design.touched(member)),
        }
        return Point(LIVER, inputs, cost=float(len(cases)))

    def _failed(self, prepared: Mapping[str, Outcome], rows: Sequence[Row], found: Sequence[Outcome]) -> list[str]:
        """Sentences on what has no answer."""
        told = [
            f"liver {member}: {prepared[point.key].message}"
            for points in (self._models, self._truths)
            for member, point in points.items()
            if not prepared[point.key].is_good
        ]
        told += [outcome.message for outcome in found if not outcome.is_good]
        return told + [
            f"liver {row['member']}, case {row['number']}: {row['message']}" for row in rows if not row["squares"]
        ]

    @property
    def _members(self) -> tuple[int, ...]:
        """All, the reported ones first."""
        return (*self.design.reported, *self.design.tuning)

    @cached_property
    def _models(self) -> dict[int, Point]:
        return {member: model_point(self.design.seed, member) for member in self._members}

    @cached_property
    def _truths(self) -> dict[int, Point]:
        return {member: truth_point(self.design.seed, member, 1, TRUTH_EDGE_MM) for member in self._members}


def _flat(row: Row) -> dict[str, Any]:
    """A row without anything nested: of the squares, how many targets the 90 % regions hold."""
    touched = row["touch"] or {}
    names = (
        "member", "number", "origin", "coverage", "noise_mm", "outlier_share", "status", "predicted_mm", "actual_mm",
    )  # fmt: skip
    more = {f"tumour_{name}_mm": touched.get(name) for name in ("before", "proposed", "random")}
    within = scores([row])["coverage90"]
    return {name: row[name] for name in names} | {"within90": within and within["share"]} | more
