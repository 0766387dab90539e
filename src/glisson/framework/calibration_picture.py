"""The picture of a calibration: board points on their images, with arrows of what is left over."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.io.atomic import atomic_path
from glisson.navigation.figures.colours import BLUE, ORANGE, VERMILLION
from glisson.navigation.figures.picture import DOTS_PER_INCH, new_figure

_PANELS = 8
_PANEL_PX = 620
_ARROW_SHARE = 0.03


@dataclass(frozen=True, eq=False)
class Shown:
    """A view to be drawn: its image if there is one, pixels (n, 2) found, residuals (n, 2), and which were used."""

    name: str
    image: NDArray[np.uint8] | None
    pixels: FloatArray
    residuals_px: FloatArray
    used: NDArray[np.bool_]


def draw_residuals(views: Sequence[Shown], size: tuple[int, int], title: str, path: Path) -> None:
    """Draw the first eight views and, in a last panel, the residuals of all; arrows are magnified, as the legend says.

    Args:
        views: what is drawn.
        size: (width, height) of the images in px.
        title: of the picture.
        path: where the PNG goes.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    first = views[:_PANELS]
    columns = 1 if len(first) == 0 else min(3, len(first) + 1)
    rows = -(-(len(first) + 1) // columns)
    panel_height = int(_PANEL_PX * size[1] / size[0]) + 34
    figure = new_figure(columns * _PANEL_PX, rows * panel_height + 90)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    lengths = np.concatenate([np.linalg.norm(one.residuals_px[one.used], axis=1) for one in views])
    magnified = max(_round(_ARROW_SHARE * size[0] / max(float(np.median(lengths)), 1e-6)), 1.0)
    for axes, view in zip(panels, first, strict=False):
        own = np.sqrt((view.residuals_px[view.used] ** 2).sum(axis=1).mean())
        _panel(axes, size, f"{view.name}: {own:.2f} px root mean square")
        if view.image is not None:
            axes.imshow(view.image, extent=(-0.5, size[0] - 0.5, size[1] - 0.5, -0.5))
        _draw(axes, view, magnified)
    last = panels[len(first)]
    _panel(last, size, f"all {len(views)} views")
    for view in views:
        _draw(last, view, magnified)
    for axes in panels[len(first) + 1 :]:
        axes.set_axis_off()
    legend = [
        Line2D([], [], color=ORANGE, marker="o", markersize=5, linestyle="none", label="found"),
        Line2D([], [], color=BLUE, linewidth=2, label=f"from found to computed, magnified {magnified:g} times"),
        Line2D([], [], color=VERMILLION, marker="x", markersize=7, linestyle="none", label="left out"),
    ]
    figure.suptitle(title, fontsize=16, fontweight="bold")
    figure.legend(handles=legend, loc="lower center", ncols=3, frameon=False, fontsize=12)
    edge = 45.0 / (rows * panel_height + 90)
    figure.subplots_adjust(left=0.01, right=0.99, bottom=edge, top=1.0 - 1.7 * edge, wspace=0.03, hspace=0.12)
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=DOTS_PER_INCH, metadata={"Software": None})


def _panel(axes: Axes, size: tuple[int, int], title: str) -> None:
    axes.set(xlim=(-0.5, size[0] - 0.5), ylim=(size[1] - 0.5, -0.5), aspect="equal", xticks=[], yticks=[])
    axes.set_title(title, fontsize=11)


def _draw(axes: Axes, view: Shown, magnified: float) -> None:
    found, ends = view.pixels[view.used], -view.residuals_px[view.used] * magnified
    axes.plot(*found.T, "o", color=ORANGE, markersize=2.5, markeredgewidth=0)
    axes.quiver(
        *found.T, *ends.T, angles="xy", scale_units="xy", scale=1.0, color=BLUE, width=0.0028, headwidth=3.5
    )  # fmt: skip
    axes.plot(*view.pixels[~view.used].T, "x", color=VERMILLION, markersize=7)


def _round(number: float) -> float:
    """The greatest of 1, 2, 5, 10, … that is no more than a number."""
    power = 10.0 ** np.floor(np.log10(number))
    return float(next(step * power for step in (5.0, 2.0, 1.0) if step * power <= number))
