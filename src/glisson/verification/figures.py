"""The report's plots: errors over element sizes with their slopes, and how much of each tolerance is used."""

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from glisson.verification.check import PREFIXES, Check

_DOTS_PER_INCH = 200
_BLUE, _GREEN, _VERMILLION, _ORANGE = "#0072b2", "#009e73", "#d55e00", "#e69f00"  # Okabe and Ito 2008
_LEAST_SHARE = 1e-7  # of a tolerance, shown at the left edge


@dataclass(frozen=True)
class Picture:
    """A PNG as a data URI, what it shows for those who cannot see it, and its caption."""

    source: str
    alternative: str
    caption: str


def convergence_picture(checks: Sequence[Check]) -> Picture:
    """Errors over element sizes, one panel to a norm (the last part of a check's name), with the theory's slopes."""
    norms = list(dict.fromkeys(check.name.rpartition("/")[2] for check in checks))
    figure = _figure(4.6 * len(norms), 3.9)
    for number, norm in enumerate(norms):
        axes = figure.add_subplot(1, len(norms), number + 1)
        shown = [check for check in checks if check.name.endswith(f"/{norm}")]
        for check, colour, marker in zip(shown, (_BLUE, _ORANGE, _GREEN, _VERMILLION), "osD^", strict=False):
            _add_line(axes, check, colour, marker)
        axes.set_xlabel("element size (mm)")
        axes.set_ylabel("relative error")
        axes.set_title(f"{norm} norm", fontsize=11)
        axes.grid(which="both", color="0.92", lw=0.6)
        axes.legend(fontsize=9, frameon=False)
    figure.tight_layout()
    told = "; ".join(f"{check.name}: order {check.value:.2f}" for check in checks)
    caption = (
        "Relative errors over the element size on logarithmic axes. Dashed: the slope that theory gives, "
        "through the finest mesh. In the legend the observed order between the two finest meshes."
    )
    return _picture(figure, told, caption)


def _add_line(axes: Axes, check: Check, colour: str, marker: str) -> None:
    assert check.convergence is not None
    assert check.expected is not None
    sizes, errors = np.array(check.convergence.sizes), np.array(check.convergence.errors)
    label = f"{check.name.split('/')[1]}: {check.value:.2f} (theory {check.expected:g})"
    axes.loglog(sizes, errors, marker=marker, color=colour, lw=1.6, ms=5, label=label)
    axes.loglog(sizes, errors[-1] * (sizes / sizes[-1]) ** check.expected, "--", color=colour, lw=0.9)


def error_picture(checks: Sequence[Check]) -> Picture:
    """For each prefix how much of its tolerance every check uses, on a logarithmic axis."""
    rows = [prefix for prefix in PREFIXES if any(check.name.startswith(f"{prefix}/") for check in checks)]
    figure = _figure(9.2, 0.9 + 0.3 * len(rows))
    axes = figure.add_subplot(1, 1, 1)
    for check in checks:
        if check.value is None or check.expected is None or not check.tolerance:
            continue
        share = abs(check.value - check.expected) / check.tolerance
        row = rows.index(check.name.partition("/")[0])
        colour, marker = (_GREEN, "o") if check.passed else (_VERMILLION, "X")
        axes.plot([max(share, _LEAST_SHARE)], [row], marker, color=colour, ms=6, alpha=0.7, mew=0)
    axes.axvline(1.0, color="0.3", lw=1.2)
    axes.set_xscale("log")
    axes.set_xlim(_LEAST_SHARE / 2.0, 10.0)
    axes.set_yticks(range(len(rows)), rows)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xlabel("deviation from what is expected, as a share of the tolerance (line: all of it)")
    axes.grid(axis="x", color="0.92", lw=0.6)
    figure.tight_layout()
    failed = sum(not check.passed for check in checks)
    caption = "How much of its tolerance each check uses: circles passed, crosses failed; without value, none is drawn."
    return _picture(figure, f"{len(checks)} checks, {failed} failed.", caption)


def _figure(width: float, height: float) -> Figure:
    figure = Figure(figsize=(width, height), facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def _picture(figure: Figure, alternative: str, caption: str) -> Picture:
    stream = BytesIO()
    figure.savefig(stream, format="png", dpi=_DOTS_PER_INCH, metadata={"Software": None})
    encoded = base64.b64encode(stream.getvalue()).decode("ascii")
    return Picture(f"data:image/png;base64,{encoded}", alternative, caption)
