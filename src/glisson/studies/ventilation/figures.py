"""The dissertation's Figures II.34, II.45 and II.46, drawn anew from the study's recordings."""

from collections.abc import Mapping, Sequence

import numpy as np

from glisson.core.status import Status
from glisson.core.tracks import Tracks
from glisson.framework.track_figures import draw_distance, draw_rates, draw_trajectories
from glisson.intraoperative.breathing.displacement import Displacement
from glisson.intraoperative.breathing.plateau import find_plateau
from glisson.navigation.figures.picture import Picture
from glisson.studies.point import Outcome, Point
from glisson.studies.ventilation.tasks import BREATHS, CONVENTIONAL, SHOWN_HZ, SWEEP


def draw_all(points: Sequence[Point], done: Mapping[str, Outcome]) -> dict[str, Picture]:
    """Figures by name, of the first recordings that are there; those from pixels where there are any."""
    shown: dict[str, Picture] = {}
    breaths = _first(points, done, BREATHS.function, "places")
    if breaths is not None:
        shown["figure-II.34"] = _distance(breaths)
    conventional, sweep = (
        _first(points, done, CONVENTIONAL.function, "values"),
        _first(points, done, SWEEP.function, None),
    )
    if conventional is not None and sweep is not None:
        shown["figure-II.45"] = _trajectories(conventional, sweep)
    if sweep is not None:
        shown["figure-II.46"] = _rates(sweep)
    return shown


def _first(points: Sequence[Point], done: Mapping[str, Outcome], function: str, array: str | None) -> Outcome | None:
    here = [p for p in points if p.task.function == function and p.key in done and done[p.key].arrays]
    here.sort(key=lambda point: point.inputs.get("noise_px") is not None)
    return done[here[0].key] if here and (array is None or array in done[here[0].key].arrays) else None


def _distance(breaths: Outcome) -> Picture:
    """Of the two markers whose distance changes most, among those that are seen nearly always."""
    places = breaths.arrays["places"]
    seen = np.isfinite(places[:, :, 0])
    often = np.flatnonzero(seen.mean(axis=0) > 0.9)
    apart = places[:, often, None] - places[:, None, often]
    change = np.nanmax(apart, axis=0) - np.nanmin(apart, axis=0)
    first, second = np.unravel_index(np.argmax(np.linalg.norm(change, axis=2)), change.shape[:2])
    tracks = Tracks(
        breaths.arrays["times"],
        np.where(seen[:, :, None], places, 0.0),
        np.zeros((*seen.shape, 2, 2)),
        np.where(seen, 0, 2).astype(np.int8),
        "mm",
    )
    return draw_distance(tracks, (int(often[first]), int(often[second])), breaths.arrays["exhalations"])


def _trajectories(conventional: Outcome, sweep: Outcome) -> Picture:
    named = [("conventional, 10 per minute", conventional.arrays["times"], conventional.arrays["values"])]
    named += [
        (
            f"high-frequency, {60.0 * rate:.0f} per minute",
            sweep.arrays[f"times {rate:g}"],
            sweep.arrays[f"values {rate:g}"],
        )
        for rate in SHOWN_HZ
    ]
    return draw_trajectories(named, "mm")


def _rates(sweep: Outcome) -> Picture:
    measured = [
        Displacement(
            row["rate_hz"], row["displacement_mm"], row["sigma_mm"], row["frames_per_s"], Status(row["status"])
        )
        for row in sweep.values["rows"][0]["displacements"]
    ]
    return draw_rates(measured, find_plateau(measured), "mm")
