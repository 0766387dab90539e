"""`glisson breathing`: breaths in the motion of markers; or the displacement at several rates of ventilation."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.options import positive_from_text
from glisson.cli.progress import StageLines
from glisson.cli.track import TRACKS, add_marker_options, followed, unit_of
from glisson.core.errors import BadInput
from glisson.core.status import Status
from glisson.core.tracks import Tracks
from glisson.framework.track_figures import draw_breathing, draw_rates
from glisson.intraoperative.breathing.cycles import Cycles, find_cycles
from glisson.intraoperative.breathing.displacement import Displacement, displacement_at
from glisson.intraoperative.breathing.motion_model import BreathingModel, fit_breathing
from glisson.intraoperative.breathing.plateau import find_plateau
from glisson.io.atomic import atomic_path
from glisson.io.track_files import read_tracks
from glisson.navigation.figures.picture import Picture
from glisson.studies.page import png

PICTURE = ".breathing.png"
"""What follows the name of the (first) recording in that of the picture."""
_WITHIN = {"px": 7.0, "mm": 1.0}
"""Frames in which breathing has moved every marker by no more than this are let through, without --within."""

_KEYS = (
    "status", "message", "unit", "breaths", "rate_per_minute", "exhalations_s", "inhalations_s", "exhalation_frames",
    "inhalation_frames", "inhalation_phase", "markers", "displacement", "displacement_spread", "gate_frames",
    "rates", "plateau_hz", "interval_hz", "notes", "picture",
)  # fmt: skip


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("recording", metavar="VIDEO|TRACKS", nargs="+", help="a video, or the .csv of glisson track")
    add_marker_options(parser)
    parser.add_argument(
        "--exhaled-at", metavar="S", type=float, help="a moment (s) of exhalation, where it can't be told otherwise"
    )
    parser.add_argument("--within", metavar="LENGTH", help="frames with less breathing than this are used (1 mm, 7 px)")
    parser.add_argument(
        "--rate-hz", metavar="HZ", action="append",
        help="the ventilator's rate, once for each recording: displacement against rate is told then",
    )  # fmt: skip
    parser.add_argument("--exposure-ms", metavar="MS", help="the camera's exposure (default: half of a frame's time)")
    parser.add_argument("--out", metavar="DIR", help="where the picture goes (default: beside the recording)")


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    rates = [positive_from_text(text, "--rate-hz") for text in arguments.rate_hz or ()]
    if rates and len(rates) != len(arguments.recording):
        raise BadInput(
            f"There are {len(arguments.recording)} recordings and {len(rates)} of --rate-hz; give one for each."
        )
    if not rates and len(arguments.recording) > 1:
        raise BadInput("Several recordings are compared by their rates; give --rate-hz for each.")
    in_unit = unit_of(arguments)
    recordings = [_tracks(path, arguments, lines) for path in arguments.recording]
    notes = [note for _, found in recordings for note in found]
    tracks = [in_unit(made) for made, _ in recordings]
    first = Path(arguments.recording[0])
    out = Path(arguments.out) if arguments.out else first.parent
    picture = out / f"{first.name.removesuffix(TRACKS).removesuffix(first.suffix)}{PICTURE}"
    if rates:
        return _by_rate(tracks, rates, arguments, notes, picture)
    return _by_breath(tracks[0], arguments, notes, picture)


def _tracks(path: str, arguments: argparse.Namespace, lines: StageLines) -> tuple[Tracks, tuple[str, ...]]:
    if Path(path).suffix == ".csv":
        tracks, notes = read_tracks(path), tuple[str, ...]()
    else:
        tracked = followed(path, arguments, lines)
        tracks, notes = tracked.tracks, tracked.notes
    return tracks, notes


def _by_breath(tracks: Tracks, arguments: argparse.Namespace, notes: Sequence[str], picture: Path) -> Answer:
    within = positive_from_text(arguments.within or str(_WITHIN[tracks.unit]), "--within")
    cycles = find_cycles(tracks, arguments.exhaled_at)
    model = fit_breathing(tracks, cycles)
    gate = np.flatnonzero(model.gate(tracks.times_s, within))
    excursions = model.excursions()
    known = np.flatnonzero(np.isfinite(excursions))
    widest = int(known[np.argmax(excursions[known])])
    _keep(draw_breathing(tracks, cycles, model, widest), picture)
    notes = [*notes, *cycles.notes]
    mean, spread = float(excursions[known].mean()), _spread(cycles, excursions[known])
    values = dict.fromkeys(_KEYS) | {
        "status": Status.AMBIGUOUS if cycles.notes else Status.CONVERGED,
        "message": cycles.notes[0] if cycles.notes else Status.CONVERGED.sentence,
        "unit": tracks.unit, "breaths": len(cycles.depths), "rate_per_minute": cycles.rate_per_minute,
        "exhalations_s": cycles.exhalations_s.tolist(), "inhalations_s": cycles.inhalations_s.tolist(),
        "exhalation_frames": _nearest(tracks, cycles.exhalations_s),
        "inhalation_frames": _nearest(tracks, cycles.inhalations_s), "inhalation_phase": cycles.inhalation_phase,
        "markers": _markers(model), "displacement": mean, "displacement_spread": spread,
        "gate_frames": gate.tolist(), "notes": notes, "picture": str(picture),
    }  # fmt: skip
    left = float(np.sqrt(np.nanmean(np.trace(model.covariance, axis1=1, axis2=2))))
    text = [
        f"breaths   {len(cycles.depths)}, {cycles.rate_per_minute:.1f} per minute",
        f"moves     {mean:.1f} ± {spread:.1f} {tracks.unit} from full exhalation to full inhalation",
        f"left      {left:.2f} {tracks.unit} (root mean square) once breathing and drift are taken away",
        f"frames    {len(gate)} of {len(tracks.times_s)} lie within {within:g} {tracks.unit} of full exhalation",
        *(f"look at   {note}" for note in notes),
        f"picture   {picture}",
    ]
    return Answer(values, "\n".join(text), 1 if cycles.notes else 0)


def _by_rate(
    tracks: Sequence[Tracks], rates: Sequence[float], arguments: argparse.Namespace, notes: Sequence[str], picture: Path
) -> Answer:
    exposure = None
    if arguments.exposure_ms is not None:
        exposure = 1e-3 * positive_from_text(arguments.exposure_ms, "--exposure-ms")
    if len({recording.unit for recording in tracks}) > 1:
        raise BadInput("Some recordings are in px and some in mm; bring them to one unit.")
    found = [displacement_at(recording, rate, exposure) for recording, rate in zip(tracks, rates, strict=True)]
    plateau = find_plateau(found)
    _keep(draw_rates(found, plateau, tracks[0].unit), picture)
    values = dict.fromkeys(_KEYS) | {
        "status": plateau.status, "message": plateau.sentence, "unit": tracks[0].unit,
        "rates": [_rate(displacement) for displacement in found],
        "plateau_hz": plateau.rate_hz, "interval_hz": plateau.interval_hz, "displacement": plateau.displacement,
        "notes": list(notes), "picture": str(picture),
    }  # fmt: skip
    text = [_rate_line(displacement, tracks[0].unit) for displacement in found]
    text += [f"plateau   {plateau.sentence}", *(f"look at   {note}" for note in notes), f"picture   {picture}"]
    return Answer(values, "\n".join(text), 0 if plateau.status.is_good else 1)


def _rate(found: Displacement) -> dict[str, Any]:
    return {
        "rate_hz": found.rate_hz, "displacement": _number(found.value), "sigma": _number(found.sigma),
        "frames_per_s": found.frames_per_s, "status": found.status, "reasons": list(found.reasons),
    }  # fmt: skip


def _rate_line(found: Displacement, unit: str) -> str:
    if found.status.is_good:
        return f"{found.rate_hz:6.2f} Hz {found.value:.3f} ± {found.sigma:.3f} {unit}"
    return f"{found.rate_hz:6.2f} Hz not resolved: {' '.join(found.reasons)}"


def _markers(model: BreathingModel) -> list[dict[str, Any]]:
    """Each marker's excursion and what the model leaves; null for one that was lost too often."""
    left = np.sqrt(np.trace(model.covariance, axis1=1, axis2=2))
    return [
        {"marker": n + 1, "displacement": _number(excursion), "left": _number(left[n]),
         "covariance": model.covariance[n].tolist() if np.isfinite(excursion) else None}
        for n, excursion in enumerate(model.excursions())
    ]  # fmt: skip


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _spread(cycles: Cycles, excursions: Any) -> float:
    """Standard deviation over all breaths and markers."""
    return float(np.outer(cycles.depths, excursions).std())


def _nearest(tracks: Tracks, moments: Any) -> list[int]:
    return [int(np.argmin(np.abs(tracks.times_s - moment))) for moment in moments]


def _keep(shown: Picture, path: Path) -> None:
    with atomic_path(path) as temporary:
        temporary.write_bytes(png(shown))


COMMAND = Command(
    "breathing",
    "  glisson breathing liver.mp4 --mm-per-px 0.14\n"
    "  glisson breathing liver.tracks.csv --exhaled-at 3.2 --json\n"
    "  glisson breathing slow.mp4 fast.mp4 … --rate-hz 4 --rate-hz 4.5 … --exposure-ms 8",
    _add_arguments,
    _run,
    _KEYS,
)
