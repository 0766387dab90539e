"""Instruments recognised in rendered views of the trocar's camera: some before a room, with the tip placed in it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.instruments import InstrumentLibrary, SeenInstrument
from glisson.core.trocar import Trocar
from glisson.intraoperative.instruments.colour_wheel import ColourWheel, ColourWheelParameters
from glisson.intraoperative.trocar.global_localiser import GlobalLocaliser
from glisson.intraoperative.trocar.localiser import LocaliserParameters
from glisson.io.instrument_files import EXAMPLE_LIBRARY, EXAMPLE_TROCAR, read_instruments, read_trocar
from glisson.phantom.room_scene import draw_scene as draw_room
from glisson.phantom.room_view import RoomViews
from glisson.phantom.wheel_scene import WheelScene, draw_scene
from glisson.phantom.wheel_view import WheelViews
from glisson.studies.point import Outcome, Task
from glisson.studies.tables import distribution
from glisson.studies.trocar.rooms import RECOMMENDED, View, draw_view

RECOGNITION = Task(
    f"{__name__}:recognise_views",
    ("glisson.core", "glisson.geometry", "glisson.intraoperative.trocar", "glisson.intraoperative.instruments",
     "glisson.intraoperative.cameras.projection", "glisson.io", "glisson.phantom.optics", "glisson.phantom.photograph",
     "glisson.phantom.room_scene", "glisson.phantom.room_view", "glisson.phantom.wheel_scene",
     "glisson.phantom.wheel_view", "glisson.phantom.wheel_light", "glisson.studies.trocar.rooms", __name__),
)  # fmt: skip

OTHER_SIZE = 1.25
"""Each wheel is also looked for as if it were so many times as wide as it is."""

_CHI2_90 = 6.251388631170325
"""Squared radius that holds 90 % of a normal distribution in three dimensions."""

Row = dict[str, Any]


def recognise_views(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """A row for each view: what was recognised, and how far off the tip is."""
    trocar, library = read_trocar(EXAMPLE_TROCAR), read_instruments(EXAMPLE_LIBRARY)
    recogniser = ColourWheel(ColourWheelParameters())
    rows = []
    for number in range(inputs["first"], inputs["first"] + inputs["count"]):
        rng = np.random.default_rng([inputs["stream"], 3, int(inputs["in_room"]), number])
        scene = draw_scene(trocar, library.instruments, rng)
        room = draw_view(RECOMMENDED, rng) if inputs["in_room"] else None
        image = _picture(trocar, scene, room, rng)
        if number == inputs["first"]:  # what is compiled or loaded at the first call is no part of the time
            _recognised(recogniser, image, trocar, library)
        started = perf_counter()
        status, seen = _recognised(recogniser, image, trocar, library)
        milliseconds = 1e3 * (perf_counter() - started)
        row = {"number": number, "in_room": inputs["in_room"], "instrument": scene.instrument.name, "status": status}
        wider = tuple(replace(one, wheel_mm=OTHER_SIZE * one.wheel_mm) for one in library.instruments)
        other, _ = _recognised(recogniser, image, trocar, InstrumentLibrary(wider))
        row |= {"milliseconds": milliseconds, "other_size_status": other, **_scores(seen, scene)}
        rows.append(row | _in_room(image, trocar, seen, scene, room))
    return Outcome({"rows": rows})


def recognition_values(rows: Sequence[Row]) -> dict[str, Any]:
    """Counts, and the errors of what was recognised; None for what no view tells."""
    seen = [row for row in rows if row["right"] is not None]
    in_room = [row for row in rows if row["in_room"]]
    placed = [row for row in in_room if row["room_tip_mm"] is not None]
    return {
        "views": len(rows),
        "right": sum(row["right"] for row in seen),
        "wrong": sum(not row["right"] for row in seen),
        "flagged": len(rows) - len(seen),
        "tip_mm": distribution([row["tip_mm"] for row in seen]),
        "axis_deg": distribution([row["axis_deg"] for row in seen]),
        "coverage90": _mean(seen, "inside90"),
        "milliseconds": distribution([row["milliseconds"] for row in seen]),
        "in_room": len(in_room),
        "placed": len(placed),
        "room_tip_mm": distribution([row["room_tip_mm"] for row in placed]),
        "room_coverage90": _mean(placed, "room_inside90"),
        "other_size_flagged": _mean([{"flagged": row["other_size_status"] != "converged"} for row in rows], "flagged"),
    }


@cache
def _views() -> tuple[WheelViews, RoomViews]:
    camera = read_trocar(EXAMPLE_TROCAR).camera
    return WheelViews(camera), RoomViews(camera)


def _picture(trocar: Trocar, scene: WheelScene, room: View | None, rng: np.random.Generator) -> NDArray[np.uint8]:
    wheels, rooms = _views()
    if room is None:
        return wheels.view(scene)
    around = draw_room(room.room, room.layout, room.room_from_trocar, rng)
    return wheels.view(scene, rooms.light(around, room.room_from_trocar, rng))


def _recognised(
    recogniser: ColourWheel, image: NDArray[np.uint8], trocar: Trocar, library: InstrumentLibrary
) -> tuple[str, SeenInstrument | None]:
    try:
        return "converged", recogniser.recognise(image, trocar, library)
    except StageFailed as failure:
        return str(failure.status), None


def _scores(seen: SeenInstrument | None, scene: WheelScene) -> Row:
    if seen is None:
        return dict.fromkeys(("right", "tip_mm", "axis_deg", "inside90"))
    true = scene.trocar_from_instrument
    off = seen.tip_mm - true.apply(scene.instrument.tip_mm)
    axes = seen.trocar_from_instrument.rotation[:, 2], true.rotation[:, 2]
    return {
        "right": seen.instrument.name == scene.instrument.name,
        "tip_mm": float(np.linalg.norm(off)),
        "axis_deg": float(np.degrees(np.arctan2(np.linalg.norm(np.cross(*axes)), axes[0] @ axes[1]))),
        "inside90": _is_inside(off, seen.tip_covariance_mm2),
    }


def _in_room(
    image: NDArray[np.uint8], trocar: Trocar, seen: SeenInstrument | None, scene: WheelScene, room: View | None
) -> Row:
    """The tip in the room, by the crosses in the same picture; None where these do not tell the trocar's place."""
    none = dict.fromkeys(("room_tip_mm", "room_inside90"))
    if room is None or seen is None:
        return none
    place = GlobalLocaliser(LocaliserParameters()).localise(image, trocar.camera, room.layout)
    if not place.status.is_good or place.room_from_trocar is None:
        return none
    true = room.room_from_trocar.apply(scene.trocar_from_instrument.apply(scene.instrument.tip_mm))
    off = place.room_from_trocar.apply(seen.tip_mm) - true
    covariance = place.room_from_trocar.point_covariance(seen.tip_mm, seen.tip_covariance_mm2)
    return {"room_tip_mm": float(np.linalg.norm(off)), "room_inside90": _is_inside(off, covariance)}


def _is_inside(off: FloatArray, covariance: FloatArray) -> bool:
    return float(off @ np.linalg.solve(covariance, off)) < _CHI2_90


def _mean(rows: Sequence[Row], name: str) -> float | None:
    return float(np.mean([row[name] for row in rows])) if rows else None
