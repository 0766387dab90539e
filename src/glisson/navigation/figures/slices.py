"""Slices of the scan through the target with outlines of what was found in it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.ndimage import map_coordinates

from glisson.core.arrays import FloatArray
from glisson.core.image import Grid, LabelMap, Volume
from glisson.core.structures import Plane
from glisson.navigation.figures.colours import LIVER, PLANE, TUMOUR, VERMILLION, Rgb, is_outlined, structure_colour
from glisson.navigation.figures.picture import Picture, new_figure, picture

_PIXEL_MM = 0.8
_BORDER_MM = 20.0
_WIDTH_PX, _HEIGHT_PX, _GAP_PX = 1040.0, 900.0, 6.0
_CT_WINDOW_HU = (-110.0, 230.0)


@dataclass(frozen=True)
class _View:
    """A slice direction: LPS axes to the right and down the picture, and the letters at its edges."""

    name: str
    right: int
    down: int
    down_sign: float
    letters: tuple[str, str, str, str]

    @property
    def through(self) -> int:
        """The LPS axis that the slice stands across."""
        return 3 - self.right - self.down


# Radiological convention: the patient's left on the right, front up in axial, head up in the others.
_VIEWS = (
    _View("axial", 0, 1, 1.0, ("R", "L", "A", "P")),
    _View("coronal", 0, 2, -1.0, ("R", "L", "S", "I")),
    _View("sagittal", 1, 2, -1.0, ("A", "P", "S", "I")),
)


def slice_views(
    volume: Volume,
    organ: LabelMap,
    tumours: LabelMap | None,
    structures: LabelMap | None,
    centre_mm: FloatArray,
    plane: Plane | None,
    wire_mm: FloatArray | None,
) -> Picture:
    """Axial, coronal and sagittal slices in A through a point (3,) in LPS mm, all at one scale."""
    bounds = _organ_bounds(organ)
    spans = np.ptp(bounds, axis=0)
    scale = min(_WIDTH_PX / (spans[0] + spans[1]), _HEIGHT_PX / (spans[1] + spans[2]))
    wide, deep, tall = spans * scale
    figure = new_figure(int(wide + deep + _GAP_PX), int(deep + tall + _GAP_PX))
    figure.set_facecolor("black")
    corners = ((0.0, tall + _GAP_PX, wide, deep), (0.0, 0.0, wide, tall), (wide + _GAP_PX, 0.0, deep, tall))
    outlined = _outlines(organ, tumours, structures)
    shown: set[str] = set()
    for view, (left, bottom, across, along) in zip(_VIEWS, corners, strict=True):
        whole = figure.bbox
        axes = figure.add_axes((left / whole.width, bottom / whole.height, across / whole.width, along / whole.height))
        shown |= _draw(axes, view, volume, outlined, centre_mm, bounds, plane, wire_mm)
    entries: list[tuple[str, Rgb]] = [(name, colour) for name, _, _, colour in outlined if name in shown]
    entries += [("planned plane", PLANE)] if plane is not None else []
    entries += [("wire, projected (dotted)", (1.0, 1.0, 1.0))] if wire_mm is not None else []
    _legend(figure, entries, wide + _GAP_PX + 24.0)
    place = ", ".join(f"{number:.0f}" for number in centre_mm).replace("-", "−")
    return picture(
        figure,
        "Axial, coronal and sagittal slices of the scan through the target with outlines of organ and structures.",
        f"The scan (A) through the target at ({place}) mm LPS, seen from the feet, from the front and from the "
        "patient's left. Outlines as found in the scan; the wire is projected.",
    )


def _organ_bounds(organ: LabelMap) -> FloatArray:
    """Corners (2, 3) of the organ's box in LPS mm with a border."""
    filled = organ.voxels != 0
    lines = [np.flatnonzero(filled.any(axis=others)) for others in ((1, 2), (0, 2), (0, 1))]
    lines = [line if len(line) else np.array([0, count - 1]) for line, count in zip(lines, filled.shape, strict=True)]
    corners = np.array([[line[0] for line in lines], [line[-1] for line in lines]])
    every = np.array([[corners[a, 0], corners[b, 1], corners[c, 2]] for a in (0, 1) for b in (0, 1) for c in (0, 1)])
    points = organ.grid.points_from_indices(every)
    return np.stack([points.min(axis=0) - _BORDER_MM, points.max(axis=0) + _BORDER_MM])


def _outlines(
    organ: LabelMap, tumours: LabelMap | None, structures: LabelMap | None
) -> list[tuple[str, LabelMap, int, Rgb]]:
    """Name, map, number and colour of each label, structures first so that organ and tumours lie on top."""
    found = []
    for labels, colours in ((structures, None), (organ, LIVER), (tumours, TUMOUR)):
        if labels is None:
            continue
        for number, name in labels.names.items():
            if (colours is not None or is_outlined(name)) and np.any(labels.voxels == number):
                found.append((name, labels, number, structure_colour(name) if colours is None else colours))
    return found


