"""What is recorded: breaths, and sweeps over the rates of a ventilator, drawn from seeds."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.phantom.breathing.exposing import Shutter
from glisson.phantom.breathing.motion import Breaths, Irregularity, Motion, Ventilator, draw_breaths
from glisson.phantom.breathing.occluders import draw_glare, draw_passing
from glisson.phantom.breathing.tissue import Tissue, draw_tissue
from glisson.phantom.breathing.view import BreathingVideo
from glisson.phantom.optics import ray_slopes

CAMERA = Camera(
    960, 540, np.array([640.0, 640.0]), np.array([482.0, 268.0]), np.array([-0.22, 0.06, 5e-4, -4e-4, 0.0])
)  # fmt: skip

EXCURSION_MM = 20.0
"""Of the breaths whose phases are told (Figure II.34)."""

CONVENTIONAL_MM, CONVENTIONAL_PERIOD_S = 15.0, 6.0
"""Conventional ventilation, 10 breaths per minute (section 6.2)."""

VENTILATED = Irregularity(length=0.01, depth=0.03, level=0.02)
"""A ventilator's breaths are all but alike."""

RATES_HZ = np.arange(4.0, 14.01, 0.5)
BREAK_HZ = (6.0, 12.0)
PRINTED_HZ = 10.8
"""The dissertation's plateau: the break of the first sweep."""

_FRAMES_PER_S = (15.0, 25.0, 30.0, 50.0, 60.0)
_SWEEP_S, _PIXEL_SWEEP_S = 4.0, 2.4
_REPEATABLE, _SCATTER_MM = 0.015, 0.01
"""How a displacement comes out again in another recording: as a share, and beside that in mm."""

_AVERAGED = 0.4
"""Share of a stroke over which an exposure may average."""

_LEAST_ABOVE = 3
"""The plateau of a sweep is resolvable where so many resolvable rates are at it."""


@dataclass(frozen=True)
class Sweep:
    """High-frequency ventilation at many rates, and how it is recorded.

    Args:
        break_hz: the displacement is constant from here on.
        displacements_mm: true ones at RATES_HZ.
        camera_frames_per_s: pictures that the camera takes.
        repeats: the recorder writes each of them so many times.
        exposure_s: of each.
        told_exposure_s: what is said of that; None: nothing.
    """

    break_hz: float
    displacements_mm: tuple[float, ...]
    camera_frames_per_s: float
    repeats: int
    exposure_s: float
    told_exposure_s: float | None

    @property
    def resolvable(self) -> list[bool]:
        """Whether each rate has over two pictures a stroke, and three quarters of its motion left by the exposure."""
        return [
            bool(rate < 0.5 * self.camera_frames_per_s and rate * self.exposure_s <= _AVERAGED) for rate in RATES_HZ
        ]

    @property
    def is_resolvable(self) -> bool:
        """Whether the plateau can be seen."""
        above = [good for good, rate in zip(self.resolvable, RATES_HZ, strict=True) if rate >= self.break_hz]
        return sum(above) >= _LEAST_ABOVE


def draw_sweep(seed: int, first: bool) -> Sweep:
    """A sweep of a seed; the first one has its break at the dissertation's 10.8 Hz and a camera that resolves it."""
    random = np.random.default_rng([seed, 61])
    at = PRINTED_HZ if first else float(random.uniform(*BREAK_HZ))
    floor, more, kind = random.uniform(0.2, 0.8), random.uniform(3.0, 6.0), int(random.integers(3))
    power = random.uniform(0.8, 1.6)
    shapes = (at / 4.0 - RATES_HZ / 4.0, (at / RATES_HZ) ** power - 1.0, np.expm1(0.2 * power * (at - RATES_HZ)))
    shape = np.where(at > RATES_HZ, shapes[kind] / shapes[kind][0], 0.0)
    exact = floor + more * shape
    scatter = random.standard_normal((2, len(RATES_HZ)))
    seen = exact + _REPEATABLE * (exact - floor) * scatter[0] + _SCATTER_MM * scatter[1]
    frames_per_s = 60.0 if first else float(random.choice(_FRAMES_PER_S))
    exposure = float(random.uniform(0.1, 1.0)) / frames_per_s
    told = None if random.uniform() < 0.3 else float(exposure * random.normal(1.0, 0.1))
    return Sweep(at, tuple(float(d) for d in seen), frames_per_s, 1 + int(random.uniform() < 0.25), exposure, told)


