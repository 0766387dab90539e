"""The computations of the study: recordings made, markers followed or simulated, and answers held against the truth."""

import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.tracks import Tracks
from glisson.framework.tracking import TrackedVideo, track_video
from glisson.intraoperative.breathing.cycles import find_cycles
from glisson.intraoperative.breathing.displacement import Displacement, displacement_at
from glisson.intraoperative.breathing.motion_model import fit_breathing
from glisson.intraoperative.breathing.plateau import find_plateau
from glisson.intraoperative.tracks.millimetres import at_distance
from glisson.io.video import write_video
from glisson.phantom.breathing.view import BreathingVideo
from glisson.studies.point import Outcome, Task
from glisson.studies.ventilation.recordings import (
    EXCURSION_MM,
    RATES_HZ,
    Sweep,
    breaths_of,
    breaths_video,
    conventional_video,
    distance_mm,
    draw_sweep,
    sweep_tissue,
    sweep_video,
    true_mm,
)

_SOURCE = (
    "glisson.core", "glisson.intraoperative", "glisson.phantom.breathing", "glisson.phantom.optics",
    "glisson.phantom.photograph", "glisson.framework.tracking", "glisson.io.video",
    "glisson.studies.ventilation.recordings", __name__,
)  # fmt: skip

MARKS, FEW_MARKS = 20, 8
"""Marks of a rendered video, and of simulated tracks."""

SHOWN_HZ = (4.0, 12.0)
"""Rates of which a marker's way is shown."""

BINS = 20