def _draw(
    axes: Axes,
    view: _View,
    volume: Volume,
    outlined: list[tuple[str, LabelMap, int, Rgb]],
    centre: FloatArray,
    bounds: FloatArray,
    plane: Plane | None,
    wire: FloatArray | None,
) -> set[str]:
    """Draw a slice; the names of the labels that it meets."""
    across = np.arange(bounds[0, view.right], bounds[1, view.right], _PIXEL_MM)
    along = np.arange(bounds[0, view.down], bounds[1, view.down], _PIXEL_MM)
    points = np.zeros((len(along), len(across), 3))
    points[:, :, view.right], points[:, :, view.down], points[:, :, view.through] = (
        across[None],
        along[:, None],
        centre[view.through],
    )
    low, high = _CT_WINDOW_HU if volume.modality == "CT" else np.percentile(volume.voxels, (1.0, 99.5))
    image = _sampled(volume.voxels, volume.grid, points, fill=float(low))
    extent = (across[0], across[-1], along[0], along[-1])
    axes.imshow(image, cmap="gray", vmin=low, vmax=high, origin="lower", extent=extent, interpolation="bilinear")
    met = set()
    for name, labels, number, colour in outlined:
        share = _sampled((labels.voxels == number).astype(np.float32), labels.grid, points, fill=0.0)
        if share.max() > 0.5 > share.min():
            axes.contour(across, along, share, [0.5], colors=[colour], linewidths=1.4)
            met.add(name)
    if plane is not None:
        heights = plane.distance_mm(points.reshape(-1, 3)).reshape(len(along), len(across))
        if heights.min() < 0.0 < heights.max():
            axes.contour(across, along, heights, [0.0], colors=[PLANE], linewidths=1.8, linestyles="dashed")
    if wire is not None:
        axes.plot(wire[:, view.right], wire[:, view.down], color="white", lw=1.2, ls=(0, (1, 1)))
    axes.plot(centre[view.right], centre[view.down], "+", color=VERMILLION, ms=11, mew=1.6)
    axes.set_xlim(across[0], across[-1])
    axes.set_ylim(*((along[-1], along[0]) if view.down_sign > 0.0 else (along[0], along[-1])))
    axes.set_xticks([])
    axes.set_yticks([])
    _letters(axes, view)
    return met


def _letters(axes: Axes, view: _View) -> None:
    style: Mapping[str, Any] = {"transform": axes.transAxes, "color": "white", "fontsize": 12, "fontweight": "bold"}
    backdrop = {"facecolor": "black", "alpha": 0.55, "edgecolor": "none", "boxstyle": "round,pad=0.2"}
    for letter, (x, y) in zip(view.letters, ((0.03, 0.5), (0.97, 0.5), (0.5, 0.97), (0.5, 0.03)), strict=True):
        axes.text(x, y, letter, ha="center", va="center", bbox=backdrop, **style)
    axes.text(0.03, 0.97, view.name, ha="left", va="top", bbox=backdrop, **style)


def _sampled(voxels: Any, grid: Grid, points: FloatArray, fill: float) -> FloatArray:
    """Linear interpolation of voxels at LPS points (r, c, 3)."""
    indices = grid.indices_from_points(points.reshape(-1, 3)).T
    # Only the slab of voxels that the slice meets is converted, not the whole scan.
    lower = np.clip(np.floor(indices.min(axis=1)).astype(int) - 1, 0, np.array(grid.shape) - 1)
    upper = np.clip(np.ceil(indices.max(axis=1)).astype(int) + 2, 1, np.array(grid.shape))
    if np.any(upper <= lower):
        return np.full(points.shape[:2], fill)
    slab = np.asarray(voxels[tuple(slice(a, b) for a, b in zip(lower, upper, strict=True))], dtype=np.float32)
    found = map_coordinates(slab, indices - lower[:, None], order=1, mode="constant", cval=fill)
    return np.asarray(found, dtype=np.float64).reshape(points.shape[:2])


def _legend(figure: Figure, entries: list[tuple[str, Rgb]], left_px: float) -> None:
    """Names and colours in the empty corner at the top right."""
    for row, (name, colour) in enumerate(entries):
        y = 1.0 - (30.0 + 22.0 * row) / figure.bbox.height
        figure.text(left_px / figure.bbox.width, y, "■", color=colour, fontsize=13, va="center")
        figure.text((left_px + 20.0) / figure.bbox.width, y, name, color="white", fontsize=11, va="center")
