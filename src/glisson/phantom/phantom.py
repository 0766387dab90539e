"""What a digital liver consists of."""

from dataclasses import dataclass

from glisson.core.deformation import Deformation
from glisson.core.image import LabelMap, Volume
from glisson.core.scenario import Scenario
from glisson.core.structures import Structures


@dataclass(frozen=True, eq=False)
class Phantom:
    """One member of the family with its known answers; everything is in the scanned shape A (LPS mm).

    `organ`, `tumours` and `structures` are the label groups of a case, `couinaud` the segments 1 to 8;
    a voxel belongs to what holds its centre. `exact` is the interior without voxels, `scenario` the
    manoeuvre as a user would know it. `truth` is the deformation that another engine found, on its own
    mesh and with its own material and attachments; only the demo's phantom has one.
    """

    seed: int
    volume: Volume
    organ: LabelMap
    tumours: LabelMap
    structures: LabelMap
    couinaud: LabelMap
    exact: Structures
    scenario: Scenario
    truth: Deformation | None = None
