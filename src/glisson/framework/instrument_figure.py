"""An instrument as it was recognised, drawn on the image; and a chart of when which instrument was in use."""

from collections.abc import Sequence

import numpy as np
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from glisson.core.instruments import RINGS, SeenInstrument
from glisson.core.trocar import Trocar
from glisson.framework.camera_figure import on_image
from glisson.intraoperative.cameras.projection import project
from glisson.intraoperative.instruments.timeline import Use
from glisson.navigation.figures.colours import BLACK, BLUE, SKY, VERMILLION
from glisson.navigation.figures.picture import new_figure, pixels_of

_OUTLINED = [withStroke(linewidth=3, foreground="white")]
_DARKENED = [withStroke(linewidth=4, foreground="black")]
_ROW_PX, _FOOT_PX = 44, 70


def draw_instrument(image: NDArray[np.uint8], trocar: Trocar, seen: SeenInstrument) -> NDArray[np.uint8]:
    """The image with the wheel's circles, where its sectors begin, the axis, and name, pose and tip in words."""
    camera = trocar.camera
    x, y, z = seen.tip_mm
    sigma = float(np.sqrt(np.linalg.eigvalsh(seen.tip_covariance_mm2)[-1]))
    figure, axes = on_image(
        image,
        camera,
        f"{seen.instrument.name}: wheel {seen.distance_mm:.1f} mm away, {np.degrees(seen.angle_rad):.2f}° from the "
        f"channel, tip ({x:.1f}, {y:.1f}, {z:.1f}) ± {sigma:.1f} mm",
        "blue: the wheel as the pose predicts it; red: where its first sector begins; white: the axis towards the tip",
    )
    pose, radius = seen.trocar_from_instrument, 0.5 * seen.instrument.wheel_mm
    angles = np.linspace(0.0, 2.0 * np.pi, 181)
    round_ = radius * np.stack([np.cos(angles), np.sin(angles), np.zeros(181)], axis=1)
    for share in (1.0, RINGS.white, RINGS.outer, RINGS.inner):
        axes.plot(*project(camera, pose, share * round_).T, color=SKY, lw=1.6)
    axes.plot(*project(camera, pose, [[0.0, 0.0, 0.0], [1.25 * radius, 0.0, 0.0]]).T, color=VERMILLION, lw=2.0)
    # The axis up to half-way to the camera, beside which it passes.
    towards = np.linspace(0.0, 0.5 * seen.distance_mm, 30)[:, None] * [0.0, 0.0, 1.0]
    axes.plot(*project(camera, pose, towards).T, color="white", lw=2.0, ls="dashed", path_effects=_DARKENED)
    u, v = project(camera, pose, [[0.0, -1.2 * radius, 0.0]])[0]
    u, v = np.clip(u, 10.0, camera.width - 200.0), np.clip(v, 20.0, camera.height - 20.0)
    axes.text(u, v, seen.instrument.name, fontsize=16, color=BLACK, path_effects=_OUTLINED)
    return pixels_of(figure)


def draw_timeline(found: Sequence[Use], end_s: float) -> NDArray[np.uint8]:
    """A row for each instrument with a bar for each use, over the time from the first frame (s)."""
    names = list(dict.fromkeys(use.instrument for use in found))
    height = _ROW_PX * max(len(names), 1) + _FOOT_PX
    figure = new_figure(960, height)
    axes = figure.add_axes((0.20, (_FOOT_PX - 16) / height, 0.77, 1.0 - _FOOT_PX / height))
    for use in found:
        # A use of a single frame would have no width.
        wide = max(use.to_s - use.from_s, 0.003 * end_s)
        axes.barh(names.index(use.instrument), wide, left=use.from_s, height=0.6, color=BLUE)
    axes.set(xlim=(0.0, max(end_s, 1e-3)), ylim=(max(len(names), 1) - 0.4, -0.6), xlabel="time (s)")
    axes.set_yticks(range(len(names)), names, fontsize=12)
    axes.grid(axis="x", alpha=0.3)
    if not names:
        axes.text(0.5, 0.5, "no instrument was recognised", transform=axes.transAxes, ha="center", fontsize=13)
    return pixels_of(figure)
