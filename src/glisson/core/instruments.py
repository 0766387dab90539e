"""Instruments with a wheel of coloured sectors on the shaft, by which a trocar's camera tells them apart."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.marker_colours import MARKER_COLOURS
from glisson.core.transform import RigidTransform

SECTORS = 6


class WheelRings(NamedTuple):
    """Radii of a wheel's rings as shares of the outer one.

    From outside: a black ring up to `white`; a white one, the reference for colours, up to `outer`; the sectors up to
    `inner`; a white ring up to `hole`, through which the shaft goes.
    """

    white: float = 0.9
    outer: float = 0.76
    inner: float = 0.42
    hole: float = 0.28


RINGS = WheelRings()


@dataclass(frozen=True)
class Instrument:
    """An instrument and its wheel, which is at a right angle to the shaft and centred on it.

    The frame "instrument" has its origin in the wheel's centre and z along the shaft towards the tip, whence the
    wheel's face is seen; sector k lies between the angles k · 60° and (k + 1) · 60° from x towards y (mm).

    Args:
        name: as people call it.
        length_mm: from the wheel to the tip.
        colours: of the six sectors, anticlockwise as one looks at the face.
        wheel_mm: the wheel's outer diameter.
    """

    name: str
    length_mm: float
    colours: tuple[str, ...]
    wheel_mm: float = 40.0

    def __post_init__(self) -> None:
        if not self.name.strip():
            raise BadInput("An instrument needs a name.")
        if len(self.colours) != SECTORS or not set(self.colours) <= set(MARKER_COLOURS):
            raise BadInput(f"The instrument {self.name!r} needs {SECTORS} colours out of {', '.join(MARKER_COLOURS)}.")
        for value, what in ((self.length_mm, "length"), (self.wheel_mm, "wheel")):
            if not (np.isfinite(value) and value > 0.0):
                raise BadInput(f"The instrument {self.name!r} needs a {what} of more than 0 mm, not {value} mm.")

    @property
    def tip_mm(self) -> FloatArray:
        """The tip (3,) in the frame "instrument"."""
        return np.array([0.0, 0.0, self.length_mm])


@dataclass(frozen=True)
class InstrumentLibrary:
    """The instruments that may be met; no name is there twice."""

    instruments: tuple[Instrument, ...]

    def __post_init__(self) -> None:
        names = [instrument.name for instrument in self.instruments]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise BadInput(f"The library has {', '.join(map(repr, twice))} twice; give each instrument its own name.")

    def named(self, name: str) -> Instrument:
        """The instrument of a name.

        Raises:
            BadInput: there is none.
        """
        for instrument in self.instruments:
            if instrument.name == name:
                return instrument
        known = ", ".join(instrument.name for instrument in self.instruments) or "none"
        raise BadInput(f"The library has no instrument {name!r}; it has {known}.")


@dataclass(frozen=True, eq=False)
class SeenInstrument:
    """An instrument as a trocar's camera sees it.

    Args:
        instrument: which one.
        trocar_from_instrument: its pose with covariance.
        angle_rad: between its axis and the trocar's.
        off_pivot_mm: how far its axis passes the pivot by, as the wheel alone has it.
        seen: share of the wheel's rims that was found.
    """

    instrument: Instrument
    trocar_from_instrument: RigidTransform
    angle_rad: float
    off_pivot_mm: float
    seen: float

    @property
    def distance_mm(self) -> float:
        """From the camera to the wheel's centre."""
        return float(np.linalg.norm(self.trocar_from_instrument.translation_mm))

    @property
    def tip_mm(self) -> FloatArray:
        """The tip (3,) in the frame "trocar"."""
        return self.trocar_from_instrument.apply(self.instrument.tip_mm)

    @property
    def tip_covariance_mm2(self) -> FloatArray:
        """Its covariance (3, 3)."""
        return self.trocar_from_instrument.point_covariance(self.instrument.tip_mm)
