"""A picture for the report: a matplotlib figure or a rendered scene as an inline PNG."""

import base64
from dataclasses import dataclass
from io import BytesIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.navigation.figures.colours import Rgb
from glisson.navigation.rendering.camera import Camera

DOTS_PER_INCH = 100
_AXES = ((np.array([1.0, 0.0, 0.0]), "L"), (np.array([0.0, -1.0, 0.0]), "A"), (np.array([0.0, 0.0, 1.0]), "S"))
"""Directions of the triad: the patient's left, front (anterior) and head (superior)."""


@dataclass(frozen=True)
class Picture:
    """An image as a data URI, what it shows for those who cannot see it, and its caption."""

    source: str
    alternative: str
    caption: str
    width: int
    height: int


def picture(figure: Figure, alternative: str, caption: str, dots_per_inch: int = DOTS_PER_INCH) -> Picture:
    """Draw a matplotlib figure into a PNG."""
    stream = BytesIO()
    figure.savefig(
        stream, format="png", dpi=dots_per_inch, facecolor=figure.get_facecolor(), metadata={"Software": None}
    )
    width, height = (int(size * dots_per_inch) for size in figure.get_size_inches())
    encoded = base64.b64encode(stream.getvalue()).decode("ascii")
    return Picture(f"data:image/png;base64,{encoded}", alternative, caption, width, height)


def new_figure(width_px: int, height_px: int) -> Figure:
    """An empty figure of a size in pixels, drawn without any window system."""
    figure = Figure(figsize=(width_px / DOTS_PER_INCH, height_px / DOTS_PER_INCH), facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def pixels_of(figure: Figure) -> NDArray[np.uint8]:
    """The figure as [row, column, red green blue]."""
    stream = BytesIO()
    figure.savefig(stream, format="rgba", dpi=DOTS_PER_INCH)
    width, height = (round(size * DOTS_PER_INCH) for size in figure.get_size_inches())
    return np.frombuffer(stream.getvalue(), dtype=np.uint8).reshape(height, width, 4)[:, :, :3].copy()


def framed(image: NDArray[np.uint8], camera: Camera, title: str, legend: dict[str, Rgb]) -> tuple[Figure, Axes]:
    """A figure that shows a rendered image pixel by pixel, with title, legend, orientation triad and scale bar."""
    figure = new_figure(camera.width, camera.height)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.imshow(image, interpolation="none", extent=(0, camera.width, camera.height, 0))
    axes.set_axis_off()
    axes.text(16, 14, title, fontsize=17, fontweight="bold", va="top")
    for row, (name, colour) in enumerate(legend.items()):
        y = 60 + 24 * row
        axes.scatter([25], [y], s=110, color=[colour], edgecolors="0.25", linewidths=0.7)
        axes.text(41, y, name, fontsize=13, va="center", path_effects=[withStroke(linewidth=3, foreground="white")])
    _triad(axes, camera)
    _scale_bar(axes, camera)
    return figure, axes


def _triad(axes: Axes, camera: Camera) -> None:
    """Arrows towards the patient's left, front and head; those that point away from the viewer are paler."""
    origin = np.array([66.0, camera.height - 62.0])
    drawn: list[tuple[float, FloatArray, str]] = []
    for direction, letter in _AXES:
        flat = 44.0 * np.array([direction @ camera.right, -(direction @ camera.up)])
        drawn.append((float(direction @ camera.forward), flat, letter))
    for depth, flat, letter in sorted(drawn, key=lambda arrow: -arrow[0]):
        shade = "0.55" if depth > 0.3 else "0.1"
        tip, length = origin + flat, float(np.hypot(*flat))
        if length > 3.0:
            style = {"arrowstyle": "-|>", "color": shade, "lw": 1.6, "shrinkA": 0, "shrinkB": 0}
            axes.annotate("", (tip[0], tip[1]), (origin[0], origin[1]), arrowprops=style)
        x, y = tip + 12.0 * flat / max(length, 1.0)
        axes.text(x, y, letter, fontsize=13, color=shade, ha="center", va="center")


def _scale_bar(axes: Axes, camera: Camera) -> None:
    length = next(
        mm for mm in (200, 100, 50, 20, 10, 5, 2, 1) if mm / camera.mm_per_pixel < camera.width / 5 or mm == 1
    )
    end, y = camera.width - 24.0, camera.height - 24.0
    start = end - length / camera.mm_per_pixel
    axes.plot([start, end], [y, y], color="0.1", lw=2.5, solid_capstyle="butt")
    axes.text((start + end) / 2.0, y - 6.0, f"{length} mm", fontsize=12.5, ha="center", va="bottom")
