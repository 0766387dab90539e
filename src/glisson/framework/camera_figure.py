"""The frame in which all pictures of a camera's image are drawn: two lines of words above, pixels below."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from glisson.core.camera import Camera
from glisson.navigation.figures.picture import new_figure

_HEAD_PX = 64


def on_image(image: NDArray[np.uint8], camera: Camera, outcome: str, legend: str) -> tuple[Figure, Axes]:
    """A figure that shows an image pixel by pixel, and axes in its pixels (u right, v down)."""
    height = camera.height + _HEAD_PX
    figure = new_figure(camera.width, height)
    axes = figure.add_axes((0.0, 0.0, 1.0, camera.height / height))
    axes.imshow(image, interpolation="none", extent=(-0.5, camera.width - 0.5, camera.height - 0.5, -0.5))
    axes.set_axis_off()
    axes.set(xlim=(-0.5, camera.width - 0.5), ylim=(camera.height - 0.5, -0.5), autoscale_on=False)
    figure.text(0.01, 1.0 - 20 / height, outcome, fontsize=13, va="center")
    figure.text(0.01, 1.0 - 46 / height, legend, fontsize=11, va="center", color="0.3")
    return figure, axes
