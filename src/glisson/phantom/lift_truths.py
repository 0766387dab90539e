"""Lever lifts that CalculiX has solved, and whose results ship with the package."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from glisson.phantom.family import DEFAULT_SPACING_MM, assemble, build_anatomy, scan_grid
from glisson.phantom.lever_lift import LEVER_ANGLE_DEG
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
    angle_deg: float = LEVER_ANGLE_DEG

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


UNSEEN_TRUTHS = (
    LiftTruth("unseen-700", 700, "lift_truth_700.npz", 9.0, 0.46, angle_deg=24.0),
    LiftTruth("unseen-701", 701, "lift_truth_701.npz", 6.0, 0.47, angle_deg=19.0),
    LiftTruth("unseen-702", 702, "lift_truth_702.npz", 12.0, 0.45, angle_deg=28.0),
    LiftTruth("unseen-703", 703, "lift_truth_703.npz", 5.0, 0.48, angle_deg=22.0),
    LiftTruth("unseen-704", 704, "lift_truth_704.npz", 8.0, 0.47, angle_deg=30.0),
    LiftTruth("unseen-705", 705, "lift_truth_705.npz", 10.0, 0.46, angle_deg=17.0),
    LiftTruth("unseen-706", 706, "lift_truth_706.npz", 6.5, 0.45, angle_deg=26.0),
    LiftTruth("unseen-707", 707, "lift_truth_707.npz", 14.0, 0.47, angle_deg=20.0),
    LiftTruth("unseen-708", 708, "lift_truth_708.npz", 7.5, 0.48, angle_deg=32.0),
    LiftTruth("unseen-709", 709, "lift_truth_709.npz", 5.5, 0.46, angle_deg=23.0),
)
"""Of livers that nothing is tuned on, for the study of lever lifts; a file that is not there yet takes the script."""

LIFT_TRUTHS = (LiftTruth("demo", 3, "demo_truth.npz"), *UNSEEN_TRUTHS)
"""All of them; the file of a new one is made by the script, once it stands here."""


def lift_truth(name: str) -> LiftTruth:
    """The truth of that name, which is one of `LIFT_TRUTHS`."""
    return next(truth for truth in LIFT_TRUTHS if truth.name == name)
