"""Metal in a CT, and the streaks that it makes, lessened on the rays: normalised metal artefact reduction.

Rays through metal are replaced: what the rays beside them say is carried across the metal's trace, after division by
those of a prior, a picture that holds nothing but air, soft tissue and bone, so that what crosses the trace is almost
flat (Meyer et al. 2010, Medical Physics 37:5482). Only the difference is reconstructed and added: what no such ray
touches keeps its values.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from skimage.filters import apply_hysteresis_threshold
from skimage.transform import iradon, radon, resize

from glisson.core.arrays import FloatArray
from glisson.core.image import Volume
from glisson.preoperative.imaging.axial import slice_axis, slices_text
from glisson.preoperative.imaging.scan_checks import hu_fault

_METAL_HU, _BESIDE_HU = 1600.0, 1000.0
"""No bone of the trunk is as dense as the first; voxels at the border of metal hold some of it."""

_AIR_HU, _BONE_HU = -500.0, 300.0
_SOFT_HU = 30.0
_PIXEL_MM = 1.0
"""Pixels in which rays are computed."""

_ANGLES_DEG = np.linspace(0.0, 180.0, 360, endpoint=False)
_SMOOTHING_MM = 1.5
_LEAST_RAY = 1e-3
"""Rays of the prior below this (relative to 1 pixel of water) go through air alone."""


def metal_voxels(hu: NDArray[Any]) -> NDArray[np.bool_]:
    """Voxels of a CT (HU) that are metal: implants, clips, wires, stents and instruments."""
    if float(hu.max()) <= _METAL_HU:  # most scans have none, and all are looked at
        return np.zeros(hu.shape, dtype=bool)
    found: NDArray[np.bool_] = apply_hysteresis_threshold(hu, _BESIDE_HU, _METAL_HU)
    return found


def metal_warnings(volume: Volume) -> tuple[str, ...]:
    """A sentence on the metal in a scan; none where there is none, or the scan has no HU."""
    if volume.modality != "CT" or hu_fault(volume) is not None:
        return ()
    metal = metal_voxels(volume.voxels)
    if not metal.any():
        return ()
    amount_ml = float(metal.sum()) * volume.grid.voxel_volume_mm3 * 1e-3
    return (
        f"There is metal in the scan ({amount_ml:.2g} ml, in {slices_text(metal, slice_axis(volume.grid))}), and grey "
        "values about it are wrong: glisson artefacts CASE lessens its streaks, and tells what is lost.",
    )


def without_metal_streaks(
    hu: NDArray[np.float32], metal: NDArray[np.bool_], spacing_mm: FloatArray
) -> Iterator[tuple[int, NDArray[np.float32]]]:
    """Each slice with metal, without its streaks; metal keeps its values.

    Args:
        hu: the scan (rows, columns, slices), HU.
        metal: its metal.
        spacing_mm: size of its voxels, (3,).

    Yields:
        The slice's number and its values, (rows, columns) HU.
    """
    for k in np.flatnonzero(metal.any(axis=(0, 1))).tolist():
        yield k, _reduced(hu[:, :, k], metal[:, :, k], spacing_mm[:2])


def _reduced(hu: NDArray[np.float32], metal: NDArray[np.bool_], spacing_mm: FloatArray) -> NDArray[np.float32]:
    shape = tuple(np.maximum(np.rint(np.array(hu.shape) * spacing_mm / _PIXEL_MM), 8).astype(int).tolist())
    coarse = resize(hu, shape, order=1, anti_aliasing=True, preserve_range=True)
    coarse_metal = resize(metal.astype(float), shape, order=1, anti_aliasing=True) > 0.05
    change = resize(_change(coarse, coarse_metal), hu.shape, order=1, preserve_range=True)
    return np.where(metal, hu, hu + change.astype(np.float32))


def _change(hu: FloatArray, metal: NDArray[np.bool_]) -> FloatArray:
    """What is to be added to a slice (HU) for its rays through metal to fit those beside them."""
    rays = radon(_density(hu), _ANGLES_DEG, circle=False)
    trace = ndimage.binary_dilation(radon(metal.astype(float), _ANGLES_DEG, circle=False) > 0.1, np.ones((3, 1)))
    without = hu + _reconstructed(_bridged(rays, trace, np.ones_like(rays)) - rays, hu.shape)
    prior = radon(_density(_prior(without, metal)), _ANGLES_DEG, circle=False)
    return _reconstructed(_bridged(rays, trace, prior) - rays, hu.shape)


def _bridged(rays: FloatArray, trace: NDArray[np.bool_], prior: FloatArray) -> FloatArray:
    """Rays (place, angle) whose ratio to the prior's is linear across the trace of metal."""
    bridged = rays.copy()
    places = np.arange(len(rays))
    floor = np.maximum(prior, _LEAST_RAY)
    for angle in np.flatnonzero(trace.any(axis=0)):
        gap = trace[:, angle]
        ratio = rays[~gap, angle] / floor[~gap, angle]
        bridged[gap, angle] = np.interp(places[gap], places[~gap], ratio) * floor[gap, angle]
    return bridged


def _prior(hu: FloatArray, metal: NDArray[np.bool_]) -> FloatArray:
    """Air, soft tissue of one density, and bone as it is."""
    smooth = ndimage.gaussian_filter(hu, _SMOOTHING_MM / _PIXEL_MM)
    prior: FloatArray = np.where(smooth < _AIR_HU, -1000.0, np.where(smooth > _BONE_HU, hu, _SOFT_HU))
    prior[metal] = _SOFT_HU
    return prior


def _density(hu: FloatArray) -> FloatArray:
    """Attenuation relative to water's."""
    return np.maximum(hu / 1000.0 + 1.0, 0.0)


def _reconstructed(rays: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    """A picture (HU) of `shape` from rays about the middle of the square that `radon` put it into."""
    whole = iradon(rays, _ANGLES_DEG, output_size=rays.shape[0], circle=False)
    first = [len(whole) // 2 - n // 2 for n in shape]
    part: FloatArray = whole[first[0] : first[0] + shape[0], first[1] : first[1] + shape[1]]
    return 1000.0 * part
