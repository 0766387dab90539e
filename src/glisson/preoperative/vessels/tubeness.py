"""Vessels by their tubular shape over several scales (Sato et al. 1998, Medical Image Analysis 2:143).

What is surely a tube tells how much vessels differ from tissue in this scan, their contrast. Thresholds rise with it;
trunks, which are wider than any scale, are filled up from the tubes in them where the scan is above half the contrast.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from skimage.filters import apply_hysteresis_threshold

from glisson.core.parameters import parameter
from glisson.core.protocols import Progress
from glisson.preoperative.vessels.tubes import TubeParameters, TubeSegmenter

_SCALES = 5
_SURE, _CONNECTED, _LEAST, _FILLED = 0.3, 0.2, 0.35, 0.5
"""Shares of the contrast: tubeness that is sure, that is enough beside it; grey value that is least, that fills up."""

_SMOOTHING_MM = 0.7
_AROUND_MM = 15.0
_REACH = 4.0
"""Gaussian derivatives end after so many standard deviations."""

_CLIPPED = 60.0
"""Grey values farther from the organ's median are not its tissue and tell nothing of it."""


@dataclass(frozen=True)
class TubenessParameters(TubeParameters):
    """Radii, and how sure a tube must be."""

    thinnest_mm: float = parameter(1.0, "Radius of the thinnest tube that is looked for, mm.", 0.3, 10.0)
    thickest_mm: float = parameter(5.0, "Radius of the thickest tube that is looked for, mm.", 0.5, 20.0)
    sure: float = parameter(12.0, "Least tubeness (HU or grey values) above which a voxel is a vessel …", 0.1, 1e4)
    connected: float = parameter(7.0, "… and above which it is one beside such a voxel.", 0.1, 1e4)
    excess: float = parameter(10.0, "Least difference from the organ's tissue near by.", 0.0, 1e4)


class Tubeness(TubeSegmenter[TubenessParameters]):
    """Vessels or ducts by the largest response of a ridge filter over some radii, with hysteresis."""

    name: ClassVar[str] = "tubeness"
    summary: ClassVar[str] = "Tubes by the eigenvalues of the Hessian over several scales, with hysteresis (Sato)."
    Parameters: ClassVar[type[TubenessParameters]] = TubenessParameters

    def _tubes(self, values: NDArray[np.float32], within: NDArray[np.bool_], progress: Progress) -> NDArray[np.bool_]:
        chosen = self._parameters
        above = _excess(values, within, chosen.resolution_mm)
        radii = np.geomspace(chosen.thinnest_mm, max(chosen.thickest_mm, chosen.thinnest_mm), _SCALES)
        ridges = np.zeros_like(above)
        for number, sigma in enumerate(radii / chosen.resolution_mm):
            progress(0.2 + 0.7 * number / len(radii), "tubes of all radii")
            np.maximum(ridges, _ridges(above, within, float(sigma)), out=ridges)
        progress(0.9, "connecting")
        smooth = ndimage.gaussian_filter(above, _SMOOTHING_MM / chosen.resolution_mm)
        first = apply_hysteresis_threshold(ridges, chosen.connected, chosen.sure) & (smooth > chosen.excess)
        if not first.any():
            return np.zeros_like(within)
        contrast = float(np.median(smooth[first]))
        found = apply_hysteresis_threshold(
            ridges, max(chosen.connected, _CONNECTED * contrast), max(chosen.sure, _SURE * contrast)
        )
        found &= smooth > max(chosen.excess, _LEAST * contrast)
        bright = within & (smooth > max(chosen.excess, _FILLED * contrast))
        filled: NDArray[np.bool_] = found | ndimage.binary_propagation(found & bright, mask=bright)
        return filled


def _excess(values: NDArray[np.float32], organ: NDArray[np.bool_], size_mm: float) -> NDArray[np.float32]:
    """Grey values [i, j, k] less the organ's own near by (a Gaussian mean inside it), zero outside the organ."""
    middle = float(np.median(values[organ]))
    tissue = organ & (np.abs(values - middle) < _CLIPPED)
    weights = ndimage.gaussian_filter(tissue.astype(np.float32), _AROUND_MM / size_mm, truncate=3.0)
    means = ndimage.gaussian_filter(np.where(tissue, values - middle, 0.0), _AROUND_MM / size_mm, truncate=3.0)
    near: NDArray[np.float32] = means / np.maximum(weights, 1e-3)
    result: NDArray[np.float32] = np.where(organ, values - middle - near, 0.0).astype(np.float32)
    return result


def _ridges(above: NDArray[np.float32], organ: NDArray[np.bool_], sigma: float) -> NDArray[np.float32]:
    """Sato's response to bright tubes at one scale (voxels): σ² times the geometric mean of the two curvatures across.

    Only voxels of the organ that are brighter than it at this scale are looked at, which saves most of the eigenvalues.
    """
    asked = organ & (ndimage.gaussian_filter(above, sigma, truncate=_REACH) > 0.0)
    curvatures = np.zeros((int(asked.sum()), 3, 3), dtype=np.float32)
    for i in range(3):
        for j in range(i, 3):
            order = np.bincount([i, j], minlength=3)
            second = ndimage.gaussian_filter(above, sigma, order=order, truncate=_REACH)[asked]
            curvatures[:, i, j] = curvatures[:, j, i] = -second
    across = np.maximum(np.linalg.eigvalsh(curvatures)[:, 1:], 0.0)
    response = np.zeros_like(above)
    response[asked] = sigma**2 * np.sqrt(across.prod(axis=1))
    return response
