"""What both ways to mark a structure can be told."""

from dataclasses import dataclass

from glisson.core.parameters import parameter


@dataclass(frozen=True)
class StructureParameters:
    """How far a structure reaches, and how narrow its own passages are."""

    reach_mm: float = parameter(60.0, "Nothing farther from a click is looked at, mm.", 5.0, 300.0)
    passage_mm: float = parameter(4.0, "What is reached through narrower passages only is left out, mm.", 0.0, 30.0)
    gap_mm: float = parameter(4.0, "A wire or stent is followed across gaps as wide as this, mm.", 0.0, 20.0)
