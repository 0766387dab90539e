"""Stages that tell of the organ's inner anatomy, beside those that lead to the report: vessels."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.image import LabelMap, Volume
from glisson.core.protocols import Progress
from glisson.framework.case import ORGAN, SCAN, SETTINGS, STRUCTURES, VESSEL_TREES, VESSELS, Case
from glisson.framework.preoperative_stages import labels_of
from glisson.framework.settings import Settings
from glisson.framework.stage import Stage
from glisson.io.images import read_labels, read_volume, write_labels
from glisson.io.vessel_files import write_vessels
from glisson.preoperative.vessels.contrast import require_contrast
from glisson.preoperative.vessels.systems import SYSTEMS, UNTOLD, VesselSystems, given_systems, split_systems


class VesselsStage(Stage):
    """Portal and hepatic veins inside the liver as label map and rooted trees.

    Where the case's structures hold both veins, these are taken; where they hold "vessels", these are told apart; else
    vessels are found in the scan.
    """

    name = "vessels"
    inputs = (SCAN, ORGAN, STRUCTURES)
    outputs = (VESSELS, VESSEL_TREES)
    packages = ("glisson.preoperative",)

    def settings(self, settings: Settings) -> Mapping[str, Any]:
        """Parameters of the vessel segmenter, and the clicks."""
        choice = settings.choices["vessels"]
        return asdict(choice.all_parameters(SETTINGS, settings.seed)) | asdict(settings.vessels)

    def techniques(self, settings: Settings) -> Sequence[tuple[str, str]]:
        """The vessel segmenter."""
        return [("vessel-segmenter", settings.choices["vessels"].technique)]

    def run(self, case: Case, settings: Settings, out: Path, progress: Progress) -> Mapping[str, Any]:
        """Find and tell apart; facts: where the vessels are from, volumes, lengths, roots, and notes for people."""
        organ, given = read_labels(case.path(ORGAN)), labels_of(case, STRUCTURES)
        present = set() if given is None else set(given.names.values())
        clicks = _clicks(settings)
        if given is not None and present.issuperset(SYSTEMS):
            systems, source = given_systems(given, organ, clicks), STRUCTURES
        elif given is not None and UNTOLD in present:
            systems, source = split_systems(given.mask(UNTOLD), organ, clicks), STRUCTURES
        else:
            volume, source = read_volume(case.path(SCAN)), settings.choices["vessels"].technique
            systems = split_systems(_found(volume, organ, settings, progress), organ, clicks)
        write_labels(out / VESSELS, systems.labels)
        write_vessels(out / VESSEL_TREES, systems.trees)
        return {"source": source, **_facts(systems)}


def _clicks(settings: Settings) -> dict[str, FloatArray]:
    clicks = {"portal": settings.vessels.portal_mm, "hepatic": settings.vessels.hepatic_mm}
    return {name: np.array(points) for name, points in clicks.items() if points}


def _found(volume: Volume, organ: LabelMap, settings: Settings, progress: Progress) -> NDArray[np.bool_]:
    technique = settings.choices["vessels"].make(SETTINGS, settings.seed)
    found: LabelMap = technique.find(volume, organ, progress)
    if not volume.grid.matches(found.grid) or "vessel" not in found.names.values():
        raise BadInput(f"The technique {technique.name!r} did not give a label 'vessel' on the scan's grid.")
    mask = found.mask("vessel")
    require_contrast(volume, organ, mask)
    return mask


def _facts(systems: VesselSystems) -> dict[str, Any]:
    return {
        "volume_ml": {name: systems.labels.volume_ml(name) for name in systems.labels.names.values()},
        "length_mm": {tree.name: tree.length_mm for tree in systems.trees},
        "roots": {name: root.points_mm.tolist() for name, root in systems.roots.items()},
        "notes": list(systems.notes),
    }
