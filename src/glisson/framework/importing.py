"""A new case from a scan and label maps of any origin; nothing that identifies the patient comes along.

Only voxels, geometry and the names of known structures are taken over. A label whose name is not known
is left out, since a name that somebody typed may be a patient's.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from glisson.core.errors import BadInput
from glisson.core.image import LabelMap, Volume
from glisson.framework.case import ORGAN, SCAN, STRUCTURES, TUMOURS, Case, new_case, open_case
from glisson.framework.settings import GIVEN_LABELS, Settings
from glisson.io.burned_in import burned_in_text
from glisson.io.images import read_label_maps, read_volume, write_labels, write_volume
from glisson.io.label_groups import group_labels, on_grid_of
from glisson.io.label_names import canonical_name, is_canonical
from glisson.io.totalsegmentator import class_names
from glisson.preoperative.artefacts.metal import metal_warnings
from glisson.preoperative.imaging.scan_checks import scan_warnings

GROUP_FILES = {"organ": ORGAN, "tumours": TUMOURS, "structures": STRUCTURES}
"""Label group → its file in the case folder."""

_ALSO_KNOWN = {"bone", "skin"}


@dataclass(frozen=True)
class Imported:
    """A new case, the label names it has, how many labels were left out for their unknown names, and warnings.

    `warnings` are sentences: on text that seems to be drawn into the pixels, and on what makes the scan less useful.
    """

    case: Case
    labels: tuple[str, ...]
    left_out: int
    warnings: tuple[str, ...]


def import_case(
    folder: str | Path,
    scan: str | Path,
    labels: Sequence[str | Path] = (),
    scheme: str | None = None,
    settings: Settings | None = None,
    series: str | None = None,
) -> Imported:
    """Make a case folder from a scan and label maps.

    Args:
        folder: the case folder to make.
        scan: a DICOM folder, NIfTI or NRRD file.
        labels: label maps whose voxels lie on the scan's: files, a folder of such files, a DICOM mask folder, or
            a folder of DICOM mask folders as of IRCAD.
        scheme: how label files without names are numbered ("totalsegmentator").
        settings: those of the case; the segmenter becomes "labels" where the liver is among the labels.
        series: which series of a DICOM folder (its UID), where it holds several.

    Raises:
        BadInput: something cannot be read, lies on another grid, or a label map has no known name.
        WriteFailed: the disk is full.
    """
    volume = read_volume(scan, series)
    known, left_out = _known_labels(labels, scheme, volume)
    groups = group_labels(known)
    used = settings or Settings()
    if "organ" in groups:
        used = used.choosing("segment", GIVEN_LABELS, {})
    with new_case(folder, used) as making:
        write_images(making, volume, groups)
    names = tuple(name for group in groups.values() for name in group.names.values())
    text = burned_in_text(scan, volume)
    warnings = (*(() if text is None else (text,)), *scan_warnings(volume), *metal_warnings(volume))
    return Imported(open_case(folder), names, left_out, warnings)


def write_images(folder: Path, volume: Volume, groups: Mapping[str, LabelMap]) -> None:
    """Write a scan and label groups ("organ", "tumours", "structures") to their places in a case folder.

    Raises:
        WriteFailed: the disk is full.
    """
    (folder / SCAN).parent.mkdir()
    write_volume(folder / SCAN, volume)
    for name, group in groups.items():
        (folder / GROUP_FILES[name]).parent.mkdir(exist_ok=True)
        write_labels(folder / GROUP_FILES[name], group)


def _known_labels(paths: Sequence[str | Path], scheme: str | None, volume: Volume) -> tuple[list[LabelMap], int]:
    known: list[LabelMap] = []
    left_out = 0
    for path in paths:
        maps = read_label_maps(path, scheme)
        kept = [named for labels in maps if (named := _with_known_names(labels)).names]
        if not kept:
            raise BadInput(
                f"{path} has no label of a name that Glisson knows; name them liver, tumour1, portal, hepatic, duct "
                "and so on, in the file or by the file's name."
            )
        placed = [on_grid_of(volume, labels, f"the label map {path}") for labels in kept]
        left_out += sum(len(labels.names) for labels in maps) - sum(len(labels.names) for labels in kept)
        known += placed
    return known, left_out


def _with_known_names(labels: LabelMap) -> LabelMap:
    names = {number: name for number, name in labels.names.items() if _is_known(name)}
    return LabelMap(labels.voxels, labels.grid, names)


def _is_known(name: str) -> bool:
    canonical = {canonical_name(other) for other in class_names().values()}
    return is_canonical(name) or name in _ALSO_KNOWN or name in canonical
