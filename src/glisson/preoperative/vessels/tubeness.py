"""Vessels by their tubular shape over several scales (Sato et al. 1998, Medical Image Analysis 2:143)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from skimage.filters import apply_hysteresis_threshold, sato

from glisson.core.parameters import parameter
from glisson.core.protocols import Progress
from glisson.preoperative.vessels.tubes import TubeParameters, TubeSegmenter

_SCALES = 4
_AROUND_MM = 15.0
_CLIPPED = 60.0
"""Grey values farther from the organ's median are not its tissue and tell nothing of it."""


@dataclass(frozen=True)
class TubenessParameters(TubeParameters):
    """Radii, and how sure a tube must be."""

    thinnest_mm: float = parameter(1.0, "Radius of the thinnest tube that is looked for, mm.", 0.3, 10.0)
    thickest_mm: float = parameter(3.4, "Radius of the thickest tube that is looked for, mm.", 0.5, 20.0)
    sure: float = parameter(12.0, "Tubeness (HU or grey values) above which a voxel is a vessel …", 0.1, 1e4)
    connected: float = parameter(7.0, "… and above which it is one beside such a voxel.", 0.1, 1e4)
    excess: float = parameter(15.0, "Least difference from the organ's tissue near by.", 0.0, 1e4)


class Tubeness(TubeSegmenter[TubenessParameters]):
    """Vessels or ducts by the largest response of a ridge filter over some radii, with hysteresis."""

    name: ClassVar[str] = "tubeness"
    summary: ClassVar[str] = "Tubes by the eigenvalues of the Hessian over several scales, with hysteresis (Sato)."
    Parameters: ClassVar[type[TubenessParameters]] = TubenessParameters

    def _tubes(self, values: NDArray[np.float32], within: NDArray[np.bool_], progress: Progress) -> NDArray[np.bool_]:
        chosen = self._parameters
        above = _excess(values, within, chosen.resolution_mm)
        progress(0.2, "tubes of all radii")
        radii = np.geomspace(chosen.thinnest_mm, max(chosen.thickest_mm, chosen.thinnest_mm), _SCALES)
        ridges = sato(above, sigmas=radii / chosen.resolution_mm, black_ridges=False)
        progress(0.9, "connecting")
        found: NDArray[np.bool_] = apply_hysteresis_threshold(ridges, chosen.connected, chosen.sure)
        return found & (above > chosen.excess)


def _excess(values: NDArray[np.float32], organ: NDArray[np.bool_], size_mm: float) -> NDArray[np.float32]:
    """Grey values [i, j, k] less the organ's own near by (a Gaussian mean inside it), zero outside the organ."""
    middle = float(np.median(values[organ]))
    tissue = organ & (np.abs(values - middle) < _CLIPPED)
    weights = ndimage.gaussian_filter(tissue.astype(np.float32), _AROUND_MM / size_mm, truncate=3.0)
    means = ndimage.gaussian_filter(np.where(tissue, values - middle, 0.0), _AROUND_MM / size_mm, truncate=3.0)
    near: NDArray[np.float32] = means / np.maximum(weights, 1e-3)
    result: NDArray[np.float32] = np.where(organ, values - middle - near, 0.0).astype(np.float32)
    return result
