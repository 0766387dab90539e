"""The dissertation's bile duct pipeline in its six steps (section 3.2.1 b), for bright vessels and dark ducts.

Organ mask; anisotropic diffusion; white top-hat (bottom-hat for dark ducts); Otsu's threshold in small windows;
eroded mask; opening by a ball and removal of small objects. Otsu parts the values of any window, also of one without a
vessel, where it cuts noise: a window counts only where the two classes differ by more than a floor.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from skimage.filters import threshold_otsu

from glisson.core.parameters import parameter
from glisson.core.protocols import Progress
from glisson.geometry.distance_map import distance_inside
from glisson.preoperative.imaging.diffusion import diffused
from glisson.preoperative.vessels.tubes import TubeParameters, TubeSegmenter

_EDGE = 20.0
_SMOOTHING_STEPS = 4
_FEWEST = 20  # values in a window


@dataclass(frozen=True)
class TopHatParameters(TubeParameters):
    """Lengths and thresholds of the six steps."""

    radius_mm: float = parameter(8.0, "Radius of the top-hat's disc, larger than any vessel's, mm.", 1.0, 50.0)
    window_mm: float = parameter(14.0, "Side of Otsu's windows, mm (20 pixels of 0.7 mm).", 3.0, 200.0)
    floor: float = parameter(15.0, "Least difference of a window's two classes (HU or grey values).", 0.0, 1e4)
    margin_mm: float = parameter(2.0, "What lies so near to the organ's surface is left out, mm.", 0.0, 20.0)
    ball_mm: float = parameter(1.0, "Radius of the ball of the opening, mm.", 0.0, 10.0)


class TopHat(TubeSegmenter[TopHatParameters]):
    """Vessels or ducts by top-hat and adaptive threshold."""

    name: ClassVar[str] = "top-hat"
    summary: ClassVar[str] = "The dissertation's six steps: diffusion, top-hat, Otsu in windows with a floor, opening."
    Parameters: ClassVar[type[TopHatParameters]] = TopHatParameters

    def _tubes(self, values: NDArray[np.float32], within: NDArray[np.bool_], progress: Progress) -> NDArray[np.bool_]:
        chosen, size = self._parameters, self._parameters.resolution_mm
        # Outside is made like inside, or the organ's own border would be the strongest top-hat.
        filled = np.where(within, values, np.float32(np.median(values[within])))
        smooth = diffused(filled, np.full(3, size), _EDGE, _SMOOTHING_STEPS)
        progress(0.2, "top-hat")
        hat = ndimage.white_tophat(smooth, footprint=_ball(chosen.radius_mm / size, 2)[:, :, None])
        progress(0.6, "thresholds")
        found = _above_otsu(hat, within, max(round(chosen.window_mm / size), 2), chosen.floor)
        found &= distance_inside(within, np.full(3, size)) > chosen.margin_mm
        progress(0.9, "clean-up")
        if chosen.ball_mm >= size:
            found = ndimage.binary_opening(found, _ball(chosen.ball_mm / size, 3))
        return found


def _above_otsu(hat: NDArray[np.float32], within: NDArray[np.bool_], side: int, floor: float) -> NDArray[np.bool_]:
    """What is above Otsu's threshold of its window, in each slice; windows of one class have nothing."""
    found = np.zeros(hat.shape, dtype=bool)
    for i in range(0, hat.shape[0], side):
        for j in range(0, hat.shape[1], side):
            window = np.s_[i : i + side, j : j + side]
            for k in np.flatnonzero(within[window].sum(axis=(0, 1)) >= _FEWEST):
                own = within[window][:, :, k]
                values = hat[window][:, :, k]
                inner = values[own]
                if np.ptp(inner) <= floor:
                    continue
                threshold = threshold_otsu(inner)
                above = inner > threshold
                if inner[above].mean() - inner[~above].mean() > floor:
                    found[window][:, :, k] = own & (values > threshold)
    return found


def _ball(radius: float, dimensions: int) -> NDArray[np.bool_]:
    reach = int(radius)
    axes = np.meshgrid(*[np.arange(-reach, reach + 1)] * dimensions, indexing="ij")
    ball: NDArray[np.bool_] = np.sum(np.square(axes), axis=0) <= radius**2
    return ball
