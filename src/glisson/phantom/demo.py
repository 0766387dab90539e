"""The phantom of the demo: the member of the family whose deformed truth ships with the package."""

from collections.abc import Sequence

from glisson.phantom.family import DEFAULT_SPACING_MM
from glisson.phantom.lift_truths import lift_truth
from glisson.phantom.phantom import Phantom

DEMO_TRUTH = lift_truth("demo")
"""The member of the family that the demo shows, and its truth."""


def demo_phantom(spacing_mm: Sequence[float] = DEFAULT_SPACING_MM) -> Phantom:
    """The demo's phantom, scanned in the loaded shape A, with the truth of both stages.

    The CT shows the rest shape after gravity pressed it onto the board, as CalculiX found it; `truth` has
    the stages "stage 1" (lifted, sticky) and "stage 2" (settled) on CalculiX's own mesh. Where the scenario
    says µ = 0.1 and c = 10 kPa (stage 1), CalculiX, which has no cohesion, took µ = 0.5: both stick.

    Raises:
        BadInput: the spacing is not three lengths of 0.3 to 10 mm, or the truth's file is damaged.
    """
    return DEMO_TRUTH.phantom(spacing_mm)
