"""The computations of the study: the noise that makes the construction as wrong as printed, and what both ways give."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

from glisson.core.errors import StageFailed
from glisson.core.protocols import SurfaceReconstructor
from glisson.core.views import ViewSet
from glisson.intraoperative.views.bundle import Bundle
from glisson.intraoperative.views.construction import Construction
from glisson.intraoperative.views.parameters import ReconstructionParameters
from glisson.phantom.half_sphere_box import LANDMARKS_MM, POSITIONS_DEG
from glisson.phantom.measured_views import TROCAR, ViewNoise, breathed, measured_views
from glisson.studies.point import Outcome, Task
from glisson.studies.surface.printed import PRINTED_MM

_PACKAGES = (
    "glisson.core", "glisson.intraoperative.cameras.projection", "glisson.intraoperative.views",
    "glisson.phantom.half_sphere_box", "glisson.phantom.laparoscope_view",
    "glisson.phantom.measured_views", "glisson.phantom.optics", "glisson.studies.surface.printed", __name__,
)  # fmt: skip

FIT = Task(f"{__name__}:fit_noise", _PACKAGES)
RECONSTRUCT = Task(f"{__name__}:reconstruct_views", _PACKAGES)

PAIRS = {"1-2": 1, "1-3": 2, "1-4": 3}
"""Pairs of positions, by the second."""

BREATHING = {"half": 0.069, "full": 0.007}
"""Share of its pixel coordinates by which the surface moves in position 4's picture."""

TEN = "ten views"
_TEN_DEG = tuple(float(angle) for angle in np.linspace(0.0, POSITIONS_DEG[-1], 10))
"""Over the same arc as pair 1-4, so that they have no more parallax."""

_WITHIN = float(chi2.ppf(0.9, 3))
_FIT_ROUNDS = 6
TUNING = 1_000_000
"""Stream of random numbers of the fit; no --seed of a person is likely to be it."""

NO_LIMIT = ReconstructionParameters(worst_mm=1e6, doubtful_mm=1e6)
"""The study asks how wrong points are, also where a user would be refused."""


def fit_noise(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """The factor on the trocar's stated noise with which the construction's mean error at pair 1-2 is the printed one.

    The mean is over `seeds` draws of the six points' mean error; the same draws each round, so the secant converges.
    """
    tried: list[tuple[float, float]] = []
    factor = 0.1
    for _ in range(_FIT_ROUNDS):
        errors = [
            np.mean(scored(Construction(NO_LIMIT), _pair("1-2", TROCAR.times(factor), (TUNING, seed)))["errors_mm"])
            for seed in range(inputs["seeds"])
        ]
        tried.append((factor, float(np.mean(errors))))
        if abs(tried[-1][1] / PRINTED_MM["1-2"] - 1.0) < 0.002:
            break
        factor = _secant(tried, PRINTED_MM["1-2"])
    best = min(tried, key=lambda one: abs(one[1] - PRINTED_MM["1-2"]))
    return Outcome({"factor": best[0], "mean_mm": best[1], "noise": asdict(TROCAR.times(best[0]))})


def reconstruct_views(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """A row for each draw, each of the `names` of views, and each way."""
    noise = ViewNoise(**inputs["noise"])
    rows = []
    for seed in range(inputs["first"], inputs["first"] + inputs["seeds"]):
        for name in inputs["names"]:
            views = _views(name, noise, (inputs["stream"], seed))
            ways: Sequence[SurfaceReconstructor] = [Bundle(NO_LIMIT), Construction(NO_LIMIT)]
            rows += [{"seed": seed, "views": name} | scored(way, views) for way in ways[: 1 if name == TEN else 2]]
    return Outcome({"rows": rows})


def scored(way: SurfaceReconstructor, views: ViewSet) -> dict[str, Any]:
    """Errors of the six points, which truths lie in the 90 % ellipsoids, and whether it was flagged.

    `refused` says whether a user would have been refused; errors are None where nothing could be computed.
    """
    row: dict[str, Any] = {"way": way.name, "errors_mm": None, "inside": None, "flagged": True, "refused": True}
    try:
        found = way.reconstruct(views)
    except StageFailed:
        return row
    items = [item for item in found.observations.items if item.kind == "landmark"]
    off = np.concatenate([item.points_mm for item in items]) - LANDMARKS_MM
    covariance = np.concatenate([item.covariance_mm2 for item in items if item.covariance_mm2 is not None])
    inside = (off * np.linalg.solve(covariance, off[:, :, None])[:, :, 0]).sum(axis=1) <= _WITHIN
    longest = float(np.sqrt(np.median(np.linalg.eigvalsh(covariance)[:, -1])))
    return row | {
        "errors_mm": np.linalg.norm(off, axis=1).round(4).tolist(),
        "inside": [int(one) for one in inside],
        "flagged": not found.status.is_good,
        "refused": longest > ReconstructionParameters().worst_mm,
    }


def _views(name: str, noise: ViewNoise, seed: tuple[int, int]) -> ViewSet:
    if name in BREATHING:
        return breathed(_pair("1-4", noise, seed), BREATHING[name])
    return _pair(name, noise, seed) if name in PAIRS else measured_views(_TEN_DEG, noise, np.random.default_rng(seed))


def _pair(name: str, noise: ViewNoise, seed: tuple[int, int]) -> ViewSet:
    return measured_views((POSITIONS_DEG[0], POSITIONS_DEG[PAIRS[name]]), noise, np.random.default_rng(seed))


def _secant(tried: Sequence[tuple[float, float]], wanted: float) -> float:
    (factor, mean) = tried[-1]
    if len(tried) == 1:
        return factor * wanted / mean
    before, mean_before = tried[-2]
    return factor + (wanted - mean) * (factor - before) / (mean - mean_before)
