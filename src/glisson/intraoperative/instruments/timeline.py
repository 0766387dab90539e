"""When which instrument was in use, from what was seen frame by frame."""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Use:
    """An instrument in the trocar from one time to another (s), and in how many frames it was seen."""

    instrument: str
    from_s: float
    to_s: float
    frames: int


def uses(times_s: Sequence[float], names: Sequence[str | None], gap_s: float = 1.0) -> tuple[Use, ...]:
    """Uses in order of their beginning.

    Frames in which nothing was recognised, as where a hand is before the wheel, end a use only after a gap.

    Args:
        times_s: of the frames.
        names: of the instrument seen in each; None: none, or in doubt.
        gap_s: an instrument that is not seen for longer was taken out.
    """
    found: list[Use] = []
    for time, name in zip(times_s, names, strict=True):
        if name is None:
            continue
        last = found[-1] if found else None
        if last is not None and last.instrument == name and time - last.to_s <= gap_s:
            found[-1] = Use(name, last.from_s, time, last.frames + 1)
        else:
            found.append(Use(name, time, time, 1))
    return tuple(found)


def total_seconds(found: Sequence[Use]) -> dict[str, float]:
    """How long each instrument was in use, in the order in which they were first used."""
    totals: dict[str, float] = {}
    for use in found:
        totals[use.instrument] = totals.get(use.instrument, 0.0) + use.to_s - use.from_s
    return totals
