"""Vessels by their tubular shape over several scales (Sato et al. 1998, Medical Image Analysis 2:143)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from skimage.filters import apply_hysteresis_threshold, sato

from glisson.core.image import LabelMap, Volume
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, silent
from glisson.preoperative.vessels.contrast import excess, without_crumbs
from glisson.preoperative.vessels.isotropic import IsotropicBox

_SCALES = 4


@dataclass(frozen=True)
class TubenessParameters:
    """Which tubes count."""

    tubes: str = parameter("bright", "Vessels with contrast agent, or ducts.", choices=("bright", "dark"))
    resolution_mm: float = parameter(1.0, "Voxels are resampled to this size, mm.", 0.3, 3.0)
    thinnest_mm: float = parameter(1.0, "Radius of the thinnest tube that is looked for, mm.", 0.3, 10.0)
    thickest_mm: float = parameter(3.4, "Radius of the thickest tube that is looked for, mm.", 0.5, 20.0)
    sure: float = parameter(12.0, "Tubeness (HU or grey values) above which a voxel is a vessel …", 0.1, 1e4)
    connected: float = parameter(7.0, "… and above which it is one beside such a voxel.", 0.1, 1e4)
    excess: float = parameter(15.0, "Least difference from the organ's tissue near by.", 0.0, 1e4)
    smallest_mm3: float = parameter(300.0, "Smaller pieces are left out, mm³.", 0.0, 1e6)


class Tubeness:
    """Vessels or ducts by the largest response of a ridge filter over some radii, with hysteresis."""

    name: ClassVar[str] = "tubeness"
    summary: ClassVar[str] = "Tubes by the eigenvalues of the Hessian over several scales, with hysteresis (Sato)."
    Parameters: ClassVar[type[TubenessParameters]] = TubenessParameters

    def __init__(self, parameters: TubenessParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """Nothing beyond Glisson's own dependencies."""
        return ()

    def find(self, volume: Volume, organ: LabelMap, progress: Progress = silent) -> LabelMap:
        """Tubes inside the organ, {1: "vessel"} on the scan's grid.

        Raises:
            BadInput: the organ's mask is empty.
        """
        chosen = self._parameters
        progress(0.0, "resampling")
        inside = organ.mask("liver")
        box = IsotropicBox.around(inside, volume.grid, chosen.resolution_mm)
        within = box.mask(inside)
        sign = 1.0 if chosen.tubes == "bright" else -1.0
        above = sign * excess(box.values(volume.voxels), within, chosen.resolution_mm)
        progress(0.2, "tubes of all radii")
        radii = np.geomspace(chosen.thinnest_mm, max(chosen.thickest_mm, chosen.thinnest_mm), _SCALES)
        ridges = sato(above, sigmas=radii / chosen.resolution_mm, black_ridges=False)
        progress(0.9, "connecting")
        found = apply_hysteresis_threshold(ridges, chosen.connected, chosen.sure)
        found &= within & (above > chosen.excess)
        found = without_crumbs(found, chosen.smallest_mm3, chosen.resolution_mm)
        return LabelMap((box.back(found) & inside).astype(np.uint8), volume.grid, {1: "vessel"})
