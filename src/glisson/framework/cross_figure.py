"""What a localiser saw, drawn on the image of a trocar's camera."""

import numpy as np
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from glisson.core.camera import Camera
from glisson.core.crosses import CrossLayout
from glisson.core.localisation import Localisation
from glisson.framework.camera_figure import on_image
from glisson.intraoperative.cameras.projection import project
from glisson.navigation.figures.colours import BLACK, ORANGE, SKY
from glisson.navigation.figures.picture import pixels_of

_OUTLINED = [withStroke(linewidth=3, foreground="white")]


def draw_localisation(
    image: NDArray[np.uint8], camera: Camera, layout: CrossLayout, found: Localisation
) -> NDArray[np.uint8]:
    """The image with the measured corners, the outlines that the pose predicts, and the outcome."""
    legend = "blue lines: crosses as the pose predicts them; orange circles: measured corners"
    figure, axes = on_image(image, camera, f"{found.status}: {found.message}", legend)
    if found.room_from_trocar is not None:
        camera_from_room = found.room_from_trocar.inverse()
        for cross in layout.crosses:
            in_camera = camera_from_room.apply(cross.corners_mm)
            slopes = np.abs(in_camera[:, :2] / np.maximum(in_camera[:, 2:], 1e-6)).max()
            if cross.name not in found.crosses or slopes > 3.0:
                continue
            corners = project(camera, camera_from_room, cross.corners_mm)
            outline = np.vstack([corners, corners[:1]])
            axes.plot(*outline.T, color=SKY, lw=1.6)
            u, v = np.clip(outline.max(axis=0) + 6.0, 12.0, [camera.width - 150.0, camera.height - 24.0])
            axes.text(u, v, cross.name, fontsize=13, color=BLACK, path_effects=_OUTLINED)
    if found.corners_px is not None and len(found.corners_px):
        axes.plot(*found.corners_px.T, "o", mfc="none", mec=ORANGE, ms=8, mew=1.8)
    return pixels_of(figure)
