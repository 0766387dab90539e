"""The suite's report: one self-contained HTML file with every check, and plots of the orders of convergence."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

import glisson
from glisson.io.atomic import atomic_path
from glisson.verification.figures import Picture, convergence_picture, error_picture
from glisson.verification.suite import Outcome

TITLES = {
    "patch": "Patch tests",
    "mms": "Manufactured solutions",
    "closed-form": "Closed forms of finite elasticity",
    "cook": "Cook's membrane",
    "elastica": "Elastica",
    "hertz": "Hertz contact",
    "friction": "Friction and cohesion",
    "capstan": "Belt friction",
    "rod": "Rod in a duct",
    "parts": "Capsule, gas and ligaments",
    "rigid": "Rigid rotation",
    "energy": "Energy balance",
    "taylor": "Taylor tests",
    "mestdagh": "Forces in public data",
    "calculix": "CalculiX",
}
"""What each prefix stands for."""


@dataclass(frozen=True)
class Section:
    """The cases of one prefix."""

    title: str
    prefix: str
    outcomes: tuple[Outcome, ...]

    @property
    def failed(self) -> int:
        """How many of its checks failed."""
        return sum(not check.passed for outcome in self.outcomes for check in outcome.checks)

    @property
    def count(self) -> int:
        """How many checks it has."""
        return sum(len(outcome.checks) for outcome in self.outcomes)

    @property
    def convergence(self) -> Picture | None:
        """Its plot of errors over element sizes, where it has some."""
        checks = [check for outcome in self.outcomes for check in outcome.checks if check.convergence is not None]
        return convergence_picture(checks) if checks else None


def write_report(path: Path, outcomes: Sequence[Outcome], seconds: float) -> None:
    """Write the report (UTF-8) that needs nothing else, not even a network.

    Raises:
        BadInput: nothing can be written there.
        WriteFailed: the disk is full or failing.
    """
    environment = Environment(
        loader=PackageLoader("glisson.verification"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["figure"] = figure
    sections = [
        Section(TITLES[prefix], prefix, tuple(found))
        for prefix, found in groupby(outcomes, lambda outcome: outcome.case.prefix)
    ]
    checks = [check for outcome in outcomes for check in outcome.checks]
    page = environment.get_template("report.html.jinja").render(
        sections=sections,
        failed=[check for check in checks if not check.passed],
        count=len(checks),
        seconds=seconds,
        version=glisson.__version__,
        overview=error_picture(checks),
    )
    with atomic_path(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def figure(value: float | None) -> str:
    """A number with five digits, or a dash."""
    return "–" if value is None else f"{value:.5g}".replace("-", "−")
