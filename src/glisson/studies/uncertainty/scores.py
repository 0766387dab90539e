"""From rows of cases to what they say together: coverage with its interval, predicted against actual, worth of a touch.

Targets of one liver are no independent draws: intervals are those of a bootstrap that draws livers (Davison and Hinkley
1997, section 2.4).
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.stats import chi2, wilcoxon

from glisson.core.arrays import FloatArray
from glisson.phantom.sparse_data.design import NOISES_MM
from glisson.studies.uncertainty.design import COVERAGES
from glisson.studies.uncertainty.tasks import PROPOSED, RANDOM

LEVELS = (50, 90, 95)
BIN_NAMES = tuple(f"{100 * low:.0f}-{100 * high:.0f} %" for low, high in COVERAGES)

_DRAWS = 2000
_INTERVAL = (2.5, 97.5)
_FEWEST_TOUCHES = 6

Row = Mapping[str, Any]


def scores(rows: Sequence[Row]) -> dict[str, Any]:
    """All figures of some rows; None where there are too few of them."""
    good = [row for row in rows if row["squares"]]
    predicted, actual = (np.array([row[name] for row in good]) for name in ("predicted_mm", "actual_mm"))
    some = len(good) > 0
    return {
        "cases": len(good),
        "livers": len({row["member"] for row in good}),
        **{f"coverage{level}": coverage(good, level) for level in LEVELS},
        "predicted_mm": float(predicted.mean()) if some else None,
        "actual_mm": float(actual.mean()) if some else None,
        "difference_mm": float(np.abs(predicted - actual).mean()) if some else None,
        "correlation": _correlation(predicted, actual),
        "flagged": sum(row["status"] != "converged" for row in good),
    }


def coverage(rows: Sequence[Row], level: int) -> dict[str, float] | None:
    """Share of the targets within their regions of a level (%), and the interval that holds it by 95 %."""
    if not rows:
        return None
    within = _within(rows, float(chi2.ppf(level / 100.0, 3)))
    _, liver = np.unique([row["member"] for row in rows], return_inverse=True)
    inside, targets = np.bincount(liver, within), np.bincount(liver, [len(row["squares"]) for row in rows])
    count = len(inside)
    times = np.random.default_rng(level).multinomial(count, np.full(count, 1.0 / count), size=_DRAWS)
    low, high = np.percentile((times @ inside) / (times @ targets), _INTERVAL)
    return {"share": float(inside.sum() / targets.sum()), "low": float(low), "high": float(high)}


def inflation(rows: Sequence[Row], level: int = 90) -> float | None:
    """By what standard deviations have to be multiplied so that regions of a level hold that share of the targets."""
    squares = [square for row in rows for square in row["squares"]]
    return float(np.sqrt(np.quantile(squares, level / 100.0) / chi2.ppf(level / 100.0, 3))) if squares else None


def touch(rows: Sequence[Row]) -> dict[str, Any]:
    """The tumour's mean error without a touch, after the proposed one and after any, and whether the first is better.

    `p` is that of Wilcoxon's signed-rank test (1945) of the pairs, one-sided.
    """
    pairs = [row["touch"] for row in rows if row["touch"]]
    before, proposed, other = (np.array([pair[name] for pair in pairs]) for name in ("before", PROPOSED, RANDOM))
    enough = len(pairs) >= _FEWEST_TOUCHES
    return {
        "cases": len(pairs),
        "before_mm": float(before.mean()) if pairs else None,
        "proposed_mm": float(proposed.mean()) if pairs else None,
        "random_mm": float(other.mean()) if pairs else None,
        "gain_percent": float(100.0 * (1.0 - proposed.mean() / other.mean())) if pairs else None,
        "p": float(wilcoxon(proposed, other, alternative="less").pvalue) if enough else None,
    }


def parts(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Rows by kind of truth, by share of the surface that is seen, by noise, and those with outliers."""
    found = {origin: [row for row in rows if row["origin"] == origin] for origin in ("packed", "closed-form")}
    found |= {name: [row for row in rows if row["bin"] == number] for number, name in enumerate(BIN_NAMES)}
    found |= {f"noise {noise:g} mm": [row for row in rows if row["noise_mm"] == noise] for noise in NOISES_MM}
    return found | {"outliers": [row for row in rows if row["outlier_share"] > 0.0]}


def _within(rows: Sequence[Row], limit: float) -> list[int]:
    return [int((np.asarray(row["squares"]) < limit).sum()) for row in rows]


def _correlation(predicted: FloatArray, actual: FloatArray) -> float | None:
    if len(predicted) < 3 or min(predicted.std(), actual.std()) == 0.0:
        return None
    return float(np.corrcoef(predicted, actual)[0, 1])
