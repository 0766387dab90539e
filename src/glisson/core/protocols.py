"""The seams: one protocol per kind of technique.

A technique is a small class with a `name`, a frozen dataclass of `Parameters` and one method that does
the work. It is found through an entry point of its kind's group (`glisson.segmenters` and so on), so a
lab adds its own from a package of its own. Long work calls `progress` now and then; Ctrl-C arrives as
KeyboardInterrupt and must not be swallowed.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.crosses import CrossLayout
from glisson.core.deformation import Deformation
from glisson.core.fine_zone import FineZone
from glisson.core.image import LabelMap, Volume
from glisson.core.instruments import InstrumentLibrary, SeenInstrument
from glisson.core.landmarks import Landmarks
from glisson.core.localisation import Localisation
from glisson.core.mesh import TetMesh, TriangleSurface
from glisson.core.model import Material, Model
from glisson.core.observations import Observations
from glisson.core.registered import Registered
from glisson.core.scenario import Scenario
from glisson.core.status import Status
from glisson.core.structures import VesselTree
from glisson.core.tracks import Tracks
from glisson.core.trocar import Trocar
from glisson.core.views import ViewSet


class Progress(Protocol):
    """Told how far work is: `fraction` in 0 to 1 (None: unknown) and a few words."""

    def __call__(self, fraction: float | None, message: str) -> None:
        """Report."""


def silent(fraction: float | None, message: str) -> None:
    """A `Progress` that says nothing."""


@runtime_checkable
class Technique(Protocol):
    """What all techniques share."""

    name: ClassVar[str]
    summary: ClassVar[str]
    Parameters: ClassVar[type[Any]]

    def __init__(self, parameters: Any) -> None:
        """Take validated parameters, an instance of `Parameters`."""

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """Packages or programs that are needed and absent, as one would install them."""


@dataclass(frozen=True, eq=False)
class Segmentation:
    """Labels found, with the axial slices k that a person should look at and why."""

    labels: LabelMap
    flagged_slices: tuple[tuple[int, str], ...] = ()


class Segmenter(Technique, Protocol):
    """Finds the organ in a scan (entry-point group `glisson.segmenters`)."""

    def segment(
        self, volume: Volume, labels: LabelMap | None, seeds_mm: FloatArray, progress: Progress = silent
    ) -> Segmentation:
        """Segment.

        Args:
            volume: the scan.
            labels: what is known already (tumours of another tool, for example), on the same grid.
            seeds_mm: clicks inside the organ, (n, 3) LPS mm; may be empty.
            progress: told how far it is.

        Raises:
            BadInput: the technique needs something that was not given.
            StageFailed: nothing was found.
        """


class VesselSegmenter(Technique, Protocol):
    """Finds vessels or ducts inside the organ (entry-point group `glisson.vessel_segmenters`)."""

    def find(self, volume: Volume, organ: LabelMap, progress: Progress = silent) -> LabelMap:
        """Tubes as {1: "vessel"} on the scan's grid.

        Args:
            volume: the scan.
            organ: the organ ("liver") on the same grid.
            progress: told how far it is.

        Raises:
            BadInput: the organ's mask is empty.
        """


@dataclass(frozen=True, eq=False)
class MarkedStructure:
    """A structure as {1: name}, with sentences on what a person should look at."""

    labels: LabelMap
    notes: tuple[str, ...] = ()


class StructureSegmenter(Technique, Protocol):
    """Marks one structure that was clicked (entry-point group `glisson.structure_segmenters`)."""

    def mark(
        self, volume: Volume, organ: LabelMap | None, name: str, seeds_mm: FloatArray, progress: Progress = silent
    ) -> MarkedStructure:
        """The structure on the scan's grid.

        Args:
            volume: the scan.
            organ: the organ ("liver") on the same grid, where it is known.
            name: "tumour1", "tumour2", …, "gallbladder", "wire" or "stent".
            seeds_mm: clicks into it, (n, 3) LPS mm.
            progress: told how far it is.

        Raises:
            BadInput: another name, no click, or one that lies where the structure cannot be.
            StageFailed: nothing was found, or more than the structure.
        """


class SegmentDivider(Technique, Protocol):
    """Divides the liver into Couinaud's segments (entry-point group `glisson.segment_dividers`).

    `landmarks` are the names of those that it needs.
    """

    landmarks: ClassVar[tuple[str, ...]]

    def divide(self, organ: LabelMap, portal: tuple[VesselTree, ...], landmarks: Landmarks) -> LabelMap:
        """Segments as {1: "segment 1", … 8: "segment 8"} on the organ's grid; every liver voxel has one.

        Args:
            organ: the organ ("liver").
            portal: centrelines of the portal vein; none where they are not known.
            landmarks: named points.

        Raises:
            BadInput: a landmark or the portal vein is missing, or landmarks are at odds.
        """


class SurfaceExtractor(Technique, Protocol):
    """Makes a closed surface of a mask (entry-point group `glisson.surface_extractors`)."""

    def extract(self, mask: NDArray[np.bool_], labels: LabelMap) -> TriangleSurface:
        """Closed surface in LPS mm of a boolean mask on the grid of `labels`."""


class Mesher(Technique, Protocol):
    """Fills a closed surface with tetrahedra (entry-point group `glisson.meshers`)."""

    def mesh(self, surface: TriangleSurface, progress: Progress = silent, finer: Sequence[FineZone] = ()) -> TetMesh:
        """T4 mesh of the inside, with shorter edges in some zones.

        Raises:
            StageFailed: no mesh could be made.
        """


class MaterialLaw(Technique, Protocol):
    """A hyperelastic law (entry-point group `glisson.materials`), of many deformation gradients F (n, 3, 3) at once.

    It vanishes at F = 1, is frame-indifferent (the small-strain one excepted) and reduces to linear elasticity
    with the material's Young's modulus and Poisson's ratio for small strain. Everything is in kPa.
    """

    def check(self, material: Material) -> None:
        """Whether the material has the constants that the law needs.

        Raises:
            BadInput: it has not.
        """

    def energy(self, gradients: FloatArray, material: Material) -> FloatArray:
        """Strain energy density W (n,); infinite where the law has no meaning (J ≤ 0)."""

    def stress(self, gradients: FloatArray, material: Material) -> FloatArray:
        """First Piola–Kirchhoff stress P = ∂W/∂F, (n, 3, 3)."""

    def tangent(self, gradients: FloatArray, material: Material) -> FloatArray:
        """∂P/∂F as (n, 9, 9), rows and columns being the row-major entries of P and F."""


class Solver(Technique, Protocol):
    """Computes what a scenario does to a model (entry-point group `glisson.solvers`)."""

    def solve(self, model: Model, scenario: Scenario, progress: Progress = silent) -> Deformation:
        """Deformation through all stages; a solve that fails is told by its status, not by an exception."""


class PreparedRegistration(Protocol):
    """A model that is ready to be fitted to what is seen, again and again."""

    def register(
        self, observations: Observations, last: Registered | None = None, progress: Progress = silent
    ) -> Registered:
        """The model as the observations have it; what they do not determine is told by the status.

        Args:
            observations: in the frame "patient", or in another of which nothing is known.
            last: an answer to begin from; without it the organ is looked for everywhere.
            progress: told how far it is.

        Raises:
            BadInput: the observations cannot be of this model, or `last` is not.
            StageFailed: the organ does not come to rest on what was seen.
        """


class Registration(Technique, Protocol):
    """Deforms a model to fit what was seen (entry-point group `glisson.registrations`)."""

    def prepare(
        self, model: Model, scenario: Scenario | None = None, progress: Progress = silent
    ) -> PreparedRegistration:
        """What is done once, before surgery.

        Args:
            model: in its scanned shape.
            scenario: what is planned to be done to the organ; only some techniques need it.
            progress: told how far it is.

        Raises:
            BadInput: the model, or the scenario, is not what the technique needs.
        """


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """Points of a surface in the frame "room".

    `status` is "ambiguous" where measurements contradict each other, as `notes` say in sentences; `parallax_rad` is the
    median angle between the views at the points.
    """

    observations: Observations
    status: Status
    notes: tuple[str, ...]
    parallax_rad: float


class SurfaceReconstructor(Technique, Protocol):
    """Makes surface points of laparoscope views (entry-point group `glisson.surface_reconstructors`)."""

    def reconstruct(self, views: ViewSet, progress: Progress = silent) -> Reconstruction:
        """Points with covariance.

        Raises:
            BadInput: something is missing that the technique needs.
            StageFailed: the views are too close to each other (unobservable), or cannot be brought together.
        """


class Localiser(Technique, Protocol):
    """Finds where a trocar is from an image of its camera (entry-point group `glisson.localisers`)."""

    def localise(self, image: NDArray[np.uint8], camera: Camera, layout: CrossLayout) -> Localisation:
        """The pose of the trocar in the room; what stands against it is told by the status.

        Args:
            image: [row, column, red green blue].
            camera: has taken it.
            layout: crosses that hang in the room.

        Raises:
            BadInput: the image has another size than the camera's.
        """


class InstrumentRecogniser(Technique, Protocol):
    """Tells which instrument is in a trocar, and where (entry-point group `glisson.instrument_recognisers`)."""

    def recognise(self, image: NDArray[np.uint8], trocar: Trocar, library: InstrumentLibrary) -> SeenInstrument:
        """The instrument in an image (h, w, 3) of the trocar's camera.

        Raises:
            BadInput: the image is not of the camera's size.
            StageFailed: none is seen (unobservable), which one or where is in doubt (ambiguous), or what is seen
                cannot be: a code that is not in the library, a mirrored image, a wheel of another size (bad_input).
        """


class MarkerTracker(Technique, Protocol):
    """Follows markers through a video (entry-point group `glisson.marker_trackers`)."""

    def track(self, frames: Iterable[tuple[float, NDArray[np.uint8]]], markers_px: FloatArray) -> Tracks:
        """Tracks in px.

        Args:
            frames: times (s) and pictures [row, column, red green blue], taken one after another.
            markers_px: places (m, 2), u right and v down, in the first of them.

        Raises:
            BadInput: a marker that is outside the image.
            StageFailed: there are fewer than two frames.
        """
