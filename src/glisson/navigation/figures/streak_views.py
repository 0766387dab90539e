"""A scan before and after its streaks were lessened, in the slice that changed most."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from glisson.core.image import Volume
from glisson.navigation.figures.picture import DOTS_PER_INCH, new_figure

_WINDOW_HU = (-110.0, 190.0)
_WIDTH_PX, _TITLE_PX = 1500, 40


def write_streak_views(path: str | Path, before: Volume, after: Volume, lost: NDArray[np.bool_], axis: int) -> None:
    """Write a PNG: the axial slice before, after, and what was taken out; lost voxels [i, j, k] are orange.

    Both scans lie on one grid, whose array axis `axis` numbers the slices.
    """
    old, new = (np.moveaxis(np.asarray(one.voxels, dtype=np.float32), axis, 2) for one in (before, after))
    k = int(np.argmax(((new - old) ** 2).sum(axis=(0, 1))))
    change = old[:, :, k] - new[:, :, k]
    pictures = (
        (f"slice {k}, before", old[:, :, k], _WINDOW_HU, "gray"),
        ("after, with what is lost", new[:, :, k], _WINDOW_HU, "gray"),
        ("taken out", change, (-100.0, 100.0), "RdBu_r"),
    )
    width_mm, height_mm = np.delete(before.grid.spacing_mm * before.grid.shape, axis)
    picture_px = _WIDTH_PX / 3.0 * height_mm / width_mm
    figure = new_figure(_WIDTH_PX, round(picture_px + _TITLE_PX))
    share = picture_px / (picture_px + _TITLE_PX)
    for column, (title, picture, (low, high), colours) in enumerate(pictures):
        axes = figure.add_axes((0.005 + 0.333 * column, 0.0, 0.323, share))
        extent = (0.0, width_mm, height_mm, 0.0)
        axes.imshow(picture.T, cmap=colours, vmin=low, vmax=high, extent=extent)
        if column == 1:
            here = np.ma.masked_equal(np.moveaxis(lost, axis, 2)[:, :, k].T, False)
            axes.imshow(here, cmap="Wistia", vmin=0, vmax=1, alpha=0.5, extent=extent)
        axes.set_title(title, fontsize=13)
        axes.set_axis_off()
    figure.savefig(path, format="png", dpi=DOTS_PER_INCH, metadata={"Software": None})
