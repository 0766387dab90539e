"""The stages before surgery: segment → mesh → scenario."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from glisson.core.errors import BadInput
from glisson.core.fine_zone import FineZone
from glisson.core.image import LabelMap
from glisson.core.mesh import TetMesh, TriangleSurface
from glisson.core.protocols import Progress, Segmentation, silent
from glisson.framework.case import MODEL, ORGAN, SCAN, SCENARIO, SETTINGS, STRUCTURES, TUMOURS, Case
from glisson.framework.provenance import read_record
from glisson.framework.settings import GIVEN_LABELS, Settings
from glisson.framework.stage import Stage
from glisson.io.images import read_labels, read_volume, write_labels
from glisson.io.model_files import read_model, write_model
from glisson.io.scenario_files import write_scenario
from glisson.preoperative.model.model_building import MeshReport, ModelSettings, build_model
from glisson.preoperative.model.regions import ORGAN as LIVER
from glisson.preoperative.scenario.manoeuvre import propose_scenario


class SegmentStage(Stage):
    """The liver's mask: found in the scan, or checked and cleaned where a label map was given."""

    name = "segment"
    inputs = (SCAN, TUMOURS)
    outputs = (ORGAN,)
    packages = ("glisson.preoperative",)
    editable = True

    def settings(self, settings: Settings) -> Mapping[str, Any]:
        """Parameters of the segmenter, and the clicks."""
        choice = settings.choices["segment"]
        return asdict(choice.all_parameters(SETTINGS, settings.seed)) | asdict(settings.segment)

    def techniques(self, settings: Settings) -> Sequence[tuple[str, str]]:
        """The segmenter."""
        return [("segmenter", settings.choices["segment"].technique)]

    def works_on_given(self, settings: Settings) -> bool:
        """Only the technique for given labels does."""
        return settings.choices["segment"].technique == GIVEN_LABELS

    def run(self, case: Case, settings: Settings, out: Path, progress: Progress) -> Mapping[str, Any]:
        """Segment; facts: `volume_ml`, `flagged_slices` and the reasons for them."""
        segmenter = settings.choices["segment"].make(SETTINGS, settings.seed)
        labels = labels_of(case, ORGAN if self.works_on_given(settings) else TUMOURS)
        seeds = np.array(settings.segment.seed_points_mm, dtype=np.float64).reshape(-1, 3)
        volume = read_volume(case.path(SCAN))
        found: Segmentation = segmenter.segment(volume, labels, seeds, progress)
        if not volume.grid.matches(found.labels.grid) or LIVER not in found.labels.names.values():
            raise BadInput(f"The technique {segmenter.name!r} did not give a label {LIVER!r} on the scan's grid.")
        write_labels(out / ORGAN, found.labels)
        return {
            "volume_ml": found.labels.volume_ml(LIVER),
            "flagged_slices": [int(k) for k, _ in found.flagged_slices],
            "flags": [[int(k), reason] for k, reason in found.flagged_slices],
        }