def sweep_video(sweep: Sweep, tissue: Tissue, number: int, seed: int, from_pixels: bool) -> BreathingVideo:
    """The recording at rate `number` of a sweep; the tissue is moved by 1 mm per unit of depth."""
    random = np.random.default_rng([seed, 62, number])
    duration = _PIXEL_SWEEP_S if from_pixels else _SWEEP_S
    rate = RATES_HZ[number] * (1.0 + random.uniform(-0.005, 0.005))
    motion = Ventilator(rate, sweep.displacements_mm[number], random.uniform(0.0, 1.0 / rate))
    shutter = Shutter(sweep.camera_frames_per_s, sweep.exposure_s, 0.6 / sweep.camera_frames_per_s)
    return _video(tissue, motion, duration, shutter, seed, with_passing=False)


def sweep_tissue(seed: int, marks: int) -> Tissue:
    """Tissue that moves by 1 mm, with so many marks."""
    return draw_tissue(1.0, np.random.default_rng([seed, 63]), marks)


def breaths_video(seed: int, excursion_mm: float, duration_s: float, frames_per_s: float, marks: int) -> BreathingVideo:
    """Irregular breaths of 9 to 15 per minute."""
    random = np.random.default_rng([seed, 64])
    breaths = draw_breaths(60.0 / random.uniform(9.0, 15.0), duration_s, Irregularity(), random)
    tissue = draw_tissue(excursion_mm, random, marks)
    shutter = Shutter(frames_per_s, random.uniform(0.1, 0.6) / frames_per_s, 0.6 / frames_per_s)
    return _video(tissue, breaths, duration_s, shutter, seed, with_passing=True)


def conventional_video(seed: int, duration_s: float, frames_per_s: float) -> BreathingVideo:
    """A conventional ventilator's breaths."""
    random = np.random.default_rng([seed, 65])
    breaths = draw_breaths(CONVENTIONAL_PERIOD_S, duration_s, VENTILATED, random)
    shutter = Shutter(frames_per_s, 0.3 / frames_per_s, 0.5 / frames_per_s)
    return _video(draw_tissue(CONVENTIONAL_MM, random), breaths, duration_s, shutter, seed, with_passing=False)


def breaths_of(video: BreathingVideo) -> Breaths:
    """The breaths of a video of breaths."""
    assert isinstance(video.motion, Breaths)
    return video.motion


def distance_mm(video: BreathingVideo) -> float:
    """How far along the camera's axis the middle of the tissue is at full exhalation."""
    return float(video.tissue.middle_mm[2])


def true_mm(video: BreathingVideo, places_px: FloatArray) -> FloatArray:
    """Places (…, 2) px in mm across the camera's axis at that distance, without distortion."""
    slopes = ray_slopes(video.camera, places_px.reshape(-1, 2))
    return np.asarray(distance_mm(video) * slopes.reshape(places_px.shape))


def _video(
    tissue: Tissue, motion: Motion, duration_s: float, shutter: Shutter, seed: int, with_passing: bool
) -> BreathingVideo:
    random = np.random.default_rng([seed, 66])
    shape = (CAMERA.height, CAMERA.width)
    return BreathingVideo(
        CAMERA,
        tissue,
        motion,
        int(duration_s * shutter.frames_per_s),
        shutter,
        glare=draw_glare(shape, random),
        passing=draw_passing(duration_s, shape, random) if with_passing else (),
        seed=seed,
    )
