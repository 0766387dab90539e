"""What was seen in laparoscope views, drawn on them."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from glisson.core.views import ViewSet
from glisson.io.atomic import atomic_path
from glisson.navigation.figures.colours import BLUE, ORANGE, VERMILLION, YELLOW
from glisson.navigation.figures.picture import DOTS_PER_INCH, new_figure

_WIDTH_PX = 720
_MOST = 4
_OUTLINE = (withStroke(linewidth=3, foreground="black"),)


def draw_views(views: ViewSet, images: Sequence[NDArray[np.uint8] | None], path: Path) -> None:
    """Draw the first four views two by two, with tip, principal point, landmarks and features, into a PNG.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    shown = min(len(views.views), _MOST)
    across, down = min(shown, 2), (shown + 1) // 2
    camera = views.views[0].camera
    height = round(_WIDTH_PX * camera.height / camera.width)
    figure = new_figure(across * _WIDTH_PX, down * height)
    for number in range(shown):
        axes = figure.add_axes(((number % 2) / across, 1.0 - (number // 2 + 1) / down, 1.0 / across, 1.0 / down))
        _draw(axes, views, number, images[number])
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=DOTS_PER_INCH, metadata={"Software": None})


def _draw(axes: Axes, views: ViewSet, number: int, image: NDArray[np.uint8] | None) -> None:
    view = views.views[number]
    size = (view.camera.height, view.camera.width)
    axes.imshow(np.full((*size, 3), 60, dtype=np.uint8) if image is None else image)
    axes.set(xlim=(0, size[1]), ylim=(size[0], 0))
    axes.set_axis_off()
    features, landmarks = views.features, views.landmarks
    seen = features.pixels[features.view == number]
    axes.plot(*seen.T, ".", color=YELLOW, ms=4, label=f"{len(seen)} features")
    rows = np.flatnonzero(landmarks.view == number)
    axes.plot(*landmarks.pixels[rows].T, "o", mfc="none", mec=ORANGE, mew=2, ms=11, label="landmarks")
    for row in rows:
        u, v = landmarks.pixels[row]
        axes.text(u + 12, v - 10, views.names[landmarks.point[row]], color="white", fontsize=11, path_effects=_OUTLINE)
    axes.plot(*view.tip_px, "x", color=VERMILLION, mew=3, ms=14, label="tip of the tool T′")
    axes.plot(*view.camera.centre_px, "+", color=BLUE, mew=3, ms=14, label="principal point H′")
    axes.text(
        0.02, 0.97, view.name, transform=axes.transAxes, va="top", color="white", fontsize=14, path_effects=_OUTLINE
    )
    axes.legend(loc="lower right", fontsize=10, framealpha=0.85)
