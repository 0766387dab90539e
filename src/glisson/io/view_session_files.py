"""A session of laparoscope views (`session.toml`): pictures, poses, the touched point, and what was clicked."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from glisson.core.arrays import FloatArray, unit_vector
from glisson.core.camera import Camera
from glisson.core.errors import BadInput
from glisson.core.transform import RigidTransform
from glisson.io.camera_files import read_camera
from glisson.io.records import Record, read_record

_SCHEMA = 1
_UNKNOWN_ROLL_RAD = np.pi


@dataclass(frozen=True, eq=False)
class SessionView:
    """One view: what of `tip_px` and `image` is None was not given; `landmarks_px` has (2,) by name."""

    name: str
    image: Path | None
    camera: Camera
    room_from_camera: RigidTransform
    tip_px: FloatArray | None
    landmarks_px: dict[str, FloatArray]


@dataclass(frozen=True, eq=False)
class ViewSession:
    """All views; see `glisson.core.views.ViewSet`."""

    views: tuple[SessionView, ...]
    touched_mm: FloatArray
    touched_covariance_mm2: FloatArray
    tip_sigma_px: float
    landmark_sigma_px: float
    find_features: bool
    hand_eye_covariance: FloatArray | None


def read_view_session(path: str | Path) -> ViewSession:
    """A session; files that it names lie beside it unless their paths are absolute.

    Raises:
        BadInput: absent, damaged, an unknown key, a number that is not finite, no rotation, or a landmark outside the
            image, named by its key path; or two views of one name.
    """
    file = Path(path)
    with read_record(file, "a session of views", _SCHEMA) as record:
        camera = record.text("camera") if record.has("camera") else None
        touched = record.record("touched")
        point, covariance = touched.floats("point_mm", 3), _covariance(touched, "covariance_mm2", 3, ("sigma_mm",))
        touched.finish()
        hand_eye = None
        if record.has("hand_eye"):
            common = record.record("hand_eye")
            hand_eye = _covariance(common, "covariance", 6, ("sigma_deg", "sigma_mm"))
            common.finish()
        views = tuple(_view(entry, file.parent, camera, at) for at, entry in enumerate(record.records("views"), 1))
        names = [view.name for view in views]
        if doubled := next((name for name in names if names.count(name) > 1), None):
            raise BadInput(f"Two views have the name {doubled!r}.")
        return ViewSession(
            views=views,
            touched_mm=point,
            touched_covariance_mm2=covariance,
            tip_sigma_px=record.number("tip_sigma_px", 1.5),
            landmark_sigma_px=record.number("landmark_sigma_px", 1.0),
            find_features=record.flag("find_features", True),
            hand_eye_covariance=hand_eye,
        )


def _view(record: Record, folder: Path, camera: str | None, number: int) -> SessionView:
    own = record.text("camera") if record.has("camera") else camera
    if own is None:
        raise BadInput(f"{record.where('camera')} is missing; give it here or once for all views.")
    landmarks = record.record("landmarks_px") if record.has("landmarks_px") else Record({})
    names = landmarks.keys()
    with record.building():
        view = SessionView(
            name=record.text("name", f"view {number}"),
            image=folder / record.text("image") if record.has("image") else None,
            camera=read_camera(folder / own),
            room_from_camera=_pose(record),
            tip_px=record.floats("tip_px", 2) if record.has("tip_px") else None,
            landmarks_px={name: landmarks.floats(name, 2) for name in names},
        )
    width, height = view.camera.width, view.camera.height
    clicked = {"tip_px": view.tip_px} if view.tip_px is not None else {}
    for name, (u, v) in (clicked | view.landmarks_px).items():
        if not (-0.5 <= u <= width - 0.5 and -0.5 <= v <= height - 0.5):
            raise BadInput(f"{view.name}: {name!r} at {u:g}, {v:g} px is outside the image of {width} × {height} px.")
    return view


def _pose(record: Record) -> RigidTransform:
    """From `rotation`, or from `direction` alone, which leaves the roll open."""
    if record.has("rotation") and record.has("direction"):
        raise BadInput(f"{record.where('rotation')} and {record.where('direction')}: give one of the two.")
    if record.has("rotation"):
        rotation = record.floats("rotation", 3, 3)
        roll = None
    else:
        forward = unit_vector(record.floats("direction", 3), record.where("direction"))
        across = np.eye(3)[int(np.argmin(np.abs(forward)))]
        right = np.cross(across, forward) / np.linalg.norm(np.cross(across, forward))
        rotation = np.column_stack([right, np.cross(forward, right), forward])
        roll = _UNKNOWN_ROLL_RAD
    if record.has("covariance"):
        covariance = record.floats("covariance", 6, 6)
    else:
        direction = np.radians(_positive(record, "sigma_direction_deg"))
        roll = roll or np.radians(_positive(record, "sigma_roll_deg"))
        covariance = np.zeros((6, 6))
        covariance[:3, :3] = rotation @ np.diag([direction**2, direction**2, roll**2]) @ rotation.T
        covariance[3:, 3:] = _positive(record, "sigma_position_mm") ** 2 * np.eye(3)
    return RigidTransform("room", "camera", rotation, record.floats("position_mm", 3), covariance)


def _covariance(record: Record, key: str, size: int, sigmas: tuple[str, ...]) -> FloatArray:
    """The covariance itself, or one that is diagonal, with each standard deviation for three coordinates."""
    if record.has(key):
        return record.floats(key, size, size)
    spread = [
        np.radians(_positive(record, name)) if name.endswith("deg") else _positive(record, name) for name in sigmas
    ]
    return np.diag(np.repeat(spread, 3) ** 2)


def _positive(record: Record, key: str) -> float:
    value = record.number(key)
    if value <= 0.0:
        raise BadInput(f"{record.where(key)} must be positive, not {value:g}.")
    return value
