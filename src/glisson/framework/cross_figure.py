"""What a localiser saw, drawn on the image of a trocar's camera."""

import cv2
import numpy as np
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from glisson.core.camera import Camera
from glisson.core.crosses import CrossLayout
from glisson.core.localisation import Localisation
from glisson.navigation.figures.colours import BLACK, ORANGE, SKY
from glisson.navigation.figures.picture import new_figure

_OUTLINED = [withStroke(linewidth=3, foreground="white")]


def draw_localisation(
    image: NDArray[np.uint8], camera: Camera, layout: CrossLayout, found: Localisation
) -> NDArray[np.uint8]:
    """The image with the measured corners, the outlines that the pose predicts, and the outcome."""
    figure = new_figure(camera.width, camera.height + 60)
    axes = figure.add_axes((0.0, 0.0, 1.0, camera.height / (camera.height + 60)))
    axes.imshow(image, interpolation="none", extent=(-0.5, camera.width - 0.5, camera.height - 0.5, -0.5))
    axes.set_axis_off()
    if found.room_from_trocar is not None:
        in_camera = found.room_from_trocar.inverse()
        for cross in layout.crosses:
            corners = in_camera.apply(cross.corners_mm)
            slopes = np.abs(corners[:, :2] / np.maximum(corners[:, 2:], 1e-6)).max()
            if cross.name not in found.crosses or slopes > 3.0:
                continue
            pixels, _ = cv2.projectPoints(corners, np.zeros(3), np.zeros(3), camera.matrix, camera.distortion)
            outline = np.vstack([pixels.reshape(-1, 2), pixels.reshape(-1, 2)[:1]])
            axes.plot(*outline.T, color=SKY, lw=1.6)
            u, v = np.clip(outline.max(axis=0) + 6.0, 12.0, [camera.width - 150.0, camera.height - 24.0])
            axes.text(u, v, cross.name, fontsize=13, color=BLACK, path_effects=_OUTLINED)
    if found.corners_px is not None and len(found.corners_px):
        axes.plot(*found.corners_px.T, "o", mfc="none", mec=ORANGE, ms=8, mew=1.8)
    axes.set(xlim=(-0.5, camera.width - 0.5), ylim=(camera.height - 0.5, -0.5))
    height = camera.height + 60
    figure.text(0.01, 1.0 - 20 / height, f"{found.status}: {found.message}", fontsize=13, va="center")
    figure.text(
        0.01, 1.0 - 45 / height, "blue lines: crosses as the pose predicts them; orange circles: measured corners",
        fontsize=11, va="center", color="0.3",
    )  # fmt: skip
    figure.canvas.draw()
    return np.asarray(figure.canvas.buffer_rgba(), dtype=np.uint8)[:, :, :3].copy()  # type: ignore[attr-defined]
