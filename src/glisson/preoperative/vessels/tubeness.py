"""Vessels by their tubular shape: ridges that stand out from noise, widened to half of the vessel's brightness.

What is much brighter than the rest of what looks like vessels, with the bright patch about it, is no vessel: lipiodol
in a treated tumour, a metal clip, a calcification, a rib that the organ's mask reaches.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from skimage.filters import apply_hysteresis_threshold
from skimage.morphology import ball

from glisson.core.parameters import parameter
from glisson.core.protocols import Progress
from glisson.preoperative.vessels.oriented_ridges import ridge_strength
from glisson.preoperative.vessels.tubes import TubeParameters, TubeSegmenter, without_crumbs

_SCALES = 4
_AROUND_MM = 15.0
_CLIPPED = 60.0
"""Grey values farther from the organ's median are not its tissue and tell nothing of it."""

_CALM_MM = 0.7
"""Standard deviation of the Gaussians that take noise out of grey values and of the border."""

_BESIDE_MM = 1.5
"""How far along the vessel its brightness is averaged."""

_GROWN_MM = 2.0
"""How far the border may lie from the ridge that was found."""

_FAR_OUT = 3.0
"""Interquartile ranges above the upper quartile from which a value is far out (Tukey 1977)."""

_SPECK_MM3, _PATCH_MM, _BLUR_MM = 10.0, 12.0, 3.0
"""Smaller specks are noise; how far the patch about one reaches, and how far its blur."""


@dataclass(frozen=True)
class TubenessParameters(TubeParameters):
    """Radii, and how sure a tube must be."""

    thinnest_mm: float = parameter(1.0, "Radius of the thinnest tube that is looked for, mm.", 0.3, 10.0)
    thickest_mm: float = parameter(4.0, "Radius of the thickest tube that is looked for, mm.", 0.5, 20.0)
    along_mm: float = parameter(2.5, "Standard deviation of the averaging along the tube, mm.", 0.5, 10.0)
    sure: float = parameter(10.0, "Strength, in noise's deviations, above which a voxel is a vessel …", 1.0, 1e3)
    connected: float = parameter(5.0, "… and above which it is one beside such a voxel.", 1.0, 1e3)
    excess: float = parameter(15.0, "Least difference from the organ's tissue near by.", 0.0, 1e4)


class Tubeness(TubeSegmenter[TubenessParameters]):
    """Vessels or ducts by the strongest ridge over some radii and directions, with hysteresis."""

    name: ClassVar[str] = "tubeness"
    summary: ClassVar[str] = "Ridges along lines of all directions over several radii, with hysteresis."
    Parameters: ClassVar[type[TubenessParameters]] = TubenessParameters

    def _tubes(self, values: NDArray[np.float32], within: NDArray[np.bool_], progress: Progress) -> NDArray[np.bool_]:
        chosen, size = self._parameters, self._parameters.resolution_mm
        above = _excess(values, within, size)
        progress(0.1, "tubes of all radii")
        radii = np.geomspace(chosen.thinnest_mm, max(chosen.thickest_mm, chosen.thinnest_mm), _SCALES)
        strength = ridge_strength(above, within, radii / size, chosen.along_mm / size)
        progress(0.9, "borders")
        calm = ndimage.gaussian_filter(above, _CALM_MM / size)
        strength[calm <= chosen.excess] = 0.0
        ridges: NDArray[np.bool_] = apply_hysteresis_threshold(strength, chosen.connected, chosen.sure)
        foreign = _far_too_bright(calm, ridges, within, chosen.excess, size)
        return _up_to_half(calm, ridges & ~foreign, size) & ~foreign


def _excess(values: NDArray[np.float32], organ: NDArray[np.bool_], size_mm: float) -> NDArray[np.float32]:
    """Grey values [i, j, k] less the organ's own near by (a Gaussian mean inside it), zero outside the organ."""
    middle = float(np.median(values[organ]))
    tissue = organ & (np.abs(values - middle) < _CLIPPED)
    weights = ndimage.gaussian_filter(tissue.astype(np.float32), _AROUND_MM / size_mm, truncate=3.0)
    means = ndimage.gaussian_filter(np.where(tissue, values - middle, 0.0), _AROUND_MM / size_mm, truncate=3.0)
    near: NDArray[np.float32] = means / np.maximum(weights, 1e-3)
    result: NDArray[np.float32] = np.where(organ, values - middle - near, 0.0).astype(np.float32)
    return result


def _far_too_bright(
    calm: NDArray[np.float32], ridges: NDArray[np.bool_], within: NDArray[np.bool_], excess: float, size_mm: float
) -> NDArray[np.bool_]:
    """Specks far brighter than the ridges, their blur, and what is bright and joined to them near by."""
    if not ridges.any():
        return ridges
    low, high = np.percentile(calm[ridges], [25.0, 75.0])
    specks = without_crumbs(within & (calm > high + _FAR_OUT * (high - low)), _SPECK_MM3, size_mm)
    if not specks.any():
        return specks
    blur = ndimage.binary_dilation(specks, iterations=round(_BLUR_MM / size_mm))
    patch: NDArray[np.bool_] = ndimage.binary_dilation(
        specks, iterations=round(_PATCH_MM / size_mm), mask=within & (blur | (calm > excess))
    )
    return patch


def _up_to_half(calm: NDArray[np.float32], ridges: NDArray[np.bool_], size_mm: float) -> NDArray[np.bool_]:
    """What has more than half of the excess of the ridges beside: there a blurred vessel has its border."""
    beside = _BESIDE_MM / size_mm
    weights = ndimage.gaussian_filter(ridges.astype(np.float32), beside)
    own = ndimage.gaussian_filter(np.where(ridges, calm, 0.0), beside) / np.maximum(weights, 1e-4)
    share = ndimage.gaussian_filter(np.clip(calm / np.maximum(own, 1.0), -0.5, 1.5), _CALM_MM / size_mm)
    near = ndimage.binary_dilation(ridges, ball(round(_GROWN_MM / size_mm)))
    border: NDArray[np.bool_] = near & (share > 0.5)
    return border
