"""`glisson track`: markers followed through a laparoscope's video."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.options import pixel_from_text, positive_from_text
from glisson.cli.progress import StageLines
from glisson.core.errors import BadInput
from glisson.core.status import Status
from glisson.core.tracks import PointState, Tracks
from glisson.framework.track_figures import draw_tracks
from glisson.framework.tracking import FINDERS, MOST, TECHNIQUE, TrackedVideo, track_video
from glisson.intraoperative.tracks.millimetres import at_distance, scaled
from glisson.io.atomic import atomic_path
from glisson.io.camera_files import read_camera
from glisson.io.track_files import write_tracks
from glisson.studies.page import png

TRACKS, PICTURE = ".tracks.csv", ".tracks.png"
"""What follows the name of the video in those of its files."""

_KEYS = (
    "status", "message", "frames", "seconds_of_video", "markers", "unit", "frames_per_s", "following_per_s", "notes",
    "file", "picture", "seconds",
)  # fmt: skip


def add_marker_options(parser: argparse.ArgumentParser) -> None:
    """Which markers are followed."""
    parser.add_argument(
        "--at",
        metavar="U,V",
        action="append",
        type=pixel_from_text,
        help="a marker's place in the first frame, px; may be repeated",
    )
    parser.add_argument("--find", choices=tuple(FINDERS), default="spots", help="what is looked for without --at")
    parser.add_argument("--count", metavar="N", help=f"how many of these (default: up to {MOST})")
    parser.add_argument("--technique", metavar="NAME", default=TECHNIQUE, help=f"see glisson techniques; {TECHNIQUE}")
    parser.add_argument("--mm-per-px", metavar="MM", help="size of a pixel at the tissue; tracks are in mm then")
    parser.add_argument("--camera", metavar="FILE", help="the scope's camera.toml: mm without distortion")
    parser.add_argument("--distance-mm", metavar="MM", help="how far the tissue is before that camera")


def unit_of(arguments: argparse.Namespace) -> Callable[[Tracks], Tracks]:
    """What brings tracks to mm where the options say how; else leaves them as they are."""
    if (arguments.camera is None) != (arguments.distance_mm is None):
        raise BadInput("--camera and --distance-mm belong together.")
    if arguments.camera is not None and arguments.mm_per_px is not None:
        raise BadInput("Give --mm-per-px, or --camera and --distance-mm, not both.")
    if arguments.camera is not None:
        camera, distance = read_camera(arguments.camera), positive_from_text(arguments.distance_mm, "--distance-mm")
        return lambda tracks: at_distance(tracks, camera, distance)
    if arguments.mm_per_px is not None:
        scale = positive_from_text(arguments.mm_per_px, "--mm-per-px")
        return lambda tracks: scaled(tracks, scale)
    return lambda tracks: tracks


def followed(video: str, arguments: argparse.Namespace, lines: StageLines) -> TrackedVideo:
    """The markers of a video by these options, in px."""
    if arguments.at and arguments.count:
        raise BadInput("--count is for markers that are looked for; give it without --at.")
    count = None if arguments.count is None else max(round(positive_from_text(arguments.count, "--count")), 1)
    places = np.array(arguments.at) if arguments.at else None
    progress = lines.begun("track", f"{video} is a video")
    camera = None if arguments.camera is None else read_camera(arguments.camera)
    tracked = track_video(video, places, arguments.find, count, arguments.technique, camera, progress)
    lines.ended("track", len(tracked.tracks.times_s) / tracked.frames_per_s)
    return tracked


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("video", metavar="VIDEO", help="a video file")
    add_marker_options(parser)
    parser.add_argument("--out", metavar="DIR", help="where tracks and picture go (default: beside the video)")


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    in_unit = unit_of(arguments)
    tracked = followed(arguments.video, arguments, lines)
    tracks = in_unit(tracked.tracks)
    video = Path(arguments.video)
    out = Path(arguments.out) if arguments.out else video.parent
    file, picture = out / f"{video.stem}{TRACKS}", out / f"{video.stem}{PICTURE}"
    write_tracks(file, tracks)
    with atomic_path(picture) as temporary:
        temporary.write_bytes(png(draw_tracks(tracked.tracks, tracked.first)))
    markers = _markers(tracked)
    values: dict[str, Any] = {
        "status": Status.CONVERGED, "message": Status.CONVERGED.sentence, "frames": len(tracks.times_s),
        "seconds_of_video": float(tracks.times_s[-1]), "markers": markers, "unit": tracks.unit,
        "frames_per_s": tracked.frames_per_s, "following_per_s": tracked.following_per_s,
        "notes": list(tracked.notes), "file": str(file), "picture": str(picture),
        "seconds": len(tracks.times_s) / tracked.frames_per_s,
    }  # fmt: skip
    whole = sum(marker["seen"] == 1.0 for marker in markers)
    text = [
        f"markers   {len(markers)}, {whole} of them seen in all of {len(tracks.times_s)} frames",
        f"speed     {tracked.frames_per_s:.0f} frames per second; {tracked.following_per_s:.0f} without decoding",
        *(f"look at   {note}" for note in tracked.notes),
        f"written   {file} and {picture}",
    ]
    return Answer(values, "\n".join(text))


def _markers(tracked: TrackedVideo) -> list[dict[str, Any]]:
    tracks = tracked.tracks
    sigma = np.sqrt(np.trace(tracks.covariance, axis1=2, axis2=3) / 2.0)
    return [
        {
            "marker": n + 1,
            "first_px": tracks.places[0, n].tolist(),
            "seen": float(tracks.seen[:, n].mean()),
            "lost_times": int((tracks.states[:, n] == PointState.FOUND_AGAIN).sum()),
            "sigma_px": float(np.nanmedian(sigma[:, n])),
        }
        for n in range(tracks.states.shape[1])
    ]


COMMAND = Command(
    "track",
    "  glisson track liver.mp4\n"
    "  glisson track liver.mp4 --at 312,200 --at 460,188 --mm-per-px 0.14 --out tracks --json\n"
    "  glisson track liver.mp4 --camera camera.toml --distance-mm 90\n"
    "  glisson track liver.mp4 --find corners --count 40",
    _add_arguments,
    _run,
    _KEYS,
)
