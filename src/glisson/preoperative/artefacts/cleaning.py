"""A CT with the streaks of its metal and gas lessened, and what is lost all the same, in sentences."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.image import Volume
from glisson.core.protocols import Progress, silent
from glisson.geometry.distance_map import distance_inside
from glisson.preoperative.artefacts.metal import metal_voxels, without_metal_streaks
from glisson.preoperative.artefacts.streaks import Streaks, find_streaks, gas_voxels, without_streaks
from glisson.preoperative.imaging.axial import slice_axis, slices_text
from glisson.preoperative.imaging.scan_checks import require_hu

_LOST_MM = 5.0
"""So near to metal no value can be trusted: it blooms, and its own rays are guessed."""

_NEAR_MM = 50.0


@dataclass(frozen=True, eq=False)
class CleanedScan:
    """A scan with fewer streaks.

    `lost` are the voxels [i, j, k] whose values mean nothing, `metal_ml` and `streaked_ml` volumes of metal and of
    tissue that was streaked, `metal_change_hu` the root mean square of what was changed in the soft tissue within
    50 mm of metal, and `sentences` say it all to people. Nothing was found where `sentences` is empty.
    """

    volume: Volume
    lost: NDArray[np.bool_]
    metal_ml: float
    metal_change_hu: float
    streaked_ml: float
    sentences: tuple[str, ...]


def cleaned_scan(volume: Volume, progress: Progress = silent) -> CleanedScan:
    """Lessen the streaks of metal and gas in a CT.

    Args:
        volume: the CT.
        progress: told how far it is.

    Raises:
        BadInput: the scan is no CT, or its values are no HU.
    """
    if volume.modality != "CT":
        raise BadInput("The scan is an MR; only in a CT do metal and gas make streaks that can be lessened.")
    require_hu(volume)
    axis = slice_axis(volume.grid)
    hu = np.moveaxis(np.asarray(volume.voxels, dtype=np.float32), axis, 2).copy()
    spacing_mm = np.append(np.delete(volume.grid.spacing_mm, axis), volume.grid.spacing_mm[axis])
    voxel_ml = volume.grid.voxel_volume_mm3 * 1e-3
    progress(0.0, "metal")
    metal = metal_voxels(hu)
    change_hu = _take_metal_streaks(hu, metal, spacing_mm, progress)
    progress(0.8, "streaks of gas")
    streaks = find_streaks(hu, metal | gas_voxels(hu), spacing_mm)
    if streaks is not None:
        hu = without_streaks(hu, streaks)
    lost = metal if not metal.any() else distance_inside(~metal, spacing_mm) <= _LOST_MM
    sentences = _metal_sentences(metal, lost, change_hu, voxel_ml) + _streak_sentences(streaks, voxel_ml)
    voxels = np.moveaxis(hu, 2, axis)
    if volume.voxels.dtype.kind in "iu":
        limits = np.iinfo(volume.voxels.dtype)
        voxels = np.clip(np.rint(voxels), limits.min, limits.max)
    return CleanedScan(
        volume=Volume(np.ascontiguousarray(voxels.astype(volume.voxels.dtype)), volume.grid, volume.modality),
        lost=np.moveaxis(lost, 2, axis),
        metal_ml=float(metal.sum()) * voxel_ml,
        metal_change_hu=change_hu,
        streaked_ml=0.0 if streaks is None else float(streaks.where.sum()) * voxel_ml,
        sentences=sentences,
    )


def _take_metal_streaks(
    hu: NDArray[np.float32], metal: NDArray[np.bool_], spacing_mm: FloatArray, progress: Progress
) -> float:
    """Take the streaks of metal out of `hu`, and tell how much that changed the soft tissue near by (HU)."""
    count = int(metal.any(axis=(0, 1)).sum())
    squares, voxels = 0.0, 0
    for done, (k, after) in enumerate(without_metal_streaks(hu, metal, spacing_mm), start=1):
        before = hu[:, :, k]
        apart = distance_inside(~metal[:, :, k : k + 1], spacing_mm)[:, :, 0]
        near = (apart > _LOST_MM) & (apart < _NEAR_MM) & (np.abs(before) < 300.0)
        squares += float(((after - before)[near] ** 2).sum())
        voxels += int(near.sum())
        hu[:, :, k] = after
        progress(0.8 * done / count, f"slice {done} of {count} with metal")
    return float(np.sqrt(squares / voxels)) if voxels else 0.0


def _metal_sentences(
    metal: NDArray[np.bool_], lost: NDArray[np.bool_], change_hu: float, voxel_ml: float
) -> tuple[str, ...]:
    if not metal.any():
        return ()
    return (
        f"Metal ({metal.sum() * voxel_ml:.2g} ml) in {slices_text(metal, 2)} streaks the scan: {change_hu:.0f} HU were "
        f"taken out within {_NEAR_MM:.0f} mm of it (root mean square), some streaks remain.",
        f"Within {_LOST_MM:.0f} mm of metal ({lost.sum() * voxel_ml:.1f} ml) no value can be trusted: a border there "
        "is a guess.",
    )


def _streak_sentences(streaks: Streaks | None, voxel_ml: float) -> tuple[str, ...]:
    if streaks is None:
        return ()
    volume_ml = streaks.where.sum() * voxel_ml
    return (
        f"Beside gas or metal, in {slices_text(streaks.where, 2)}, {volume_ml:.0f} ml of soft tissue were streaked "
        f"(noise of {streaks.noise_hu:.0f} HU, {streaks.usual_noise_hu:.0f} HU elsewhere), and have been smoothed from "
        "slice to slice: details thinner than two slices are lost there.",
    )
