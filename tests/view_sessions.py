"""Sessions of laparoscope views of the half-sphere box, written as a user would have them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import tomli_w

from glisson.core.views import ViewSet
from glisson.io.camera_files import write_camera
from glisson.phantom.half_sphere_box import CAMERA, HalfSphereBox, scope_place, touching_tool
from glisson.phantom.laparoscope_view import picture_through
from glisson.phantom.measured_views import ViewNoise

NOISE = ViewNoise(position_mm=0.08, direction_deg=0.16, roll_deg=0.16, touched_mm=0.08)


def session_table(views: ViewSet, noise: ViewNoise = NOISE) -> dict[str, Any]:
    """The session as a TOML table, tips and landmarks included."""
    seen = views.landmarks
    entries = []
    for number, view in enumerate(views.views):
        rows = np.flatnonzero(seen.view == number)
        entries.append({
            "name": view.name,
            "position_mm": view.room_from_camera.translation_mm.tolist(),
            "rotation": view.room_from_camera.rotation.tolist(),
            "sigma_position_mm": noise.position_mm,
            "sigma_direction_deg": noise.direction_deg,
            "sigma_roll_deg": noise.roll_deg,
            "tip_px": view.tip_px.tolist(),
            "landmarks_px": {views.names[seen.point[row]]: seen.pixels[row].tolist() for row in rows},
        })  # fmt: skip
    return {
        "schema": 1,
        "camera": "camera.toml",
        "tip_sigma_px": 1.5,
        "landmark_sigma_px": seen.sigma_px,
        "touched": {"point_mm": views.touched_mm.tolist(), "sigma_mm": noise.touched_mm},
        "views": entries,
    }


def write_session(folder: Path, table: dict[str, Any]) -> Path:
    """`session.toml` and `camera.toml` in a folder."""
    folder.mkdir(exist_ok=True)
    write_camera(folder / "camera.toml", CAMERA)
    path = folder / "session.toml"
    path.write_text(tomli_w.dumps(table), encoding="utf-8")
    return path


def add_pictures(folder: Path, table: dict[str, Any], angles_deg: Sequence[float]) -> None:
    """Render the views, and take the tips' pixels out of the table, so that they must be found."""
    for number, (entry, angle) in enumerate(zip(table["views"], angles_deg, strict=True)):
        rng = np.random.default_rng([1, number])
        picture = picture_through(CAMERA, scope_place(angle), HalfSphereBox(), touching_tool(), rng)
        cv2.imwrite(str(folder / f"view{number + 1}.png"), picture[:, :, ::-1])
        entry["image"] = f"view{number + 1}.png"
        del entry["tip_px"]
