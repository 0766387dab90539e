"""Scans and labels handed to and taken from another program, as NIfTI files."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glisson.core.errors import StageFailed
from glisson.core.image import Grid, Volume
from glisson.core.status import Status


def write_scan(path: Path, volume: Volume) -> None:
    """Write the scan; the file's name ends in .nii.gz."""
    import SimpleITK as sitk  # slow to load, and `--help` needs the plug-ins

    image = sitk.GetImageFromArray(volume.voxels.T)  # SimpleITK counts the slowest axis first, and in LPS as we do
    image.SetSpacing(volume.grid.spacing_mm.tolist())
    image.SetOrigin(volume.grid.origin_mm.tolist())
    image.SetDirection(volume.grid.direction.ravel().tolist())
    sitk.WriteImage(image, str(path))


def read_found(path: Path, grid: Grid, program: str) -> NDArray[Any]:
    """The voxels [i, j, k] that a program wrote, on the scan's grid.

    Raises:
        StageFailed: they lie on another grid.
    """
    import SimpleITK as sitk

    image = sitk.ReadImage(str(path))
    direction = np.reshape(image.GetDirection(), (3, 3))
    found = Grid(image.GetSize(), np.array(image.GetSpacing()), np.array(image.GetOrigin()), direction)
    # NIfTI keeps places with the precision of float32.
    if not grid.matches(found, tolerance_mm=0.01):
        raise StageFailed(f"{program} gave a mask on another grid than the scan's.", Status.STAGNATED)
    voxels: NDArray[Any] = sitk.GetArrayFromImage(image).T
    return voxels
