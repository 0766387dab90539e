"""All cases, and running them."""

from collections.abc import Sequence
from dataclasses import dataclass

from glisson.core.errors import BadInput
from glisson.core.protocols import Progress, silent
from glisson.verification import (
    calculix,
    capstan,
    closed_forms,
    cook,
    elastica,
    energy,
    friction,
    hertz,
    inflation,
    manufactured,
    mestdagh,
    parts,
    patch,
    rigid,
    rod,
    taylor,
    torsion,
)
from glisson.verification.check import PREFIXES, Case, Check

_FAMILIES = (
    *(patch, manufactured, closed_forms, torsion, inflation, cook, elastica, hertz, friction, capstan),
    *(rod, parts, rigid, energy, taylor, mestdagh, calculix),
)
CASES: tuple[Case, ...] = tuple(
    sorted((case for family in _FAMILIES for case in family.CASES), key=lambda case: PREFIXES.index(case.prefix))
)
"""Every case of the suite, in the order of `PREFIXES`."""


@dataclass(frozen=True)
class Outcome:
    """A case and its checks."""

    case: Case
    checks: tuple[Check, ...]


def chosen_cases(only: str | None) -> tuple[Case, ...]:
    """The cases whose names begin with `only`; all without it.

    Raises:
        BadInput: no name begins so.
    """
    chosen = tuple(case for case in CASES if case.name.startswith(only or ""))
    if not chosen:
        raise BadInput(f"No check begins with {only!r}; checks begin with {', '.join(PREFIXES)}.")
    return chosen


def run_cases(cases: Sequence[Case], progress: Progress = silent) -> tuple[Outcome, ...]:
    """Run cases one after the other."""
    outcomes = []
    for number, case in enumerate(cases):
        progress(number / len(cases), f"{case.name}: {case.summary}")
        outcomes.append(Outcome(case, case.checks()))
    return tuple(outcomes)