class MeshStage(Stage):
    """The organ's model: surface, tetrahedra, materials, attachments, embedded structures."""

    name = "mesh"
    inputs = (ORGAN, TUMOURS, STRUCTURES)
    outputs = (MODEL,)
    packages = ("glisson.preoperative",)

    def settings(self, settings: Settings) -> Mapping[str, Any]:
        """Parameters of surface extractor and mesher, refinements, materials and attachments."""
        materials = {name: asdict(material) for name, material in settings.materials.items()}
        attachments = [asdict(attachment) for attachment in settings.attachments]
        return self._tetrahedra_settings(settings) | {
            "materials": materials,
            "attachments": attachments,
            "capsule": asdict(settings.capsule),
            "rod": asdict(settings.rod),
        }

    def techniques(self, settings: Settings) -> Sequence[tuple[str, str]]:
        """Surface extractor and mesher."""
        return [(settings.choices[name].kind, settings.choices[name].technique) for name in ("surface", "mesh")]

    def run(self, case: Case, settings: Settings, out: Path, progress: Progress) -> Mapping[str, Any]:
        """Build the model; facts: the mesh's quality and notes for people.

        The tetrahedra are kept where the organ and the techniques are those they were made from: a mesher
        may draw random numbers, and a change of material should not change the mesh.
        """
        if not case.has(ORGAN):
            raise BadInput(f"The case has no liver mask {ORGAN}; run: glisson segment {case.folder}.")
        organ, tumours, structures = (labels_of(case, name) for name in (ORGAN, TUMOURS, STRUCTURES))
        assert organ is not None  # was looked for above
        made_from = self._tetrahedra_basis(case, settings)
        before = read_record(case.path(self.record_name))
        mesher = settings.choices["mesh"].make(SETTINGS, settings.seed)
        if before is not None and before.facts.get("tetrahedra_from") == made_from and case.has(MODEL):
            mesher = _KeptTetrahedra(read_model(case.path(MODEL)).mesh)
        extractor = settings.choices["surface"].make(SETTINGS, settings.seed)
        model_settings = ModelSettings(
            settings.materials,
            settings.attachments,
            settings.refinements,
            settings.capsule.made(),
            settings.rod.made(),
        )
        model, report = build_model(organ, tumours, structures, extractor, mesher, model_settings, progress)
        write_model(out / MODEL, model)
        return _mesh_facts(report) | {"tetrahedra_from": made_from}

    def _tetrahedra_settings(self, settings: Settings) -> dict[str, Any]:
        chosen = {
            name: asdict(settings.choices[name].all_parameters(SETTINGS, settings.seed)) for name in ("surface", "mesh")
        }
        return chosen | {"refinements": [asdict(refinement) for refinement in settings.refinements]}

    def _tetrahedra_basis(self, case: Case, settings: Settings) -> dict[str, Any]:
        basis = self.basis(case, settings)
        plain = {
            "organ": basis.inputs.get(ORGAN),
            "tumours": basis.inputs.get(TUMOURS) if settings.refinements else None,
            "settings": self._tetrahedra_settings(settings),
            "techniques": basis.techniques,
            "source": basis.source,
        }
        return dict(json.loads(json.dumps(plain)))


class _KeptTetrahedra:
    """A mesher that gives the tetrahedra that are there already."""

    def __init__(self, mesh: TetMesh) -> None:
        self._mesh = mesh

    def mesh(self, surface: TriangleSurface, progress: Progress = silent, finer: Sequence[FineZone] = ()) -> TetMesh:
        """The kept mesh; the surface is the one that it was made from."""
        return self._mesh


class ScenarioStage(Stage):
    """A manoeuvre for people to change: board under the organ, lever under the left lobe, two stages."""

    name = "scenario"
    inputs = (MODEL,)
    outputs = (SCENARIO,)
    packages = ("glisson.preoperative",)
    editable = True

    def settings(self, settings: Settings) -> Mapping[str, Any]:
        """The lever, and how far it goes."""
        return asdict(settings.scenario)

    def run(self, case: Case, settings: Settings, out: Path, progress: Progress) -> Mapping[str, Any]:
        """Propose the lever lift of the dissertation's chapter 4."""
        write_scenario(out / SCENARIO, propose_scenario(read_model(case.path(MODEL)), settings.scenario))
        return {}


def _mesh_facts(report: MeshReport) -> dict[str, Any]:
    return {
        **asdict(report.quality),
        "mask_volume_ml": report.mask_volume_ml,
        "volume_error": report.volume_error,
        "region_elements": dict(report.region_elements),
        "notes": list(report.notes),
    }


def labels_of(case: Case, name: str) -> LabelMap | None:
    """One of the case's label maps; None where there is none."""
    return read_labels(case.path(name)) if case.has(name) else None
