"""Lever lifts that CalculiX has solved, and whose results ship with the package."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from glisson.phantom.family import DEFAULT_SPACING_MM, assemble, build_anatomy, scan_grid
from glisson.phantom.phantom import Phantom
from glisson.phantom.truth import Truth, read_truth


@dataclass(frozen=True)
class LiftTruth:
    """One of them: the member of the family, its file, and the parameters that it was solved with.

    The modulus is the mean of the parenchyma's. Friction is that of stage 2 (Coulomb); in stage 1 contact
    sticks, as a cohesion of `cohesion_kpa` would have it, by a friction of 0.5 (CalculiX has no cohesion).
    """

    name: str
    seed: int
    file: str
    young_modulus_kpa: float = 7.0
    poisson_ratio: float = 0.45
    friction: float = 0.1
    cohesion_kpa: float = 10.0

    @property
    def path(self) -> Path:
        """The file, made by `scripts/make_lift_truth.py`."""
        return Path(__file__).parent / "data" / self.file

    def read(self) -> Truth:
        """The displacements.

        Raises:
            BadInput: the file is missing or damaged.
        """
        return read_truth(self.path)

    def phantom(self, spacing_mm: Sequence[float] = DEFAULT_SPACING_MM) -> Phantom:
        """The member scanned in the loaded shape A that CalculiX found, with the truth of both stages.

        Raises:
            BadInput: the spacing is not three lengths of 0.3 to 10 mm, or the file is damaged.
        """
        grid, truth = scan_grid(spacing_mm), self.read()
        return assemble(build_anatomy(self.seed, truth.loading), self.seed, grid, truth.deformation)


LIFT_TRUTHS = (LiftTruth("demo", 3, "demo_truth.npz"),)
"""All of them; the file of a new one is made by the script, once it stands here."""


def lift_truth(name: str) -> LiftTruth:
    """The truth of that name, which is one of `LIFT_TRUTHS`."""
    return next(truth for truth in LIFT_TRUTHS if truth.name == name)
