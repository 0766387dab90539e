"""Mask folders as the 3D-IRCADb collection has them: one DICOM series for each structure (Soler et al. 2010)."""

from pathlib import Path

from glisson.core import BadInput, LabelMap
from glisson.io.dicom import has_dicom, read_dicom_mask
from glisson.io.label_names import canonical_names


def read_mask_folders(path: str | Path) -> tuple[LabelMap, ...]:
    """One label map for each folder within `path`, named after it ("livertumor01" is "tumour1").

    They are several because structures overlap: the liver's mask contains its tumours and vessels.

    Raises:
        BadInput: there is no mask folder, or one cannot be read.
    """
    folder = Path(path)
    if not folder.is_dir():
        raise BadInput(f"{folder} is not a folder of mask folders.")
    folders = [entry for entry in sorted(folder.iterdir()) if entry.is_dir() and has_dicom(entry)]
    if not folders:
        raise BadInput(f"{folder} holds no folder with DICOM masks.")
    maps = []
    for name, inner in zip(canonical_names(entry.name for entry in folders), folders, strict=True):
        image = read_dicom_mask(inner)
        maps.append(LabelMap(image.voxels, image.grid, {1: name}))
    return tuple(maps)