def measure_noise(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """`noise_px`: standard deviation of each coordinate of a followed marker about its truth, in a rendered video."""
    video = sweep_video(
        draw_sweep(inputs["seed"], first=True), sweep_tissue(inputs["seed"], MARKS), 0, inputs["seed"], True
    )
    tracked = _followed(video)
    off, _ = _off_truth(tracked.tracks, video.marks_px())
    steady = off - np.nanmedian(off, axis=0)
    return Outcome({"noise_px": float(1.4826 * np.nanmedian(np.abs(steady))), "frames_per_s": tracked.frames_per_s})


def sweep_rates(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """`rows`: what is found of each sweep; arrays of a marker's way at the slowest and a fast rate of the `first` seed.

    `noise_px` is of simulated tracks; None: videos are rendered and followed.
    """
    rows: list[dict[str, Any]] = []
    arrays: dict[str, NDArray[Any]] = {}
    for seed in inputs["seeds"]:
        is_first = seed == inputs["first"]
        row, ways = _swept(draw_sweep(seed, is_first), seed, inputs["noise_px"])
        rows.append({"seed": seed, **row})
        arrays = ways if is_first else arrays
    return Outcome({"rows": rows}, arrays)


def tell_breaths(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """`rows`: errors of phase and residuals of irregular breaths; arrays: the tracks of the last one."""
    rows: list[dict[str, Any]] = []
    arrays: dict[str, NDArray[Any]] = {}
    marks = MARKS if inputs["noise_px"] is None else FEW_MARKS
    for seed in inputs["seeds"]:
        video = breaths_video(seed, EXCURSION_MM, inputs["duration_s"], inputs["frames_per_s"], marks)
        tracks, truth = _tracks_of(video, inputs["noise_px"], 1, seed)
        try:
            row, arrays = _breaths_row(video, tracks, truth)
        except StageFailed as error:
            row = {
                "message": str(error),
                "breaths": 0,
                "phase_worst": None,
                "residual_mm": None,
                "residual_worst_mm": None,
            }
        rows.append({"seed": seed, **row})
    return Outcome({"rows": rows}, arrays)


def conventional(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """`displacement_mm` of a conventional ventilator, from a rendered video; arrays: `times`, `values` of a marker."""
    video = conventional_video(inputs["seed"], inputs["duration_s"], inputs["frames_per_s"])
    tracks = _in_mm(video, _followed(video).tracks)
    model = fit_breathing(tracks, find_cycles(tracks))
    excursions = model.excursions()
    known = np.flatnonzero(np.isfinite(excursions))
    marker = int(known[np.argmax(tracks.seen[:, known].mean(axis=0))])
    return Outcome(
        {"displacement_mm": float(excursions[known].mean()), "spread_mm": float(excursions[known].std())},
        {"times": tracks.times_s, "values": _along(tracks.places[:, marker])},
    )


MEASURE = Task(f"{__name__}:measure_noise", _SOURCE)
SWEEP = Task(f"{__name__}:sweep_rates", _SOURCE)
BREATHS = Task(f"{__name__}:tell_breaths", _SOURCE)
CONVENTIONAL = Task(f"{__name__}:conventional", _SOURCE)


def _swept(sweep: Sweep, seed: int, noise_px: float | None) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    tissue = sweep_tissue(seed, MARKS if noise_px is None else FEW_MARKS)
    found: list[Displacement] = []
    ways: dict[str, NDArray[Any]] = {}
    for number, rate in enumerate(RATES_HZ):
        video = sweep_video(sweep, tissue, number, seed, noise_px is None)
        tracks, _ = _tracks_of(video, noise_px, sweep.repeats, seed + number)
        tracks = _in_mm(video, tracks)
        found.append(displacement_at(tracks, float(rate), sweep.told_exposure_s))
        if rate in SHOWN_HZ and tracks.seen.any():
            marker = int(np.argmax(tracks.seen.mean(axis=0)))
            ways |= {f"times {rate:g}": tracks.times_s, f"values {rate:g}": _along(tracks.places[:, marker])}
    plateau = find_plateau(found)
    interval = plateau.interval_hz
    flagged = [not d.status.is_good for d in found]
    return {
        "true": sweep.break_hz, "found": plateau.rate_hz, "interval": interval, "status": plateau.status,
        "message": plateau.sentence, "resolvable": sweep.is_resolvable,
        "frames_per_s": sweep.camera_frames_per_s, "exposure_ms": 1e3 * sweep.exposure_s, "repeats": sweep.repeats,
        "rates_resolvable": sum(sweep.resolvable),
        "false_flags": sum(f and good for f, good in zip(flagged, sweep.resolvable, strict=True)),
        "missed_flags": sum(not f and not good for f, good in zip(flagged, sweep.resolvable, strict=True)),
        "displacements": [_measured(d) for d in found],
        "true_mm": list(sweep.displacements_mm),
    }, ways  # fmt: skip


def _measured(found: Displacement) -> dict[str, Any]:
    return {
        "rate_hz": found.rate_hz, "displacement_mm": found.value if np.isfinite(found.value) else None,
        "sigma_mm": found.sigma if np.isfinite(found.sigma) else None, "status": found.status,
        "frames_per_s": found.frames_per_s,
    }  # fmt: skip


def _breaths_row(
    video: BreathingVideo, tracks: Tracks, truth: FloatArray
) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    tracks = _in_mm(video, tracks)
    cycles = find_cycles(tracks)
    model = fit_breathing(tracks, cycles)
    inside = np.isfinite(cycles.phase)
    apart = cycles.phase[inside] - breaths_of(video).phase(video.times_s)[inside]
    phase = np.abs((apart + 0.5) % 1.0 - 0.5)
    predicted = model.drift(tracks.times_s) + model.breathing(tracks.times_s)
    off = np.linalg.norm(predicted - true_mm(video, truth), axis=2)[inside]
    known = np.isfinite(off).all(axis=0)
    bins = (BINS * (cycles.phase[inside] % 1.0)).astype(int)
    by_phase = [float(np.sqrt((off[bins == n][:, known] ** 2).mean())) for n in range(BINS) if (bins == n).any()]
    return {
        "message": "", "breaths": len(cycles.depths), "markers": int(known.sum()),
        "phase_median": float(np.median(phase)), "phase_worst": float(phase.max()),
        "residual_mm": max(by_phase), "residual_worst_mm": float(off[:, known].max()),
        "displacement_mm": float(model.excursions()[known].mean()),
    }, {
        "times": tracks.times_s, "places": tracks.places, "exhalations": cycles.exhalations_s,
    }  # fmt: skip


def _tracks_of(video: BreathingVideo, noise_px: float | None, repeats: int, seed: int) -> tuple[Tracks, FloatArray]:
    """Tracks (px) followed in the rendered video, or its truth with noise; and the truth of the same markers."""
    truth = video.marks_px()
    if noise_px is None:
        tracks = _followed(video, repeats).tracks
        off, number = _off_truth(tracks, np.repeat(truth, repeats, axis=0))
        return tracks, np.repeat(truth, repeats, axis=0)[:, number] + np.nanmedian(off, axis=0)
    random = np.random.default_rng([seed, 67])
    places = np.repeat(truth + noise_px * random.standard_normal(truth.shape), repeats, axis=0)
    states = np.zeros(places.shape[:2], dtype=np.int8)
    states[~np.repeat(video.marks_visible(), repeats, axis=0)] = 2
    times = np.arange(len(places)) / (repeats * video.shutter.frames_per_s)
    covariance = np.broadcast_to(noise_px**2 * np.eye(2), (*places.shape, 2))
    return Tracks(times, places, covariance, states), np.repeat(truth, repeats, axis=0)


def _in_mm(video: BreathingVideo, tracks: Tracks) -> Tracks:
    return at_distance(tracks, video.camera, distance_mm(video))


def _followed(video: BreathingVideo, repeats: int = 1) -> TrackedVideo:
    """The video written to a file, read again, and its marks found and followed."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "video.avi"
        write_video(path, _repeated(video, repeats), repeats * video.shutter.frames_per_s)
        return track_video(path)


def _repeated(video: BreathingVideo, repeats: int) -> Iterator[NDArray[np.uint8]]:
    for image in video.images():
        for _ in range(repeats):
            yield image


def _off_truth(tracks: Tracks, truth: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
    """Places (n, m, 2) less those of the true marks, and the numbers (m,) of these.

    Raises:
        StageFailed: what is followed is no mark.
    """
    apart = np.linalg.norm(tracks.places[0][:, None] - truth[0][None], axis=2)
    number = np.argmin(apart, axis=1)
    return tracks.places - truth[:, number], number


def _along(places: FloatArray) -> FloatArray:
    """Displacement (n,) of a marker along its main way, from its least."""
    seen = np.isfinite(places[:, 0])
    centred = places - places[seen].mean(axis=0)
    way = np.linalg.svd(centred[seen], full_matrices=False)[2][0]
    values = centred @ way
    turned = values if np.nanmedian(values) < 0.5 * (np.nanmin(values) + np.nanmax(values)) else -values
    return np.asarray(turned - np.nanmin(turned))
