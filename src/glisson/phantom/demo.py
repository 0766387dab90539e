"""The phantom of the demo: the member of the family whose deformed truth ships with the package."""

from collections.abc import Sequence
from pathlib import Path

from glisson.phantom.family import DEFAULT_SPACING_MM, assemble, build_anatomy, scan_grid
from glisson.phantom.phantom import Phantom
from glisson.phantom.truth import read_truth

DEMO_SEED = 3
"""The member of the family that the demo shows."""

TRUTH_PATH = Path(__file__).parent / "data" / "demo_truth.npz"
"""Its truth, made by `scripts/make_demo_truth.py`."""


def demo_phantom(spacing_mm: Sequence[float] = DEFAULT_SPACING_MM) -> Phantom:
    """The demo's phantom, scanned in the loaded shape A, with the truth of both stages.

    The CT shows the rest shape after gravity pressed it onto the board, as CalculiX found it; `truth` has
    the stages "stage 1" (lifted, sticky) and "stage 2" (settled) on CalculiX's own mesh. Where the scenario
    says µ = 0.1 and c = 10 kPa (stage 1), CalculiX, which has no cohesion, took µ = 0.5: both stick.

    Raises:
        BadInput: the spacing is not three lengths of 0.3 to 10 mm, or the truth's file is damaged.
    """
    grid = scan_grid(spacing_mm)
    truth = read_truth(TRUTH_PATH)
    return assemble(build_anatomy(DEMO_SEED, truth.loading), DEMO_SEED, grid, truth.deformation)
