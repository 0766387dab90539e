"""Tumours, gallbladder, wire and stent marked in a case by clicks, and taken away again."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glisson.core.errors import BadInput
from glisson.core.image import Grid, LabelMap
from glisson.core.protocols import Progress, StructureSegmenter, silent
from glisson.core.registry import make_technique
from glisson.framework.case import ORGAN, SCAN, STRUCTURES, TUMOURS, Case
from glisson.framework.comparing import named_mask
from glisson.framework.preoperative_stages import labels_of
from glisson.framework.segmentation_scores import SegmentationScores, segmentation_scores
from glisson.framework.stages import PIPELINE
from glisson.io.images import read_labels, read_volume, write_labels
from glisson.io.stored_image import whole_type
from glisson.preoperative.structures.kinds import TUMOUR, kind_of

BY_THRESHOLD = "threshold"


@dataclass(frozen=True)
class Marked:
    """The file that holds the label, its volumes before and after in ml, and what a person should look at."""

    file: Path
    before_ml: float
    after_ml: float
    notes: tuple[str, ...] = ()


def mark_structure(
    case: Case,
    name: str,
    clicks_mm: Sequence[tuple[float, float, float]],
    technique: str = BY_THRESHOLD,
    parameters: Mapping[str, Any] | None = None,
    progress: Progress = silent,
) -> Marked:
    """Mark a structure in the case's labels, in the place of an earlier one of that name.

    The file before stays beside the new one, named `previous-…`. All other labels stay as they are, but that a wire or
    stent takes the voxels of what it lies in.

    Args:
        case: the case; stages that read the labels are out of date then.
        name: "tumour1", "tumour2", …, "gallbladder", "wire" or "stent".
        clicks_mm: clicks into it (x, y, z), LPS mm.
        technique: of the kind structure-segmenter.
        parameters: of the technique.
        progress: told how far it is.

    Raises:
        BadInput: the name, a click or the labels in the case cannot be used.
        StageFailed: nothing was found, or more than the structure.
        WriteFailed: the disk is full.
    """
    maker: StructureSegmenter = make_technique("structure-segmenter", technique, parameters or {}, "--technique")
    file = _file_of(name)
    case.check_writable()
    progress(0.0, "reading the scan")
    volume = read_volume(case.path(SCAN))
    before, organ = labels_of(case, file), labels_of(case, ORGAN)
    found = maker.mark(volume, organ, name, np.array(clicks_mm, dtype=np.float64), progress)
    mask = _checked(found.labels, volume.grid, name, technique)
    after, taken = _with_label(before, volume.grid, name, mask)
    PIPELINE.replace(case, file, lambda path: write_labels(path, after))
    return Marked(case.path(file), _volume_ml(before, name), after.volume_ml(name), (*found.notes, *taken))


def remove_structure(case: Case, name: str) -> Marked:
    """Take a structure out of the case's labels; the file before stays beside the new one, named `previous-…`.

    Raises:
        BadInput: the case has no such label.
        WriteFailed: the disk is full.
    """
    file = _file_of(name)
    before = labels_of(case, file)
    if before is None or name not in before.names.values():
        raise BadInput(f"The case has no label {name!r} to remove.")
    voxels = np.where(before.mask(name), 0, before.voxels)
    names = {number: other for number, other in before.names.items() if other != name}
    after = LabelMap(voxels.astype(before.voxels.dtype), before.grid, names)
    PIPELINE.replace(case, file, lambda path: write_labels(path, after))
    return Marked(case.path(file), before.volume_ml(name), 0.0)


def compare_structure(case: Case, name: str, reference: str | Path) -> SegmentationScores:
    """Scores of a marked structure against a mask: a label map with its name, or one with a single label.

    Raises:
        BadInput: the mask cannot be read, has several labels and none of that name, or lies on another grid.
    """
    found = read_labels(case.path(_file_of(name)))
    return segmentation_scores(found.mask(name), named_mask(reference, found.grid, name, "the reference"), found.grid)


def _file_of(name: str) -> str:
    return TUMOURS if kind_of(name) is TUMOUR else STRUCTURES


def _checked(labels: LabelMap, grid: Grid, name: str, technique: str) -> NDArray[np.bool_]:
    """The mask of a technique, maybe a plug-in's, which must be on the scan's grid and not empty."""
    if not labels.grid.matches(grid) or name not in labels.names.values() or not labels.mask(name).any():
        raise BadInput(f"The technique {technique!r} did not give {name!r} on the scan's grid.")
    return labels.mask(name)


def _with_label(
    before: LabelMap | None, grid: Grid, name: str, mask: NDArray[np.bool_]
) -> tuple[LabelMap, tuple[str, ...]]:
    """The labels with one put in anew, and a sentence on what overlaps.

    Metal is thin and would vanish in what it lies in, so it takes voxels; all else leaves other labels theirs.
    """
    if before is None:
        return LabelMap(mask.astype(np.uint8), grid, {1: name}), ()
    names = dict(before.names)
    number = next((known for known, other in names.items() if other == name), max(names, default=0) + 1)
    cleared = np.where(before.voxels == number, 0, before.voxels)
    shared = mask & (cleared > 0)
    put = mask if kind_of(name).is_metal else mask & ~shared
    if not put.any():
        raise BadInput(f"What was clicked is {_listed(before, shared)} already; remove that first with --remove.")
    voxels = cleared.astype(whole_type(0, max(number, int(before.voxels.max()))))
    voxels[put] = number
    told: tuple[str, ...] = ()
    if shared.any():
        verb = "took them over" if kind_of(name).is_metal else "left them there"
        told = (f"{int(shared.sum())} voxels of {name} were {_listed(before, shared)}; it {verb}.",)
    return LabelMap(voxels, before.grid, names | {number: name}), told


def _listed(labels: LabelMap, where: NDArray[np.bool_]) -> str:
    return ", ".join(labels.names[int(number)] for number in np.unique(labels.voxels[where]))


def _volume_ml(labels: LabelMap | None, name: str) -> float:
    return labels.volume_ml(name) if labels is not None and name in labels.names.values() else 0.0
