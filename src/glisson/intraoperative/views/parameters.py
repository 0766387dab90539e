"""What both ways of reconstruction can be told."""

from dataclasses import dataclass

from glisson.core.parameters import parameter


@dataclass(frozen=True)
class ReconstructionParameters:
    """When views are too close to each other."""

    worst_mm: float = parameter(
        10.0, "Refuse where the median error bar (one standard deviation along its longest axis) is longer.", 0.01, 1e6
    )
    doubtful_mm: float = parameter(3.0, "Warn where it is longer.", 0.01, 1e6)
