"""The computations of the study: poses from rendered images, and from corners with drawn errors."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.localisation import Localisation
from glisson.core.status import Status
from glisson.intraoperative.trocar.corners import corners_at
from glisson.intraoperative.trocar.global_localiser import GlobalLocaliser
from glisson.intraoperative.trocar.guess_database import DatabaseParameters, GuessDatabase
from glisson.intraoperative.trocar.localiser import LocaliserParameters
from glisson.intraoperative.trocar.pose import pose_from_corners
from glisson.io.recommended import recommended_camera
from glisson.phantom.photograph import Sensor
from glisson.phantom.room_scene import bare_scene, draw_scene
from glisson.phantom.room_view import RoomViews
from glisson.studies.point import Outcome, Task
from glisson.studies.trocar.rooms import ANY, RECOMMENDED, SURVEYED, View, draw_view, errors

_PACKAGES = (
    "glisson.core", "glisson.geometry", "glisson.intraoperative.trocar", "glisson.intraoperative.cameras.projection",
    "glisson.io", "glisson.phantom.optics", "glisson.phantom.photograph", "glisson.phantom.room_scene",
    "glisson.phantom.room_view", "glisson.studies.trocar.rooms", __name__,
)  # fmt: skip
IMAGES = Task(f"{__name__}:localise_images", _PACKAGES)
CORNERS = Task(f"{__name__}:localise_corners", _PACKAGES)

KINDS = (RECOMMENDED, ANY, SURVEYED)
TOOL_MM = 300.0
_CORNER_PX = 0.05
_HIDDEN, _FALSE_CORNER, _MISREAD = 0.2, 0.03, 0.03


def localise_images(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """Rendered views, taken all the way from pixels: by both techniques."""
    views = _views()
    ours, database = GlobalLocaliser(LocaliserParameters()), GuessDatabase(DatabaseParameters())
    rows = []
    for number in _numbers(inputs):
        rng = np.random.default_rng([inputs["stream"], 1, KINDS.index(inputs["layout"]), number])
        view = draw_view(inputs["layout"], rng)
        scene = draw_scene(view.room, view.layout, view.room_from_trocar, rng)
        sensor = Sensor(rng.uniform(0.5, 1.1), rng.uniform(1.0, 4.0), rng.uniform(1.0, 4.0), rng.uniform(0.0, 0.3))
        image = views.view(scene, view.room_from_trocar, sensor, rng, gamma=rng.uniform(1.0, 2.4))
        visible = sum(views.visible(scene, cross, view.room_from_trocar) for cross in view.layout.crosses)
        if number == inputs["first"]:  # what is compiled or loaded at the first call is no part of the time
            ours.localise(image, view.given_camera, view.given_layout)
        started = perf_counter()
        found = ours.localise(image, view.given_camera, view.given_layout)
        milliseconds = 1e3 * (perf_counter() - started)
        other = database.localise(image, view.given_camera, view.given_layout)
        rows.append(
            _row("image", inputs, number, visible, found, view, milliseconds)
            | {f"database_{name}": value for name, value in _scores(other, view).items()}
        )
    return Outcome({"rows": rows})


def localise_corners(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """Corners seen by the renderer's optics with noise; a fifth of the crosses is covered, and there are false ones."""
    views = _views()
    ours = GlobalLocaliser(LocaliserParameters())
    rows = []
    for number in _numbers(inputs):
        rng = np.random.default_rng([inputs["stream"], 2, KINDS.index(inputs["layout"]), number])
        view = draw_view(inputs["layout"], rng)
        cross, corner, pixels = _drawn_corners(views, view, rng)
        visible = len(cross) // 12
        cross = _misread(cross, len(view.layout), rng)
        milliseconds = None
        found = Localisation(Status.UNOBSERVABLE, "No two crosses agree on a pose.")
        if visible >= 2:
            seen = corners_at(view.given_camera, view.given_layout, cross, corner, pixels, _CORNER_PX)
            if number == inputs["first"]:
                pose_from_corners(seen, view.given_camera, view.given_layout)
            started = perf_counter()
            pose = pose_from_corners(seen, view.given_camera, view.given_layout)
            milliseconds = 1e3 * (perf_counter() - started)
            if pose is not None:
                found = ours.judged(pose, seen, view.given_camera, view.given_layout)
        rows.append(_row("corners", inputs, number, visible, found, view, milliseconds))
    return Outcome({"rows": rows})


@cache
def _views() -> RoomViews:
    return RoomViews(recommended_camera())


def _numbers(inputs: Mapping[str, Any]) -> range:
    return range(inputs["first"], inputs["first"] + inputs["count"])


def _drawn_corners(views: RoomViews, view: View, rng: np.random.Generator) -> tuple[IntArray, IntArray, FloatArray]:
    """Crosses, corners and pixels of what is whole in the picture and not covered; some corners are false."""
    scene = bare_scene(view.room, view.layout)
    numbers = [
        number
        for number, cross in enumerate(view.layout.crosses)
        if views.visible(scene, cross, view.room_from_trocar) and rng.random() > _HIDDEN
    ]
    pixels = np.array([views.corners(view.layout.crosses[n], view.room_from_trocar) for n in numbers]).reshape(-1, 2)
    pixels = pixels + rng.normal(size=pixels.shape) * _CORNER_PX
    false = rng.random(len(pixels)) < _FALSE_CORNER
    pixels[false] += rng.normal(size=(int(false.sum()), 2)) * rng.uniform(0.3, 20.0)
    return np.repeat(numbers, 12).astype(np.int64), np.tile(np.arange(12), len(numbers)), pixels


def _misread(cross: IntArray, count: int, rng: np.random.Generator) -> IntArray:
    """One cross taken for another that is not seen."""
    seen = np.unique(cross)
    others = np.setdiff1d(np.arange(count), seen)
    if len(seen) and len(others) and rng.random() < _MISREAD:
        return np.where(cross == rng.choice(seen), rng.choice(others), cross)
    return cross


def _row(
    source: str, inputs: Mapping[str, Any], number: int, visible: int, found: Localisation, view: View,
    milliseconds: float | None,
) -> dict[str, Any]:  # fmt: skip
    return {
        "source": source,
        "layout": inputs["layout"],
        "number": number,
        "visible": visible,
        **_scores(found, view),
        "used": len(found.crosses),
        "bound_mm": found.position_bound_mm,
        "noise_px": found.noise_px,
        "milliseconds": milliseconds,
        "message": found.message,
    }


def _scores(found: Localisation, view: View) -> dict[str, Any]:
    """Status, and errors of the pose, also of one that is flagged."""
    if found.room_from_trocar is None:
        return {"status": found.status, "position_mm": None, "angle_deg": None, "tip_mm": None, "inside90": None}
    position, angle, tip = errors(found.room_from_trocar, view.room_from_trocar, TOOL_MM)
    covariance = found.room_from_trocar.covariance
    assert covariance is not None
    off = found.room_from_trocar.translation_mm - view.room_from_trocar.translation_mm
    inside = float(off @ np.linalg.solve(covariance[3:, 3:], off)) < _CHI2_90
    return {"status": found.status, "position_mm": position, "angle_deg": angle, "tip_mm": tip, "inside90": inside}


_CHI2_90 = 6.251388631170325
"""Squared radius that holds 90 % of a normal distribution in three dimensions."""
