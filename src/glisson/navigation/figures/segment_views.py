"""Couinaud's segments as a picture: the liver from the front and from below, and three slices through it."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch
from skimage.measure import marching_cubes

from glisson.core.arrays import FloatArray
from glisson.core.image import LabelMap
from glisson.navigation.figures.picture import DOTS_PER_INCH, new_figure
from glisson.navigation.rendering.bodies import Body
from glisson.navigation.rendering.camera import framing
from glisson.navigation.rendering.ray_casting import cast

_COLOURS = (
    (0.60, 0.60, 0.60), (0.94, 0.89, 0.26), (0.90, 0.62, 0.00), (0.84, 0.37, 0.00),
    (0.34, 0.71, 0.91), (0.00, 0.45, 0.70), (0.80, 0.47, 0.65), (0.00, 0.62, 0.45),
)  # fmt: skip
"""Of the segments 1 to 8 (Okabe and Ito 2008, and a grey)."""
_VIEWS = (("from the front", (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), ("from below", (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)))
_SLICES = (("axial", 0, 1, "R", "L"), ("coronal", 0, 2, "R", "L"), ("sagittal", 1, 2, "A", "P"))
_VIEW_PX = (620, 440)
_STEP = 2  # voxels, of the surfaces


def write_segment_views(path: str | Path, segments: LabelMap) -> None:
    """Write a PNG of segments 1 to 8; slices are drawn through the liver's middle, along the patient's axes."""
    bodies = [body for number, colour in enumerate(_COLOURS, start=1) for body in _bodies(segments, number, colour)]
    corners = np.concatenate([body.vertices for body in bodies])
    figure = new_figure(2 * _VIEW_PX[0], 2 * _VIEW_PX[1])
    for column, (title, forward, up) in enumerate(_VIEWS):
        axes = figure.add_axes((0.5 * column, 0.5, 0.5, 0.5))
        axes.imshow(cast(bodies, framing(corners, forward, up, _VIEW_PX)))
        axes.set_axis_off()
        axes.text(0.02, 0.97, title, transform=axes.transAxes, va="top", fontsize=13)
    for column, view in enumerate(_SLICES):
        _draw_slice(figure.add_axes((0.01 + 0.33 * column, 0.06, 0.31, 0.40)), segments, corners, view)
    figure.legend(
        handles=[Patch(color=colour, label=f"segment {number}") for number, colour in enumerate(_COLOURS, start=1)],
        loc="lower center", ncols=8, fontsize=11, frameon=False,
    )  # fmt: skip
    figure.savefig(path, format="png", dpi=DOTS_PER_INCH, metadata={"Software": None})


def _bodies(segments: LabelMap, number: int, colour: tuple[float, float, float]) -> list[Body]:
    """The surface of a segment; none where it is too small to have one."""
    mask = np.pad(segments.voxels[::_STEP, ::_STEP, ::_STEP] == number, 1)
    if not mask.any():
        return []
    vertices, triangles, _, _ = marching_cubes(mask.astype(np.float32), 0.5)
    return [Body(segments.grid.points_from_indices(_STEP * (vertices - 1.0)), triangles.astype(np.int64), colour)]


def _draw_slice(axes: Axes, segments: LabelMap, corners: FloatArray, view: tuple[str, int, int, str, str]) -> None:
    title, right, down, first, last = view
    low, high = corners.min(axis=0) - 5.0, corners.max(axis=0) + 5.0
    across, along = (np.arange(low[axis], high[axis]) for axis in (right, down))
    points = np.tile(0.5 * (low + high), (len(along), len(across), 1))
    points[:, :, right], points[:, :, down] = across[None], along[:, None]
    cells = np.rint(segments.grid.indices_from_points(points.reshape(-1, 3))).astype(np.int64)
    inside = ((cells >= 0) & (cells < segments.grid.shape)).all(axis=1)
    numbers = np.zeros(len(cells), dtype=np.uint8)
    numbers[inside] = segments.voxels[tuple(cells[inside].T)]
    extent = (across[0], across[-1], along[0], along[-1])
    shown = numbers.reshape(len(along), len(across))
    axes.imshow(shown, cmap=ListedColormap([(1.0, 1.0, 1.0), *_COLOURS]), vmin=0, vmax=8, origin="lower", extent=extent)
    if down == 1:  # y grows backwards, and the front is drawn up
        axes.invert_yaxis()
    for letter, x in ((first, 0.01), (last, 0.96)):
        axes.text(x, 0.5, letter, transform=axes.transAxes, fontsize=12)
    axes.set_title(title, fontsize=12)
    axes.set_axis_off()
