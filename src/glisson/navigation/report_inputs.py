"""What a report is made of."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from glisson.core.deformation import Deformation
from glisson.core.guidance import Guidance
from glisson.core.image import LabelMap, Volume
from glisson.core.model import Model
from glisson.core.scenario import Scenario
from glisson.navigation.plan import Plan


@dataclass(frozen=True, eq=False)
class ReportInputs:
    """What the report is made of. Optional parts are left out of the report, with a sentence.

    `plan` must be the one that the guidance was made with, `truth` likewise. `provenance` maps stages to
    nested plain values (technique, settings, versions, content hashes), `seconds` stages to their time.
    """

    title: str
    model: Model
    scenario: Scenario
    deformation: Deformation
    guidance: Guidance
    plan: Plan = field(default_factory=Plan)
    volume: Volume | None = None
    organ: LabelMap | None = None
    tumours: LabelMap | None = None
    structures: LabelMap | None = None
    truth: Deformation | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)
    seconds: Mapping[str, float] = field(default_factory=dict)
