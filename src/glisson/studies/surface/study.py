"""The study of two-view reconstruction: how wrong both ways are, and whether their error bars hold."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, ClassVar

import numpy as np
from scipy.stats import percentileofscore

from glisson.core.errors import StageFailed
from glisson.core.status import Status
from glisson.phantom.half_sphere_box import POSITIONS_DEG
from glisson.phantom.measured_views import TROCAR
from glisson.studies.page import png
from glisson.studies.point import Outcome, Point
from glisson.studies.study import Conclusion
from glisson.studies.surface.pixels import PIXELS
from glisson.studies.surface.printed import PRINTED_MM
from glisson.studies.surface.tasks import BREATHING, FIT, PAIRS, RECONSTRUCT, TEN
from glisson.studies.surface.telling import as_lines, as_page, draw_errors
from glisson.studies.tables import as_csv, distribution

SEEDS, QUICK_SEEDS = 1000, 25
FIT_SEEDS, QUICK_FIT_SEEDS = 1000, 200
RENDERED, QUICK_RENDERED = 10, 1
_BLOCK = 25

FITTED, STATED = "fitted", "stated"
"""The noise with which the construction is as wrong as printed, and what the dissertation states of its trocar."""

_NAMES = {FITTED: (*PAIRS, *BREATHING, TEN), STATED: tuple(PAIRS)}


@dataclass(frozen=True)
class SurfaceStudy:
    """So many draws of the noise from a seed; `fit_seeds` others for the fit, and `rendered` from pixels."""

    name: ClassVar[str] = "surface"

    seed: int = 0
    seeds: int = SEEDS
    fit_seeds: int = FIT_SEEDS
    rendered: int = RENDERED

    @classmethod
    def of(cls, quick: bool, seed: int) -> "SurfaceStudy":
        """The quick or the usual form."""
        return cls(seed, QUICK_SEEDS, QUICK_FIT_SEEDS, QUICK_RENDERED) if quick else cls(seed)

    def preparations(self) -> Sequence[Point]:
        """The fit of the noise."""
        return [Point(FIT, {"seeds": self.fit_seeds})]

    def points(self, prepared: Mapping[str, Outcome]) -> Sequence[Point]:
        """Blocks of draws, and rendered ones.

        Raises:
            StageFailed: the noise could not be fitted.
        """
        fit = prepared[self.preparations()[0].key]
        if not fit.is_good:
            raise StageFailed(f"The noise could not be fitted: {fit.message}", fit.status or Status.STAGNATED)
        noises = {FITTED: fit.values["noise"], STATED: asdict(TROCAR)}
        blocks = [
            Point(
                RECONSTRUCT,
                {
                    "noise": noises[run],
                    "run": run,
                    "stream": self.seed,
                    "first": first,
                    "seeds": min(_BLOCK, self.seeds - first),
                    "names": list(_NAMES[run]),
                },
            )
            for first in range(0, self.seeds, _BLOCK)
            for run in (FITTED, STATED)
        ]
        rendered = [
            Point(PIXELS, {"noise": noises[FITTED], "stream": self.seed, "seed": number})
            for number in range(self.rendered)
        ]
        return [*blocks[:2], *rendered[:1], *blocks[2:], *rendered[1:]]

    def conclude(self, prepared: Mapping[str, Outcome], done: Mapping[str, Outcome]) -> Conclusion:
        """Distributions of the six points' mean errors over the draws."""
        points = self.points(prepared)
        given = [(point, done[point.key]) for point in points if point.key in done]
        rows = [
            {"run": point.inputs.get("run", "rendered"), **row}
            for point, outcome in given
            for row in outcome.values.get("rows", ())
        ]
        fit = prepared[self.preparations()[0].key].values
        values: dict[str, Any] = {
            "noise": fit["noise"],
            "noise_factor": fit["factor"],
            "fit_mm": fit["mean_mm"],
            "pairs": {name: _pair(rows, FITTED, name) for name in PAIRS},
            "breathing": {name: _pair(rows, FITTED, name) for name in BREATHING},
            "ten_views": _pair(rows, FITTED, TEN),
            "stated": {name: _pair(rows, STATED, name) for name in PAIRS},
            "rendered": {name: _rendered(rows, name) for name in PAIRS},
            "failed": [outcome.message for _, outcome in given if not outcome.is_good],
            "unfinished": len(points) - len(given),
        }
        shown = draw_errors(values)
        files = {
            "rows.csv": as_csv([_flat(row) for row in rows]),
            "report.html": as_page(values, shown),
            "errors.png": png(shown),
        }
        return Conclusion(values, "\n".join(as_lines(values)), files)


