"""The room, the trocar's camera and the layout of crosses that come with Glisson."""

from importlib.resources import as_file, files
from pathlib import Path

from glisson.core.camera import Camera
from glisson.core.crosses import CrossLayout
from glisson.core.room import Room
from glisson.io.camera_files import read_camera
from glisson.io.layout_files import read_layout
from glisson.io.room_files import read_room

_FOLDER = files("glisson.io") / "data" / "trocar"


def recommended_room() -> Room:
    """An operating room of 6 × 5 m."""
    with as_file(_FOLDER / "room.toml") as path:
        return read_room(path)


def recommended_camera() -> Camera:
    """A wide camera of 1280 × 960 px."""
    with as_file(_FOLDER / "camera.toml") as path:
        return read_camera(path)


def recommended_layout() -> CrossLayout:
    """What `glisson layout design` makes of that room and camera."""
    with as_file(_FOLDER / "layout.toml") as path:
        return read_layout(path)


def or_recommended_room(path: str | Path | None) -> Room:
    """The room of a file, or the one that comes with Glisson."""
    return recommended_room() if path is None else read_room(path)


def or_recommended_camera(path: str | Path | None) -> Camera:
    """The camera of a file, or the one that comes with Glisson."""
    return recommended_camera() if path is None else read_camera(path)
