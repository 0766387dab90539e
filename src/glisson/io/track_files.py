"""Tracks as comma-separated values, a line for each marker in each frame."""

import csv
from pathlib import Path

import numpy as np

from glisson.core.errors import BadInput
from glisson.core.tracks import PointState, Tracks
from glisson.io.atomic import atomic_path

_PLACES = ("u", "v", "var_u", "cov_uv", "var_v")


def write_tracks(path: str | Path, tracks: Tracks) -> None:
    """Write tracks; atomic. The names of columns have the unit, a lost marker has no place.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    unit = tracks.unit
    units = (unit, unit, f"{unit}2", f"{unit}2", f"{unit}2")
    header = ["time_s", "marker", "state", *(f"{name}_{of}" for name, of in zip(_PLACES, units, strict=True))]
    with atomic_path(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(header)
        for n, time in enumerate(tracks.times_s):
            for marker, state in enumerate(tracks.states[n]):
                place, spread = tracks.places[n, marker], tracks.covariance[n, marker]
                numbers = (*place, spread[0, 0], spread[0, 1], spread[1, 1])
                shown = [""] * 5 if state == PointState.LOST else [f"{number:.6g}" for number in numbers]
                writer.writerow([f"{time:.6f}", marker + 1, PointState(int(state)).name.lower(), *shown])


def read_tracks(path: str | Path) -> Tracks:
    """Read tracks.

    Raises:
        BadInput: absent, damaged, or without a line for each marker in each frame.
    """
    file = Path(path)
    try:
        with file.open(newline="", encoding="utf-8") as stream:
            rows = list(csv.DictReader(stream))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise BadInput(f"{file} cannot be read as tracks: {error}.") from error
    unit = "mm" if rows and "u_mm" in rows[0] else "px"
    names = [f"{name}_{unit}{'' if n < 2 else '2'}" for n, name in enumerate(_PLACES)]
    try:
        times = np.array([float(row["time_s"]) for row in rows])
        markers = np.array([int(row["marker"]) for row in rows])
        states = np.array([PointState[row["state"].upper()] for row in rows], dtype=np.int8)
        numbers = np.array([[float(row[name] or "nan") for name in names] for row in rows]).reshape(-1, 5)
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        raise BadInput(f"{file} is not a table of tracks as glisson track writes it ({error}).") from error
    frames, count = np.unique(times), int(markers.max(initial=0))
    if (
        len(rows) == 0
        or len(rows) != len(frames) * count
        or not (markers == np.tile(np.arange(count) + 1, len(frames))).all()
    ):
        raise BadInput(f"{file} does not have one line for each marker in each frame; it may have been cut short.")
    shape = (len(frames), count)
    covariance = numbers[:, [2, 3, 3, 4]].reshape(*shape, 2, 2)
    return Tracks(
        frames, numbers[:, :2].reshape(*shape, 2), covariance, states.reshape(shape), "mm" if unit == "mm" else "px"
    )
