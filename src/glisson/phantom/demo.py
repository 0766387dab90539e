"""The phantom of the demo."""

from collections.abc import Sequence

from glisson.phantom.family import DEFAULT_SPACING_MM, make_phantom
from glisson.phantom.phantom import Phantom

DEMO_SEED = 3
"""The member of the family that the demo shows."""


def demo_phantom(spacing_mm: Sequence[float] = DEFAULT_SPACING_MM) -> Phantom:
    """The demo's phantom.

    Raises:
        BadInput: the spacing is not three lengths of 0.3 to 10 mm.
    """
    return make_phantom(DEMO_SEED, spacing_mm)
