"""Pages to print at true scale: flat shapes in mm, with a bar that tells whether the printer kept the scale."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from glisson.core import BadInput
from glisson.core.arrays import FloatArray, frozen_floats
from glisson.io.atomic import atomic_path

PAPER_MM = {"A4": (210.0, 297.0), "A3": (297.0, 420.0)}
"""Width and height of the papers, upright."""

BAR_MM = 100.0
SENTENCE = f"Print at 100 %, not fitted to the page, then measure: this bar must be {BAR_MM:.0f} mm long."

_MM_PER_INCH = 25.4
_MARGIN_MM = 8.0
"""Most printers leave the edge white."""
_FOOT_MM = 26.0
_HEAD_MM = 14.0


@dataclass(frozen=True, eq=False)
class Area:
    """A polygon (n, 2) in mm, x to the right and y up from the middle of the drawing, filled with a colour (0 to 1)."""

    corners_mm: FloatArray
    colour: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "corners_mm", frozen_floats(self.corners_mm, (None, 2), "corners of a printed area"))


@dataclass(frozen=True, eq=False)
class Sheet:
    """One page: a title, areas, each drawn over those before it, and words (x, y, text) in mm as the areas."""

    title: str
    areas: tuple[Area, ...]
    words: tuple[tuple[float, float, str], ...] = field(default=())

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height that the areas need about the middle."""
        reach = np.abs(np.concatenate([area.corners_mm for area in self.areas])).max(axis=0)
        return 2.0 * float(reach[0]), 2.0 * float(reach[1])


def write_true_scale_pdf(path: str | Path, sheets: Sequence[Sheet]) -> tuple[str, ...]:
    """Write sheets, each on the smallest paper that holds it, upright or across; the papers' names. Atomic.

    Raises:
        BadInput: a sheet does not fit on A3, or the place cannot be written.
        WriteFailed: the disk is full.
    """
    papers = [_paper(sheet) for sheet in sheets]
    with atomic_path(path) as temporary, PdfPages(temporary, metadata={"CreationDate": None}) as pdf:
        for sheet, (_, size) in zip(sheets, papers, strict=True):
            pdf.savefig(_drawn(sheet, size))
    return tuple(name for name, _ in papers)


def _paper(sheet: Sheet) -> tuple[str, tuple[float, float]]:
    wide, high = sheet.size_mm
    for name, (short, long) in PAPER_MM.items():
        for width, height in ((short, long), (long, short)):
            if wide <= width - 2.0 * _MARGIN_MM and high <= height - _HEAD_MM - _FOOT_MM:
                return name, (width, height)
    raise BadInput(f"{sheet.title!r} is {wide:.0f} × {high:.0f} mm and does not fit on A3; make it smaller.")


def _drawn(sheet: Sheet, size: tuple[float, float]) -> Figure:
    width, height = size
    figure = Figure(figsize=(width / _MM_PER_INCH, height / _MM_PER_INCH), facecolor="white")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    # The middle of the drawing is the middle of what head and foot leave.
    bottom = -0.5 * (height - _HEAD_MM - _FOOT_MM) - _FOOT_MM
    axes.set(xlim=(-0.5 * width, 0.5 * width), ylim=(bottom, bottom + height))
    axes.set_axis_off()
    for area in sheet.areas:
        axes.add_patch(Polygon(area.corners_mm, closed=True, facecolor=area.colour, edgecolor="none"))
    for x, y, text in sheet.words:
        axes.text(x, y, text, fontsize=9, ha="center", va="center")
    axes.text(0.0, bottom + height - _MARGIN_MM, sheet.title, fontsize=11, ha="center", va="top")
    _draw_bar(axes, bottom + 15.0)
    return figure


def _draw_bar(axes: Axes, y: float) -> None:
    """A bar with a tick for each 10 mm, and the sentence."""
    half = 0.5 * BAR_MM
    corners = np.array([[-half, y], [half, y], [half, y + 1.5], [-half, y + 1.5]])
    axes.add_patch(Polygon(corners, closed=True, facecolor="black", edgecolor="none"))
    for x in np.arange(-half, half + 1.0, 10.0):
        axes.plot([x, x], [y, y + 4.0], color="black", linewidth=0.4)
    axes.text(0.0, y - 2.0, SENTENCE, fontsize=8, ha="center", va="top")