def _pair(rows: Sequence[Mapping[str, Any]], run: str, name: str) -> dict[str, Any]:
    """What one row of Table 3 or 4 has become.

    `coverage90` is that of the joint adjustment; `percentile` is where the printed mean falls among the construction's.
    """
    angle = POSITIONS_DEG[PAIRS.get(name, 3)]
    here = [row for row in rows if (row["run"], row["views"]) == (run, name)]
    classic, joint = ([row for row in here if row["way"] == way] for way in ("construction", "bundle"))
    means = [float(np.mean(row["errors_mm"])) for row in classic if row["errors_mm"]]
    printed = PRINTED_MM.get(name)
    return {
        "angle_deg": round(angle, 2),
        "classic_mm": _spread(classic),
        "joint_mm": _spread(joint),
        "coverage90": _coverage(joint),
        "classic_coverage90": _coverage(classic),
        "classic_mean_mm": float(np.mean(means)) if means else None,
        "printed_mm": printed,
        "percentile": float(percentileofscore(means, printed)) if means and printed is not None else None,
        "joint_no_worse": _no_worse(classic, joint),
        "flagged": _share(joint, "flagged"),
        "classic_flagged": _share(classic, "flagged"),
        "refused": _share(joint, "refused"),
        "classic_refused": _share(classic, "refused"),
        "draws": len(joint),
    }


def _rendered(rows: Sequence[Mapping[str, Any]], name: str) -> dict[str, Any]:
    here = [row for row in rows if (row["run"], row["views"]) == ("rendered", name)]
    good = [row for row in here if row.get("features") is not None]
    names = ("features", "feature_px", "feature_outliers", "tip_px")
    return {
        "joint_mm": _spread(good),
        "coverage90": _coverage(good),
        **{one: float(np.median([row[one] for row in good])) if good else None for one in names},
        "draws": len(here),
        "messages": [row["message"] for row in here if row.get("message")],
    }


def _spread(rows: Sequence[Mapping[str, Any]]) -> dict[str, float] | None:
    """Median, 95th percentile and worst of the six points' mean errors."""
    return distribution([float(np.mean(row["errors_mm"])) for row in rows if row["errors_mm"]])


def _coverage(rows: Sequence[Mapping[str, Any]]) -> float | None:
    inside = [one for row in rows for one in row["inside"] or ()]
    return float(np.mean(inside)) if inside else None


def _share(rows: Sequence[Mapping[str, Any]], what: str) -> float | None:
    return float(np.mean([row[what] for row in rows])) if rows else None


def _no_worse(classic: Sequence[Mapping[str, Any]], joint: Sequence[Mapping[str, Any]]) -> float | None:
    """Share of draws in which the joint adjustment's mean error is no larger."""
    others = {row["seed"]: row["errors_mm"] for row in classic}
    both = [(row["errors_mm"], others[row["seed"]]) for row in joint if row["errors_mm"] and others.get(row["seed"])]
    return float(np.mean([np.mean(one) <= np.mean(other) for one, other in both])) if both else None


def _flat(row: Mapping[str, Any]) -> dict[str, Any]:
    errors, inside = row.get("errors_mm") or [None] * 6, row.get("inside") or [None] * 6
    names = ("run", "seed", "views", "way", "flagged", "refused", "features", "feature_px", "tip_px")
    return (
        {name: row.get(name) for name in names}
        | {f"error_{number}_mm": error for number, error in enumerate(errors, start=1)}
        | {f"inside_{number}": one for number, one in enumerate(inside, start=1)}
    )
