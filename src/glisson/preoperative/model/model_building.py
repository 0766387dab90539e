"""From label maps to the organ's mechanical model: surface, tetrahedra, regions, attachments, structures."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.errors import BadInput, StageFailed
from glisson.core.image import LabelMap
from glisson.core.mesh import TetMesh
from glisson.core.model import Capsule, Material, Model, Rod
from glisson.core.protocols import Mesher, Progress, SurfaceExtractor, silent
from glisson.core.status import Status
from glisson.preoperative.imaging.borders import touched_borders
from glisson.preoperative.imaging.components import single_part
from glisson.preoperative.meshing.mesh_quality import MeshQuality, mesh_quality
from glisson.preoperative.model.attachments import DEFAULT_ATTACHMENTS, Attachment, ligaments, node_sets
from glisson.preoperative.model.material_presets import HUMAN_LIVER
from glisson.preoperative.model.refinements import Refinement, fine_zones
from glisson.preoperative.model.regions import ORGAN, element_regions
from glisson.preoperative.model.structures import build_structures

LARGEST_VOLUME_ERROR = 0.01
"""A mesh whose volume differs by more than this fraction from the organ's mask is refused."""

TUMOUR_STIFFENING = 3.0
"""Stiffness of a tumour over that of the liver where no material is given.

Elastography by magnetic resonance found 10.1 kPa in malignant tumours, 2.7 kPa in benign ones and 2.3 kPa
in healthy liver (Venkatesh et al. 2008, AJR 190:1534): ratios of 4.4 and 1.2.
"""

TUMOURS = "tumours"
"""Key of the material of all tumours that have none of their own."""


@dataclass(frozen=True)
class ModelSettings:
    """What a person decides about the model.

    `materials` is by region: "liver", the name of a tumour, or "tumours" for all tumours that are not
    named. Without an entry for tumours they are the liver's material, three times as stiff.
    """

    materials: Mapping[str, Material] = field(default_factory=lambda: {ORGAN: HUMAN_LIVER})
    attachments: tuple[Attachment, ...] = DEFAULT_ATTACHMENTS
    refinements: tuple[Refinement, ...] = ()
    capsule: Capsule | None = None
    rod: Rod | None = None

    def __post_init__(self) -> None:
        if ORGAN not in self.materials:
            raise BadInput(f"The model needs a material for {ORGAN!r}; it has {sorted(self.materials)}.")
        object.__setattr__(self, "materials", MappingProxyType(dict(self.materials)))

    def material_of(self, region: str) -> Material:
        """The material of a region by its name."""
        liver = self.materials[ORGAN]
        stiffer = replace(liver, young_modulus_kpa=TUMOUR_STIFFENING * liver.young_modulus_kpa)
        return self.materials.get(region, self.materials.get(TUMOURS, stiffer))


@dataclass(frozen=True)
class MeshReport:
    """What is to be said of a model's mesh.

    `volume_error` is mesh over mask less 1; `region_elements` counts the elements of each region;
    `notes` are sentences for people.
    """

    quality: MeshQuality
    mask_volume_ml: float
    volume_error: float
    region_elements: Mapping[str, int]
    notes: tuple[str, ...] = ()


def build_model(
    organ: LabelMap,
    tumours: LabelMap | None,
    structures: LabelMap | None,
    extractor: SurfaceExtractor,
    mesher: Mesher,
    settings: ModelSettings,
    progress: Progress = silent,
) -> tuple[Model, MeshReport]:
    """The model of an organ from its label groups.

    Args:
        organ: the whole organ as label "liver", with its tumours and vessels.
        tumours: one label for each tumour, or None.
        structures: vessels, duct, wire and others by canonical names, or None.
        extractor: makes the organ's surface.
        mesher: makes the T4 mesh.
        settings: materials, attachments and refinements.
        progress: told how far it is.

    Raises:
        BadInput: the label maps do not fit each other, the organ is empty or in parts, a tumour lies
            outside it, or an attachment holds nothing.
        StageFailed: no mesh, or one whose volume is not within 1 % of the mask's.
    """
    for labels in (tumours, structures):
        if labels is not None and not organ.grid.matches(labels.grid):
            raise BadInput("The label maps of organ, tumours and structures lie on different grids; resample them.")
    part, crumbs = single_part(organ.mask(ORGAN), organ.grid, ORGAN)
    whole = ndimage.binary_fill_holes(part)
    progress(0.0, "surface")
    surface = extractor.extract(whole, organ)
    progress(0.1, "tetrahedra")
    zones = fine_zones(settings.refinements, tumours)
    mesh = mesher.mesh(surface, lambda _, message: progress(0.1, message), zones)
    volume_ml = float(whole.sum()) * organ.grid.voxel_volume_mm3 * 1e-3
    _require_volume(mesh, volume_ml)
    progress(0.8, "regions and structures")
    regions, names = element_regions(mesh, tumours)
    _require_regions(settings, {*names.values(), *(() if tumours is None else tumours.names.values())})
    mesh = TetMesh(mesh.nodes, mesh.tetrahedra, regions)
    model = Model(
        mesh=mesh,
        materials={number: settings.material_of(name) for number, name in names.items()},
        region_names=names,
        node_sets=node_sets(mesh, settings.attachments),
        structures=build_structures(LabelMap(whole.astype(np.uint8), organ.grid, {1: ORGAN}), tumours, structures),
        capsule=settings.capsule,
        rod=settings.rod,
        ligaments=ligaments(settings.attachments),
    )
    notes = [f"A separate crumb of the mask was left out: {crumb.place}." for crumb in crumbs[:5]]
    notes += [border.sentence for border in touched_borders(whole)] + _tumour_notes(model, tumours)
    counts = {name: int((regions == number).sum()) for number, name in names.items()}
    report = MeshReport(mesh_quality(mesh), volume_ml, mesh.volume_mm3 * 1e-3 / volume_ml - 1.0, counts, tuple(notes))
    return model, report


def _require_regions(settings: ModelSettings, known: set[str]) -> None:
    unknown = sorted(set(settings.materials) - known - {ORGAN, TUMOURS})
    if unknown:
        raise BadInput(f"There is no region {unknown[0]!r} to be of a material; there are {sorted(known)}.")


def _require_volume(mesh: TetMesh, mask_ml: float) -> None:
    error = mesh.volume_mm3 * 1e-3 / mask_ml - 1.0
    if abs(error) > LARGEST_VOLUME_ERROR:
        raise StageFailed(
            f"The mesh's volume is {100.0 * error:+.1f} % off the mask's {mask_ml:.0f} ml; choose a finer surface "
            "(edge_length_mm, smoothing_voxels) or mesh (envelope_mm).",
            Status.STAGNATED,
        )


def _tumour_notes(model: Model, tumours: LabelMap | None) -> list[str]:
    if tumours is None:
        return []
    notes = []
    present = np.unique(model.mesh.region_numbers)
    for number, name in sorted(tumours.names.items()):
        mask: NDArray[np.bool_] = tumours.voxels == number
        if not mask.any():
            notes.append(f"The label {name!r} is empty and was left out.")
            continue
        if number not in present:
            notes.append(f"{name!r} is smaller than the elements around it, so it is not stiffer than the liver.")
        pieces = int(ndimage.label(mask)[1])
        if pieces > 1:
            notes.append(f"{name!r} consists of {pieces} separate pieces and is treated as one tumour.")
    return notes
