"""The video of the benchmark: `python meshes.py COUNT frames OUT`; beside OUT, with marks and truth, lies the .avi."""

import sys
from pathlib import Path

import numpy as np

from glisson.core.camera import Camera
from glisson.io.atomic import atomic_path
from glisson.io.video import write_video
from glisson.phantom.breathing.exposing import Shutter
from glisson.phantom.breathing.motion import Irregularity, draw_breaths
from glisson.phantom.breathing.occluders import draw_glare, draw_passing
from glisson.phantom.breathing.tissue import draw_tissue
from glisson.phantom.breathing.view import BreathingVideo

SEED, FRAMES_PER_S, PERIOD_S = 41, 60.0, 4.0
CAMERA = Camera(960, 540, [640.0, 640.0], [482.0, 268.0], [-0.22, 0.06, 5e-4, -4e-4, 0.0])


def main(count: int, target: Path) -> None:
    """Twenty marks on a breathing liver, with glare, blood and an instrument."""
    random = np.random.default_rng(SEED)
    duration = count / FRAMES_PER_S
    shape = (CAMERA.height, CAMERA.width)
    video = BreathingVideo(
        CAMERA,
        draw_tissue(20.0, random),
        draw_breaths(PERIOD_S, duration, Irregularity(), random),
        count,
        Shutter(FRAMES_PER_S, 0.008, 0.01),
        glare=draw_glare(shape, random),
        passing=draw_passing(duration, shape, random),
    )
    write_video(target.with_suffix(".avi"), video.images(), FRAMES_PER_S)
    with atomic_path(target) as path:
        np.savez(path, marks=video.marks_px(), visible=video.marks_visible())


if __name__ == "__main__":
    main(int(sys.argv[1]), Path(sys.argv[3]))
