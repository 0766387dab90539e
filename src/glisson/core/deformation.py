"""The answer of a mechanical solve: where every node went, stage by stage, and whether to believe it."""

from dataclasses import dataclass, field

from glisson.core.arrays import FloatArray, frozen_floats
from glisson.core.errors import BadInput
from glisson.core.mesh import TetMesh
from glisson.core.status import Status


@dataclass(frozen=True)
class LoadStep:
    """Convergence record of one load step.

    `residual` is the free-node residual divided by the largest of internal, contact and external force.
    """

    stage: str
    fraction: float
    iterations: int
    residual: float
    energy_uj: float
    status: Status


@dataclass(frozen=True)
class ContactReport:
    """One tool at the end of a stage: force of the tool on the organ (LPS, N), area, slip.

    `angle_deg` and `hinge_moment_nm` (of the organ's load about the hinge) are None for boards.
    `sticking` is the fraction of the touching area that sticks. `least_gap_mm` is None for bedding, into which an
    organ sinks; for other tools it is taken at the surface points at which contact acts, counted from where settling
    the scanned surface against the tools has put them.
    """

    tool: str
    force_n: tuple[float, float, float]
    area_mm2: float
    largest_pressure_kpa: float
    least_gap_mm: float | None
    sticking: float
    largest_slip_mm: float
    angle_deg: float | None = None
    hinge_moment_nm: float | None = None


@dataclass(frozen=True)
class RodReport:
    """The rod in the duct at the end of a stage: how far its tip slid past the tissue since the scan, and its pull.

    `slide_mm` is positive inward, along the duct as it was in the scan; `largest_slide_mm` is that of any of its
    points, without sign. `tension_n` at the duct's mouth is positive where the rod is drawn.
    """

    slide_mm: float
    largest_slide_mm: float
    tension_n: float


@dataclass(frozen=True)
class Event:
    """Something that happened on the way, for example kind "lost_contact" of a tool at an angle."""

    kind: str
    tool: str
    at_deg: float | None

    @property
    def sentence(self) -> str:
        """The event for people."""
        where = "" if self.at_deg is None else f" at {self.at_deg:.0f}°"
        return f"{self.kind.replace('_', ' ').capitalize()} with {self.tool}{where}."


@dataclass(frozen=True, eq=False)
class StageResult:
    """The state at the end of a stage: displacement (n, 3) in mm from the scanned shape A."""

    name: str
    displacement: FloatArray
    status: Status
    contacts: tuple[ContactReport, ...] = ()
    rod: RodReport | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "displacement", frozen_floats(self.displacement, (None, 3), "displacement"))


@dataclass(frozen=True, eq=False)
class Deformation:
    """Displacements of the scanned mesh through the stages, with status, record and events.

    `message` is one sentence, more exact than the status (it names a free direction, for example).
    Stages that were not reached are missing; the last one present may have a status that is not good.
    `estimated_error` (n,) in mm is what a technique that leaves something out says it costs at each node, at the end of
    the last stage; None where nothing is left out.
    """

    mesh: TetMesh
    stages: tuple[StageResult, ...]
    status: Status
    message: str
    record: tuple[LoadStep, ...] = ()
    events: tuple[Event, ...] = field(default=())
    estimated_error: FloatArray | None = None

    def __post_init__(self) -> None:
        for stage in self.stages:
            if len(stage.displacement) != len(self.mesh.nodes):
                raise BadInput(f"Stage {stage.name!r} has displacements for another mesh.")
        if self.estimated_error is not None:
            error = frozen_floats(self.estimated_error, (len(self.mesh.nodes),), "estimated error")
            object.__setattr__(self, "estimated_error", error)

    @property
    def displacement(self) -> FloatArray:
        """Displacement (n, 3) at the end of the last stage, mm from A.

        Raises:
            BadInput: there is no stage.
        """
        if not self.stages:
            raise BadInput("The deformation has no stage.")
        return self.stages[-1].displacement
