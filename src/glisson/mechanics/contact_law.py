"""The contact law, once for all tools: pressure over gap, and friction with cohesion over slip.

Normal direction: the pressure is zero at gaps over `range_mm`, rises as the square of the depth down to
gap 0 and then with the slope `stiffness_kpa_mm`, so that the energy has two derivatives. The range is a
cushion, in which all gaps must lie at the end of a stage (the solver stiffens the cushion where they do
not). Unlike a logarithmic barrier it is finite everywhere, so a tool may move millimetres in one step and
Newton's method pulls the organ after it; and it may be soft while tools move, which takes a third of the
iterations and shifts the organ by less than the range.

Tangential direction: |τ| ≤ friction · p, and cohesion more where the surface coheres: cohesion is shear
only and needs touch. This jump is no function that Newton's method could follow (it would cycle), so who
coheres is decided between its solutions; see `StageRunner`.
A point sticks to its anchor on the tool like a stiff spring until the limit is reached over `stick_mm` of
slip (the C1 law of Li et al., Incremental Potential Contact, 2020, section 5). Anchors stay over load
steps and are dragged only as far as the point really slipped; a held body therefore does not creep.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.scenario import ContactLaw


@dataclass(frozen=True)
class Cushion:
    """Pressure over gap: zero beyond `range_mm`, slope `stiffness_kpa_mm`."""

    range_mm: float
    stiffness_kpa_mm: float

    def energy(self, gaps: FloatArray) -> FloatArray:
        """Energy per area, kPa·mm."""
        depth = np.maximum(self.range_mm - gaps, 0.0)
        onset = self.range_mm
        beyond = 0.5 * depth**2 - 0.5 * onset * depth + onset**2 / 6.0
        energy: FloatArray = self.stiffness_kpa_mm * np.where(depth < onset, depth**3 / (6.0 * onset), beyond)
        return energy

    def pressure(self, gaps: FloatArray) -> FloatArray:
        """Pressure in kPa, −∂energy/∂gap."""
        depth = np.maximum(self.range_mm - gaps, 0.0)
        onset = self.range_mm
        rise = np.where(depth < onset, depth**2 / (2.0 * onset), depth - 0.5 * onset)
        pressure: FloatArray = self.stiffness_kpa_mm * rise
        return pressure

    def slope(self, gaps: FloatArray) -> FloatArray:
        """−∂pressure/∂gap in kPa/mm."""
        depth = np.maximum(self.range_mm - gaps, 0.0)
        slope: FloatArray = self.stiffness_kpa_mm * np.minimum(depth / self.range_mm, 1.0)
        return slope

    def gap(self, pressures: FloatArray) -> FloatArray:
        """The gap at which a pressure ≥ 0 rests (the inverse of `pressure`)."""
        rise = pressures / self.stiffness_kpa_mm
        onset = self.range_mm
        depth = np.where(rise < 0.5 * onset, np.sqrt(2.0 * onset * rise), rise + 0.5 * onset)
        gap: FloatArray = self.range_mm - depth
        return gap

    def stiffened(self, factor: float) -> "Cushion":
        """The same range with another slope."""
        return Cushion(self.range_mm, self.stiffness_kpa_mm * factor)


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
