"""From outcomes to rows: target errors by technique, truth, bin and noise, as the challenge counts them.

Errors are pooled over all targets of all cases of a row; techniques that gave no answer on a case are counted apart.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from glisson.phantom.sparse_data.design import BINS, NOISES_MM, CaseDesign
from glisson.studies.point import Outcome, Point
from glisson.studies.registration.scoring import BEST, BEST_OF_DATA, HARDNESS, NOTHING

SETS = ("packed", "closed-form")
BIN_NAMES = tuple(f"{100 * low:.0f}-{100 * high:.0f}" for low, high in BINS)
_KNOWING = (NOTHING, BEST, BEST_OF_DATA)


@dataclass(frozen=True)
class Score:
    """A technique on a case; no errors where it gave no answer. `milliseconds` is None if it is no technique."""

    technique: str
    case: CaseDesign
    errors_mm: tuple[float, ...]
    milliseconds: float | None = None
    status: str | None = None
    message: str = ""


def scores(outcomes: Iterable[tuple[Point, Outcome]]) -> list[Score]:
    """The scores that points of the twin have."""
    found = []
    for point, outcome in outcomes:
        case, values = CaseDesign(**point.inputs["case"]), outcome.values
        if point.task == HARDNESS:
            errors = values.get("errors_mm", {})
            found += [Score(name, case, tuple(errors.get(name, ())), message=outcome.message) for name in _KNOWING]
        else:
            errors, spent = tuple(values.get("errors_mm", ())), values.get("milliseconds")
            name = point.inputs["technique"]
            found.append(Score(name, case, errors, spent, outcome.status, outcome.message))
    return found


def table_rows(found: Sequence[Score]) -> list[dict[str, Any]]:
    """A row for each technique, truth, bin and noise that has a case."""
    rows = []
    names, bins = dict.fromkeys(score.technique for score in found), enumerate(BIN_NAMES)
    for technique, origin, (number, name), noise in product(names, SETS, bins, NOISES_MM):
        wanted = (technique, origin, number, noise)
        here = [s for s in found if (s.technique, s.case.origin, s.case.bin, s.case.noise_mm) == wanted]
        if here:
            rows.append({"technique": technique, "set": origin, "bin": name, "noise_mm": noise, **_told(here)})
    return rows


def totals(found: Sequence[Score]) -> list[dict[str, Any]]:
    """Mean and standard deviation of the target error (mm) of each technique by bin, noise, truth, and of all."""
    told = []
    for technique in dict.fromkeys(score.technique for score in found):
        own = [score for score in found if score.technique == technique]
        parts = {name: [s for s in own if s.case.bin == number] for number, name in enumerate(BIN_NAMES)}
        parts |= {f"noise {noise:g} mm": [s for s in own if s.case.noise_mm == noise] for noise in NOISES_MM}
        parts |= {origin: [s for s in own if s.case.origin == origin] for origin in SETS}
        parts |= {"outliers": [s for s in own if s.case.outlier_share > 0.0], "all": own}
        told.append({"technique": technique, "parts": {n: _mean_sd(p) for n, p in parts.items()}, **_told(own)})
    return told


def _told(here: Sequence[Score]) -> dict[str, Any]:
    errors, spent = _pooled(here), [score.milliseconds for score in here if score.milliseconds is not None]
    return {
        "cases": len(here),
        "failed": sum(not score.errors_mm for score in here),
        "flagged": sum(score.status not in (None, "converged") for score in here),
        "tre_mm": None if errors is None else {
            "mean": float(errors.mean()),
            "median": float(np.median(errors)),
            "p95": float(np.percentile(errors, 95)),
        },
        "force_percent": None,
        "milliseconds": {"median": float(np.median(spent)), "p95": float(np.percentile(spent, 95))} if spent else None,
    }  # fmt: skip


def _mean_sd(here: Sequence[Score]) -> dict[str, float] | None:
    errors = _pooled(here)
    return None if errors is None else {"mean": float(errors.mean()), "sd": float(errors.std())}


def _pooled(here: Sequence[Score]) -> Any:
    errors = [error for score in here for error in score.errors_mm]
    return np.array(errors) if errors else None


def flat(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Rows without anything nested, for a table."""
    made = []
    for row in rows:
        tre, spent = row["tre_mm"] or {}, row["milliseconds"] or {}
        plain = {name: value for name, value in row.items() if name not in ("tre_mm", "milliseconds")}
        plain |= {f"tre_{name}_mm": tre.get(name) for name in ("mean", "median", "p95")}
        made.append(plain | {f"milliseconds_{name}": spent.get(name) for name in ("median", "p95")})
    return made
