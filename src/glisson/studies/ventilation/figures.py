"""The dissertation's Figures II.34, II.45 and II.46, drawn anew from the study's recordings."""

from collections.abc import Mapping, Sequence

import numpy as np

from glisson.core.status import Status
from glisson.core.tracks import PointState, Tracks
from glisson.framework.track_figures import draw_moves, draw_rates, draw_trajectories
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
        shown["figure-II.34"] = _moves(breaths)
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


def _moves(breaths: Outcome) -> Picture:
    """Of the marker that is seen most."""
    places = breaths.arrays["places"]
    seen = np.isfinite(places[:, :, 0])
    states = np.where(seen, PointState.FOLLOWED, PointState.LOST).astype(np.int8)
    tracks = Tracks(breaths.arrays["times"], places, np.zeros((*seen.shape, 2, 2)), states, "mm")
    return draw_moves(tracks, int(np.argmax(seen.sum(axis=0))), breaths.arrays["exhalations"])


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
