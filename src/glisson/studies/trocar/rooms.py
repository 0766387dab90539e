"""Random views of a room, and what is known of its crosses and of the camera."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.crosses import Cross, CrossLayout
from glisson.core.room import Room
from glisson.core.transform import RigidTransform
from glisson.intraoperative.trocar.codes import cross_codes
from glisson.io.recommended import recommended_camera, recommended_layout, recommended_room

RECOMMENDED, ANY, SURVEYED = "recommended", "any", "surveyed"
"""The layout that comes with Glisson, exactly known; 2 to 8 crosses anywhere, exactly known; the first, known from a
survey and seen by a camera that was calibrated."""

PLACE_MM, PLACE_RAD = 0.3, 0.0005
"""Standard deviations of a cross's surveyed place and turn, about what `glisson layout survey` tells."""

FOCAL_PX, CENTRE_PX, DISTORTION = 0.1, 0.1, 2e-4
"""Those of a calibrated camera; of its distortion only the first term errs."""


@dataclass(frozen=True, eq=False)
class View:
    """A true view, and layout and camera as the localiser is given them, with their covariances."""

    room: Room
    camera: Camera
    layout: CrossLayout
    room_from_trocar: RigidTransform
    given_camera: Camera
    given_layout: CrossLayout


def draw_view(kind: str, rng: np.random.Generator) -> View:
    """A view of a kind of layout."""
    room, camera = recommended_room(), recommended_camera()
    layout = _any_layout(room, rng) if kind == ANY else recommended_layout()
    pose = room.draw_pose(rng)
    if kind == SURVEYED:
        return View(room, camera, layout, pose, _calibrated(camera, rng), _surveyed(layout, rng))
    return View(room, camera, layout, pose, camera, layout)


def _any_layout(room: Room, rng: np.random.Generator) -> CrossLayout:
    """Crosses of one size, 150 to 500 mm, at random on ceiling and walls, so that their sheets do not overlap."""
    size = rng.uniform(150.0, 500.0)
    wanted = rng.integers(2, 9)
    codes = rng.permutation(len(cross_codes()))
    crosses: list[Cross] = []
    while len(crosses) < wanted:
        # The camera rarely sees the walls, so most hang above.
        area = room.areas[0] if rng.random() < 0.8 else room.areas[rng.integers(1, len(room.areas))]
        across, along = (rng.uniform(-0.5, 0.5) * (side - 1.4 * size) for side in (area.width_mm, area.height_mm))
        centre = area.centre_mm + across * area.right + along * area.down
        if all(np.linalg.norm(centre - one.room_from_cross.translation_mm) > 1.9 * size for one in crosses):
            frame = np.column_stack([area.right, area.down, np.cross(area.right, area.down)])
            turned = frame @ Rotation.from_euler("z", rng.uniform(0.0, 2.0 * np.pi)).as_matrix()
            pose = RigidTransform("room", "cross", turned, centre)
            crosses.append(Cross(f"cross {len(crosses) + 1}", cross_codes()[codes[len(crosses)]], size, pose))
    return CrossLayout(tuple(crosses))


def _surveyed(layout: CrossLayout, rng: np.random.Generator) -> CrossLayout:
    sigmas = np.array([PLACE_RAD] * 3 + [PLACE_MM] * 3)
    crosses = []
    for cross in layout.crosses:
        step = rng.normal(size=6) * sigmas
        given = replace(cross.room_from_cross.moved(step), covariance=np.diag(sigmas**2))
        crosses.append(replace(cross, room_from_cross=given))
    return CrossLayout(tuple(crosses))


def _calibrated(camera: Camera, rng: np.random.Generator) -> Camera:
    sigmas = np.array([FOCAL_PX] * 2 + [CENTRE_PX] * 2 + [DISTORTION, 0.0, 0.0, 0.0, 0.0])
    step = rng.normal(size=9) * sigmas
    return Camera(
        camera.width, camera.height, camera.focal_px + step[:2], camera.centre_px + step[2:4],
        camera.distortion + step[4:], np.diag(sigmas**2),
    )  # fmt: skip


def errors(found: RigidTransform, true: RigidTransform, tool_mm: float) -> tuple[float, float, float]:
    """Position error (mm), angle (degrees), and error of the tip (mm) of a tool along the trocar's axis."""
    turned = Rotation.from_matrix(found.rotation @ true.rotation.T).magnitude()
    tip: FloatArray = np.array([0.0, 0.0, -tool_mm])
    return (
        float(np.linalg.norm(found.translation_mm - true.translation_mm)),
        float(np.rad2deg(turned)),
        float(np.linalg.norm(found.apply(tip) - true.apply(tip))),
    )
