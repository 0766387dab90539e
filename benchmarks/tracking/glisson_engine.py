"""Glisson's tracker with its defaults: `python glisson_engine.py VIDEO OUT`."""

from itertools import islice
from pathlib import Path

import numpy as np
from adapter import Places, run

import glisson
from glisson.intraoperative.tracks.lucas_kanade import LucasKanade, LucasKanadeParameters
from glisson.io.video import open_video


def follow(path: Path, marks: Places, most: int | None) -> Places:
    """Followed, checked against the first frame, and found again."""
    with open_video(path) as video:
        frames = ((frame.time_s, frame.image) for frame in islice(video, most))
        return np.asarray(LucasKanade(LucasKanadeParameters()).track(frames, marks).places)


if __name__ == "__main__":
    run(glisson.__version__, follow)
