"""A video of a trocar's camera, from beginning to end: which instrument was in use when, and where its tip was."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from glisson.core.errors import BadInput, StageFailed
from glisson.core.instruments import SeenInstrument
from glisson.core.localisation import Localisation
from glisson.core.protocols import InstrumentRecogniser, Localiser, Progress, silent
from glisson.core.registry import make_technique
from glisson.core.tip_track import TipTrack
from glisson.framework.instrument_figure import draw_timeline
from glisson.framework.instruments import BY_CROSSES, BY_WHEEL, checked_library
from glisson.intraoperative.instruments.timeline import Use, uses
from glisson.io.instrument_files import read_trocar
from glisson.io.layout_files import read_layout
from glisson.io.pictures import write_picture
from glisson.io.records import write_json
from glisson.io.tip_files import write_tips
from glisson.io.video import open_video

TIMELINE, PICTURE, TIPS = "timeline.json", "timeline.png", "tips.json"


@dataclass(frozen=True)
class Timeline:
    """Uses, number of frames looked at and of those with an instrument, why the others have none, and what is odd."""

    uses: tuple[Use, ...]
    frames: int
    recognised: int
    reasons: dict[str, int]
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Sighting:
    time_s: float
    seen: SeenInstrument
    place: Localisation | None


def timeline_of_video(
    video: str | Path,
    trocar: str | Path,
    out: str | Path,
    library: str | Path | None = None,
    layout: str | Path | None = None,
    every: int = 1,
    gap_s: float = 1.0,
    progress: Progress = silent,
) -> Timeline:
    """Look at a video frame by frame and write `timeline.json`, `timeline.png` and `tips.json` into a folder.

    Args:
        video: of the trocar's camera.
        trocar: its `trocar.toml`.
        out: the folder.
        library: `instruments.toml`; by default the one that comes with Glisson.
        layout: of crosses that the video shows, too: tips are then in the room, as far as the trocar's place is known.
        every: look at one frame of so many.
        gap_s: an instrument that is not seen for longer was taken out.
        progress: told how far it is.

    Raises:
        BadInput: a file cannot be used, or they do not belong together.
        WriteFailed: the disk is full.
    """
    through, known = read_trocar(trocar), checked_library(library)
    crosses = None if layout is None else read_layout(layout)
    recogniser: InstrumentRecogniser = make_technique("instrument-recogniser", BY_WHEEL, {}, "--technique")
    localiser: Localiser = make_technique("localiser", BY_CROSSES, {}, "--technique")
    times: list[float] = []
    sightings: list[_Sighting | None] = []
    reasons: dict[str, int] = {}
    with open_video(video, progress) as opened:
        for number, frame in enumerate(opened):
            if number % every:
                continue
            sighting = None
            try:
                seen = recogniser.recognise(frame.image, through, known)
                place = None if crosses is None else localiser.localise(frame.image, through.camera, crosses)
                sighting = _Sighting(frame.time_s, seen, place)
            except StageFailed as failure:
                reasons[failure.status] = reasons.get(failure.status, 0) + 1
            times.append(frame.time_s)
            sightings.append(sighting)
        notes = () if opened.early_end is None else (opened.early_end,)
    if not times:
        raise BadInput(f"{video} has no frame that can be read.")
    found = uses(times, [None if one is None else one.seen.instrument.name for one in sightings], gap_s)
    told = Timeline(found, len(times), len(sightings) - sightings.count(None), reasons, notes)
    _write(Path(out), told, times[-1], [one for one in sightings if one is not None], crosses is not None)
    return told


def _write(folder: Path, told: Timeline, end_s: float, sightings: list[_Sighting], in_room: bool) -> None:
    rows = [{"instrument": use.instrument, "from_s": use.from_s, "to_s": use.to_s, "frames": use.frames}
            for use in told.uses]  # fmt: skip
    write_json(folder / TIMELINE, {"schema": 1, "uses": rows, "frames": told.frames, "recognised": told.recognised})
    write_picture(folder / PICTURE, draw_timeline(told.uses, end_s))
    names = dict.fromkeys(use.instrument for use in told.uses)
    write_tips(folder / TIPS, [_track(name, sightings, in_room) for name in names])


def _track(name: str, sightings: list[_Sighting], in_room: bool) -> TipTrack:
    """The tips of an instrument; in the room only where the trocar's place is sure."""
    times, points, covariances = [], [], []
    for one in sightings:
        point, covariance = one.seen.tip_mm, one.seen.tip_covariance_mm2
        if in_room:
            room_from_trocar = None if one.place is None else one.place.room_from_trocar
            if one.place is None or not one.place.status.is_good or room_from_trocar is None:
                continue
            covariance = room_from_trocar.point_covariance(point, covariance)
            point = room_from_trocar.apply(point)
        if one.seen.instrument.name == name:
            times.append(one.time_s)
            points.append(point)
            covariances.append(covariance)
    frame = "room" if in_room else "trocar"
    return TipTrack(name, frame, np.array(times), np.reshape(points, (-1, 3)), np.reshape(covariances, (-1, 3, 3)))
