"""The colour codes of wheels: how far apart they are however a wheel is turned or mirrored, and whose a reading is."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from glisson.core.errors import BadInput, StageFailed
from glisson.core.instruments import SECTORS, Instrument, InstrumentLibrary
from glisson.core.marker_colours import MARKER_COLOURS
from glisson.core.status import Status

LEAST_APART = 2
"""Codes differ in so many sectors at least: a single sector that is misread then makes no other code."""

_MOST_HIDDEN = 2

Reading = Sequence[str | None]
"""Colours anticlockwise from any sector; None where a sector cannot be read."""


@dataclass(frozen=True)
class Alike:
    """Two instruments (or one and its mirror image) whose codes differ in too few sectors."""

    one: str
    other: str
    sectors: int

    @property
    def sentence(self) -> str:
        """What is alike, and what to do."""
        whose = f"that of {self.other!r}" if self.one != self.other else "its own mirror image"
        return (
            f"The code of {self.one!r} differs from {whose} in {self.sectors} sectors, however the wheel is turned; "
            f"it must in {LEAST_APART}."
        )


def alike_codes(library: InstrumentLibrary) -> tuple[Alike, ...]:
    """All pairs of codes that differ in fewer than `LEAST_APART` sectors in some rotation, mirrored or not."""
    found = []
    for number, one in enumerate(library.instruments):
        mirrored = min(_differing(one.colours, way) for way in _turned(one.colours[::-1]))
        pairs = [(one.name, mirrored)]
        for other in library.instruments[number + 1 :]:
            pairs.append((other.name, min(_differing(one.colours, way) for way in _either_way(other.colours))))
        found += [Alike(one.name, name, sectors) for name, sectors in pairs if sectors < LEAST_APART]
    return tuple(found)


def free_code(library: InstrumentLibrary) -> tuple[str, ...]:
    """Colours for one more instrument: as far from all others, and from their own other ways round, as may be.

    Raises:
        BadInput: no code is left that can be told from all others.
    """
    codes = np.array(list(product(range(len(MARKER_COLOURS)), repeat=SECTORS)))
    turns = range(SECTORS)
    ways = [np.roll(codes[:, ::step], turn, axis=1) for step in (1, -1) for turn in turns]
    own = np.min([(codes != way).sum(axis=1) for way in ways[1:]], axis=0)
    others = np.full(len(codes), SECTORS)
    for one in library.instruments:
        numbers = np.array([MARKER_COLOURS.index(colour) for colour in one.colours])
        others = np.minimum(others, np.min([(way != numbers).sum(axis=1) for way in ways], axis=0))
    best = int(np.argmax(np.where(own >= LEAST_APART, others, -1)))
    if own[best] < LEAST_APART or others[best] < LEAST_APART:
        raise BadInput("No colour code is left that can be told from all others in the library.")
    return tuple(MARKER_COLOURS[number] for number in codes[best])


def instrument_of(reading: Reading, library: InstrumentLibrary) -> tuple[Instrument, int]:
    """The instrument whose code a reading is, and at which of its sectors the reading begins.

    It agrees with all sectors that were read, and all other codes, mirrored ones too, differ in `LEAST_APART` of them.

    Raises:
        StageFailed: the code is none of the library's, that of a mirrored wheel, or too much of it is hidden.
    """
    said = "-".join(colour or "hidden" for colour in reading)
    if sum(colour is None for colour in reading) > _MOST_HIDDEN:
        raise StageFailed(f"Too many of the wheel's sectors cannot be read ({said}).", Status.UNOBSERVABLE)
    near = []
    for instrument in library.instruments:
        for mirrored, colours in ((False, instrument.colours), (True, instrument.colours[::-1])):
            for begin, way in enumerate(_turned(colours)):
                near.append((_differing(reading, way), mirrored, begin, instrument))
    fit = [entry for entry in near if entry[0] == 0]
    if not fit:
        raise StageFailed(f"The colour code {said} is not in the library of instruments.", Status.BAD_INPUT)
    _, mirrored, begin, instrument = fit[0]
    # Its own mirror image has the same name, so that only one that fits as well is a rival.
    rivals = [entry for entry in near if entry[0] < LEAST_APART and entry[3] is not instrument]
    if rivals or len(fit) > 1:
        others = sorted({entry[3].name for entry in rivals} | {instrument.name})
        raise StageFailed(
            f"With {said} too much of the wheel is hidden to be sure of {' or '.join(map(repr, others))}.",
            Status.AMBIGUOUS,
        )
    if mirrored:
        raise StageFailed(
            f"The wheel of {instrument.name!r} is seen mirrored; check whether the camera's image is flipped.",
            Status.BAD_INPUT,
        )
    return instrument, begin


def _either_way(colours: Sequence[str]) -> Iterator[Sequence[str]]:
    yield from _turned(colours)
    yield from _turned(colours[::-1])


def _turned(colours: Sequence[str]) -> Iterator[Sequence[str]]:
    for begin in range(len(colours)):
        yield (*colours[begin:], *colours[:begin])


def _differing(reading: Reading, colours: Sequence[str]) -> int:
    return sum(read not in (None, colour) for read, colour in zip(reading, colours, strict=True))
