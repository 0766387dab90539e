"""The contact law, once for all tools: pressure over gap, and friction with cohesion over slip.

Normal direction: the pressure is zero at gaps over `range_mm`, rises as the square of the depth, and much
faster from half the range on. The range is a cushion: soft where the pressure is that of an organ's weight,
which saves iterations, and hard where an edge presses, so that all gaps are positive at the end of a stage
(else the solver stiffens the cushion). Unlike a logarithmic barrier it is finite
everywhere: a tool may move millimetres in one step, and Newton's method pulls the organ after it.

Tangential direction: |τ| ≤ friction · p, and cohesion more where the surface coheres: cohesion is shear
only and needs touch. This jump is no function that Newton's method could follow (it would cycle), so who
coheres is decided between its solutions; see `LoadPath`.
A point sticks to its anchor on the tool like a stiff spring until the limit is reached over `stick_mm` of
slip (the C1 law of Li et al., Incremental Potential Contact, 2020, section 5). Anchors stay over load
steps and are dragged only as far as the point really slipped; a held body therefore does not creep.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.scenario import ContactLaw

_INVERSION_STEPS = 60


@dataclass(frozen=True)
class Cushion:
    """Pressure over gap: with s = 1 − gap / range ≥ 0, `stiffness_kpa_mm` · range / 2 · (s² + h max(s − ½, 0)³)."""

    range_mm: float
    stiffness_kpa_mm: float
    hardening: float = 64.0
    """h; with 64 gap 0 takes nine times the pressure that the soft part alone would take there."""

    def energy(self, gaps: FloatArray) -> FloatArray:
        """Energy per area, kPa·mm."""
        depth, hard = self._depth(gaps)
        scale = 0.5 * self.stiffness_kpa_mm * self.range_mm**2
        energy: FloatArray = scale * (depth**3 / 3.0 + self.hardening * hard**4 / 4.0)
        return energy

    def pressure(self, gaps: FloatArray) -> FloatArray:
        """Pressure in kPa, −∂energy/∂gap."""
        depth, hard = self._depth(gaps)
        pressure: FloatArray = 0.5 * self.stiffness_kpa_mm * self.range_mm * (depth**2 + self.hardening * hard**3)
        return pressure

    def slope(self, gaps: FloatArray) -> FloatArray:
        """−∂pressure/∂gap in kPa/mm."""
        depth, hard = self._depth(gaps)
        slope: FloatArray = self.stiffness_kpa_mm * (depth + 1.5 * self.hardening * hard**2)
        return slope

    def gap(self, pressures: FloatArray) -> FloatArray:
        """The gap at which a pressure ≥ 0 rests (the inverse of `pressure`)."""
        # Without hardening the depth would be larger, and from there Newton's method comes down monotonically.
        depth = np.sqrt(2.0 * pressures / (self.stiffness_kpa_mm * self.range_mm))
        for _ in range(_INVERSION_STEPS):
            gaps = self.range_mm * (1.0 - depth)
            excess = self.pressure(gaps) - pressures
            depth = depth - excess / np.maximum(self.slope(gaps) * self.range_mm, 1e-300)
        result: FloatArray = self.range_mm * (1.0 - depth)
        return result

    def _depth(self, gaps: FloatArray) -> tuple[FloatArray, FloatArray]:
        depth = np.maximum(1.0 - gaps / self.range_mm, 0.0)
        return depth, np.maximum(depth - 0.5, 0.0)

    def stiffened(self, factor: float) -> "Cushion":
        """The same range with pressures `factor` times as high."""
        return replace(self, stiffness_kpa_mm=self.stiffness_kpa_mm * factor)


def shear_limit(pressures: FloatArray, cohering: NDArray[np.bool_], law: ContactLaw) -> FloatArray:
    """Largest shear stress in kPa at the given pressures, and where the surface coheres."""
    limit: FloatArray = law.friction * pressures + law.cohesion_kpa * cohering
    return limit


def slip_energy(slips: FloatArray, stick_mm: float) -> FloatArray:
    """∫ of `shear_share` over the slip, in mm."""
    share = slips / stick_mm
    within = stick_mm * share**2 * (1.0 - share / 3.0)
    return np.where(share < 1.0, within, slips - stick_mm / 3.0)


def shear_share(slips: FloatArray, stick_mm: float) -> FloatArray:
    """Share of the limit that is mobilised at a slip: 2s − s² up to s = slip / stick = 1, then 1."""
    share = np.minimum(slips / stick_mm, 1.0)
    result: FloatArray = share * (2.0 - share)
    return result


def shear_slope(slips: FloatArray, stick_mm: float) -> FloatArray:
    """Derivative of `shear_share` in 1/mm."""
    slope: FloatArray = 2.0 * np.maximum(1.0 - slips / stick_mm, 0.0) / stick_mm
    return slope
