"""Cost against size: seconds and memory of each engine over the number of elements, with the fitted exponent."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import NullFormatter, StrMethodFormatter

from glisson.framework.benchmark import Row
from glisson.io.atomic import atomic_path

PLOT = "cost.png"
_LEGEND: dict[str, Any] = {
    "title": "engine, element: exponent of size",
    "fontsize": "small",
    "frameon": False,
    "ncols": 2,
    "loc": "upper center",
    "bbox_to_anchor": (0.5, -0.1),
}


def fitted_exponent(sizes: Sequence[float], costs: Sequence[float]) -> float | None:
    """Exponent p of the least-squares fit cost = c · sizeᵖ in logarithms; None for fewer than two sizes."""
    if len(set(sizes)) < 2:
        return None
    return float(np.polyfit(np.log(sizes), np.log(costs), 1)[0])


def draw_cost(rows: Iterable[Row], path: Path) -> None:
    """Write the plot as PNG."""
    curves: dict[tuple[str, str], list[Row]] = defaultdict(list)
    for row in rows:
        if row.seconds is not None:
            curves[row.engine, row.element].append(row)
    figure, (left, right) = plt.subplots(1, 2, figsize=(13.0, 7.5), layout="constrained")
    engines = list(dict.fromkeys(engine for engine, _ in curves))
    for (engine, element), measured in curves.items():
        style = {
            "color": f"C{engines.index(engine)}",
            "linestyle": "-" if element in ("T4", "pixels") else "--",
            "marker": "o",
        }
        sizes = [float(row.elements) for row in measured]
        _curve(left, f"{engine}, {element}", sizes, [float(row.seconds or 0.0) for row in measured], style)
        _curve(right, f"{engine}, {element}", sizes, [float(row.memory_mb or 0.0) for row in measured], style)
    for axes, title, unit in ((left, "Whole solve", "seconds"), (right, "Largest memory of the process", "MB")):
        axes.set(title=title, xlabel="elements, pixels or voxels", ylabel=unit, xscale="log", yscale="log")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(StrMethodFormatter("{x:,g}"))
            axis.set_minor_formatter(NullFormatter())
        axes.grid(alpha=0.3, which="both")
        if curves:
            axes.legend(**_LEGEND)
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=120)
    plt.close(figure)


def _curve(axes: Axes, name: str, sizes: list[float], costs: list[float], style: dict[str, str]) -> None:
    exponent = fitted_exponent(sizes, costs)
    label = name if exponent is None else f"{name}: {exponent:.2f}"
    axes.plot(sizes, costs, label=label, markersize=4.0, **style)  # type: ignore[arg-type]
