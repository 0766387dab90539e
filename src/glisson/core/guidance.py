"""What the surgeon is told: tumours, planes, volumes, wire, vessels (LPS mm). None means: not known."""

from dataclasses import dataclass

from glisson.core.arrays import FloatArray
from glisson.core.status import Status
from glisson.core.structures import Plane


@dataclass(frozen=True, eq=False)
class TumourGuidance:
    """Centroid (3,) before and after, radius of the 95 % region, and the error where truth is known."""

    name: str
    before_mm: FloatArray
    after_mm: FloatArray
    radius95_mm: float | None = None
    error_mm: float | None = None


@dataclass(frozen=True, eq=False)
class PlaneGuidance:
    """A resection plane before (A) and after (B).

    `angle_deg` is the angle between both, `residual_mm` the RMS distance of the carried material points
    from the refitted plane (0 for the rule). The errors compare with the truth: of the normal, of the
    offset at the tumour, and of the removed volume in percentage points.
    """

    before: Plane
    after: Plane
    angle_deg: float
    residual_mm: float
    error_deg: float | None = None
    error_mm: float | None = None
    error_points: float | None = None


@dataclass(frozen=True)
class VolumeGuidance:
    """Liver volume in ml and the removed fractions before and after (by the rule where there is one)."""

    liver_ml: float
    removed_before: float
    removed_after: float


@dataclass(frozen=True)
class WireGuidance:
    """Slide of the wire's tip along the duct (positive inward), and its distance to the target surface after."""

    slide_mm: float
    distance_mm: float


@dataclass(frozen=True)
class CrossedVessel:
    """A vessel that the carried plane cuts: tree name, diameter there, and where in A."""

    tree: str
    diameter_mm: float
    point_mm: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Guidance:
    """Everything that is told, with the status of the deformation it rests on.

    `target` is the name of the planned tumour; `notes` are sentences about what is missing and why.
    """

    status: Status
    tumours: tuple[TumourGuidance, ...]
    target: str | None
    carried: PlaneGuidance | None
    rule: PlaneGuidance | None
    volume: VolumeGuidance | None
    wire: WireGuidance | None
    margin_mm: float | None
    crossed: tuple[CrossedVessel, ...] = ()
    notes: tuple[str, ...] = ()
