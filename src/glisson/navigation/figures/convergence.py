"""How the solver got there: residuals and iterations of the load steps."""

import numpy as np

from glisson.core.deformation import Deformation
from glisson.navigation.figures.colours import BLUE, ORANGE, VERMILLION
from glisson.navigation.figures.picture import Picture, new_figure, picture

TOLERANCE = 1e-6
"""The relative free-node residual that counts as equilibrium (design, section 3)."""


def convergence_plot(deformation: Deformation) -> Picture:
    """Relative residual of each load step (logarithmic) above its Newton iterations."""
    steps = deformation.record
    figure = new_figure(980, 330)
    upper = figure.add_axes((0.08, 0.42, 0.89, 0.50))
    lower = figure.add_axes((0.08, 0.13, 0.89, 0.24), sharex=upper)
    numbers = np.arange(1, len(steps) + 1)
    good = np.array([step.status.is_good for step in steps])
    residuals = np.maximum([step.residual for step in steps], 1e-16)
    upper.semilogy(numbers, residuals, "-", color="0.7", lw=1.0)
    upper.semilogy(numbers[good], residuals[good], "o", color=BLUE, ms=5, label="converged")
    if not good.all():
        upper.semilogy(numbers[~good], residuals[~good], "X", color=VERMILLION, ms=8, label="not converged")
    upper.axhline(TOLERANCE, color=ORANGE, lw=1.5, ls="dashed", label="tolerance 10⁻⁶")
    upper.set_ylabel("residual", fontsize=11.5)
    upper.legend(fontsize=11, loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=3, frameon=False)
    upper.tick_params(labelbottom=False)
    lower.bar(numbers, [step.iterations for step in steps], color=BLUE, width=0.6)
    lower.set_ylabel("iterations", fontsize=11.5)
    lower.set_xlabel("load step", fontsize=11.5)
    names = [step.stage for step in steps]
    for first in [i for i in range(len(names)) if i == 0 or names[i] != names[i - 1]]:
        upper.axvline(first + 0.5, color="0.85", lw=1.0)
        upper.text(first + 0.6, 1.03, names[first], transform=upper.get_xaxis_transform(), fontsize=11, color="0.3")
    upper.set_xlim(0.4, len(steps) + 0.6)
    return picture(
        figure,
        f"Relative residual and Newton iterations of {len(steps)} load steps; worst residual {residuals.max():.1e}.",
        "Free-node residual, relative to the largest of internal, contact and external force, at the end of each load "
        "step, and the Newton iterations it took.",
    )
