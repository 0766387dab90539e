"""What may be seen when a trocar's camera looks at an instrument's wheel: drawn at random, with its exact pose."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.instruments import Instrument
from glisson.core.transform import RigidTransform
from glisson.core.trocar import Trocar
from glisson.phantom.photograph import Sensor


@dataclass(frozen=True)
class Spot:
    """A round thing on the wheel: centre and radius in wheel radii, and how much it hides or adds (0 to 1)."""

    x: float
    y: float
    radius: float
    strength: float


@dataclass(frozen=True)
class Finger:
    """A gloved finger over the wheel from outside: its angle, how near to the centre it comes, and its half width."""

    angle: float
    reach: float
    half_width: float
    colour: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class WheelScene:
    """An instrument in a trocar, and what lies over its wheel and in the light.

    `light` is the lamp's colour with the exposure, `slope` (2,) how the light changes over a wheel's radius. The image
    has the light to the power 1 / `gamma`.
    """

    instrument: Instrument
    trocar_from_instrument: RigidTransform
    light: FloatArray
    slope: FloatArray
    sensor: Sensor
    gamma: float = 1.0
    shaft_mm: float = 5.0
    fingers: tuple[Finger, ...] = ()
    blood: tuple[Spot, ...] = ()
    glare: tuple[Spot, ...] = ()
    seed: int = 0
    """Of what is behind, and of the noise."""


GLOVES = ((0.80, 0.80, 0.76), (0.42, 0.62, 0.78), (0.30, 0.52, 0.45), (0.62, 0.50, 0.66))


def draw_scene(
    trocar: Trocar,
    instruments: Sequence[Instrument],
    rng: np.random.Generator,
    *,
    distance_mm: tuple[float, float] = (70.0, 200.0),
    angle_deg: float = 8.0,
) -> WheelScene:
    """Any of the instruments, its wheel within a range of heights over the camera, under the light of a theatre.

    A third of the wheels have a finger over their rim, a third blood, a third glare.
    """
    instrument = instruments[int(rng.integers(len(instruments)))]
    pose = _pose(trocar, rng, rng.uniform(*distance_mm), np.radians(angle_deg))
    fingers, blood, glare = (bool(rng.uniform() < 1.0 / 3.0) for _ in range(3))
    return WheelScene(
        instrument=instrument,
        trocar_from_instrument=pose,
        light=rng.uniform(0.65, 1.1) * np.array([rng.uniform(0.9, 1.15), 1.0, rng.uniform(0.75, 1.1)]),
        slope=rng.uniform(-0.12, 0.12, 2),
        sensor=Sensor(blur_px=rng.uniform(0.5, 1.2), noise=rng.uniform(1.0, 4.0), shot_noise=rng.uniform(1.0, 4.0)),
        shaft_mm=instrument.wheel_mm / rng.uniform(6.0, 13.0),
        fingers=(_finger(rng),) if fingers else (),
        blood=tuple(_spot(rng, (0.05, 0.16), (0.6, 0.95)) for _ in range(int(rng.integers(1, 4)))) if blood else (),
        glare=(_spot(rng, (0.08, 0.25), (0.3, 1.2)),) if glare else (),
        seed=int(rng.integers(2**31)),
        gamma=rng.uniform(1.0, 2.4),
    )


def _pose(trocar: Trocar, rng: np.random.Generator, height_mm: float, widest: float) -> RigidTransform:
    """The wheel so high over the camera, its axis within an angle of the channel's and past the pivot by the play."""
    across, upward = _across(trocar.axis)
    angle, way, roll = widest * np.sqrt(rng.uniform()), rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.0, 2.0 * np.pi)
    aside = np.cos(way) * across + np.sin(way) * upward
    out = np.cos(angle) * trocar.axis + np.sin(angle) * aside
    first, second = _across(out)
    through = trocar.pivot_mm + trocar.play_mm * (rng.standard_normal(2) @ np.stack([first, second]))
    centre = through + out * (height_mm - through[2]) / out[2]
    x = np.cos(roll) * first + np.sin(roll) * second
    return RigidTransform("trocar", "instrument", np.column_stack([x, np.cross(-out, x), -out]), centre)


def _across(axis: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors at right angles to an axis and to each other."""
    first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    return first, np.cross(axis, first)


def _finger(rng: np.random.Generator) -> Finger:
    colour = GLOVES[int(rng.integers(len(GLOVES)))]
    return Finger(rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.55, 0.95), rng.uniform(0.15, 0.25), colour)


def _spot(rng: np.random.Generator, radius: tuple[float, float], strength: tuple[float, float]) -> Spot:
    away, angle = np.sqrt(rng.uniform()), rng.uniform(0.0, 2.0 * np.pi)
    return Spot(away * np.cos(angle), away * np.sin(angle), rng.uniform(*radius), rng.uniform(*strength))
