"""What a comparison with something that is not our own output consists of."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, SupportsFloat

import numpy as np

from glisson.core.errors import GlissonError

PREFIXES = (
    "patch", "mms", "closed-form", "cook", "elastica", "hertz", "friction", "capstan", "rod", "parts", "rigid",
    "energy", "taylor", "mestdagh", "calculix",
)  # fmt: skip
"""How names of cases and checks may begin, in the order in which they run."""


class Unavailable(GlissonError):
    """An engine or data that a case needs is missing; the message says which."""


class NoSolution(GlissonError):
    """A case that could run but gave no value; the message says why."""


@dataclass(frozen=True)
class Series:
    """Errors (n,) over element sizes or steps (n,), the largest first."""

    sizes: tuple[float, ...]
    errors: tuple[float, ...]

    @property
    def order(self) -> float:
        """Observed order of convergence between the two smallest."""
        return float(np.diff(np.log(self.errors[-2:]))[0] / np.diff(np.log(self.sizes[-2:]))[0])


@dataclass(frozen=True)
class Check:
    """One figure and what it should be.

    `tolerance` is absolute, in the unit of `value`. Where there is no value, `reason` says why. `source` says where
    the expected value comes from.
    """

    name: str
    value: float | None
    expected: float | None
    tolerance: float | None
    unit: str = ""
    source: str = ""
    reason: str = ""
    convergence: Series | None = None

    @property
    def passed(self) -> bool:
        """Whether the value is within the tolerance of what is expected."""
        if self.value is None or self.expected is None or self.tolerance is None:
            return False
        return abs(self.value - self.expected) <= self.tolerance


@dataclass(frozen=True)
class Case:
    """Something to compute that gives one or several checks, whose names begin with its own.

    `summary` is a sentence on what is compared with what. Cases that are `slow` take more than a few seconds.
    """

    name: str
    summary: str
    run: Callable[[], Sequence[Check]]
    slow: bool = False

    @property
    def prefix(self) -> str:
        """The kind of comparison, one of `PREFIXES`."""
        return self.name.partition("/")[0]

    def checks(self) -> tuple[Check, ...]:
        """Run it; one failed check with the reason where it can give no value."""
        try:
            return tuple(_with_finite_value(check) for check in self.run())
        except GlissonError as trouble:
            return (Check(self.name, None, None, None, reason=str(trouble)),)


def relative(name: str, value: SupportsFloat, expected: SupportsFloat, share: float, unit: str, source: str) -> Check:
    """A check whose tolerance is a share of the expected value."""
    return Check(name, float(value), float(expected), share * abs(float(expected)), unit, source)


def vanishing(name: str, value: SupportsFloat, tolerance: float, unit: str, source: str) -> Check:
    """A check of an error, which should be zero."""
    return Check(name, float(value), 0.0, tolerance, unit, source)


def order_check(name: str, sizes_mm: Sequence[float], errors: Sequence[float], expected: float, source: str) -> Check:
    """A check of an observed order of convergence, within 0.1 of theory."""
    series = Series(tuple(map(float, sizes_mm)), tuple(map(float, errors)))
    return Check(name, series.order, expected, 0.1, source=source, convergence=series)


def taylor_check(name: str, remainder: Callable[[float], Any], steps: tuple[float, float]) -> Check:
    """A Taylor test: what a linearisation misses falls with the second power of the step.

    Args:
        name: the check's name.
        remainder: what is missed (any shape) as a function of the step.
        steps: two steps, the larger first.
    """
    rests = tuple(float(np.abs(remainder(step)).max()) for step in steps)
    return Check(name, Series(steps, rests).order, 2.0, 0.1, source="remainder of second order (Taylor)")


def _with_finite_value(check: Check) -> Check:
    if check.value is None or isfinite(check.value):
        return check
    return Check(check.name, None, check.expected, check.tolerance, check.unit, check.source, "the value is not finite")
