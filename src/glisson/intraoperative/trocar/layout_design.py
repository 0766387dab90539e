"""Where to hang crosses in a room, by the tip error that they predict."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.crosses import BOARD_SHARE, Cross, CrossLayout
from glisson.core.errors import BadInput
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, silent
from glisson.core.room import HangingArea, Room
from glisson.core.transform import RigidTransform, cross_matrix
from glisson.intraoperative.cameras.projection import project, project_with_jacobian
from glisson.intraoperative.trocar.codes import Code, cross_codes

_CORNER_PX = 0.05
_LEAST_EDGE_PX = 10.0
_HIDDEN = 0.25
"""Share of crosses that lamps and people cover at any time."""

_PRIOR_RAD, _PRIOR_MM = 1.0, 500.0
"""What is known without crosses: standard deviations of the orientation and the position."""

_ROUNDS = 4


@dataclass(frozen=True)
class DesignParameters:
    """What crosses there are, and what they are for."""

    count: int = parameter(15, "Number of crosses.", 2, len(cross_codes()))
    size_mm: float = parameter(400.0, "Size of the crosses, mm.", 50.0, 2000.0)
    tool_mm: float = parameter(300.0, "Length of the tool whose tip is to be known, mm.", 0.0, 1000.0)
    views: int = parameter(300, "Number of random views.", 10, 10000)
    spacing_mm: float = parameter(400.0, "Distance of the places that are tried, mm.", 50.0, 5000.0)


@dataclass(frozen=True, eq=False)
class Design:
    """A layout, the predicted tip error of each view (v,) in mm, and how many crosses each shows whole (v,)."""

    layout: CrossLayout
    tip_mm: FloatArray
    visible: NDArray[np.int64]


def design_layout(
    room: Room, camera: Camera, parameters: DesignParameters, seed: int = 0, progress: Progress = silent
) -> Design:
    """Crosses whose predicted tip error is the least: the mean of its logarithm over random views.

    Places are added one by one, each the best there is, and then exchanged as long as that helps. A quarter of the
    crosses, drawn for each view, counts as covered.

    Args:
        room: where crosses may hang and the trocar may be.
        camera: of the trocar.
        parameters: number and size of the crosses.
        seed: of the views.
        progress: told how far it is.

    Raises:
        BadInput: there are fewer places than crosses.
    """
    places = _places(room, parameters)
    if len(places) < parameters.count:
        raise BadInput(
            f"The room has {len(places)} places for crosses of {parameters.size_mm:g} mm, fewer than "
            f"{parameters.count}; give it more areas, or take fewer crosses."
        )
    rng = np.random.default_rng(seed)
    views = [room.draw_pose(rng) for _ in range(parameters.views)]
    table = _Prediction(places, views, camera, parameters, rng)
    chosen: list[int] = []
    for number in range(parameters.count):
        progress(number / (parameters.count + _ROUNDS), f"{number} of {parameters.count} crosses have a place")
        chosen.append(_best(table, chosen, places, parameters.size_mm))
    for exchange in range(_ROUNDS):
        progress((parameters.count + exchange) / (parameters.count + _ROUNDS), "exchanging places")
        before = list(chosen)
        for number in range(parameters.count):
            others = chosen[:number] + chosen[number + 1 :]
            chosen[number] = _best(table, others, places, parameters.size_mm)
        if chosen == before:
            break
    crosses = tuple(_hung(places[k], n, cross_codes()[n], parameters.size_mm) for n, k in enumerate(sorted(chosen)))
    return Design(CrossLayout(crosses), table.tip_errors(chosen), table.whole[:, chosen].sum(axis=1))


@dataclass(frozen=True, eq=False)
class _Place:
    area: HangingArea
    centre_mm: FloatArray


def _places(room: Room, parameters: DesignParameters) -> list[_Place]:
    """Evenly spaced places at which the whole sheet lies within its area."""
    places = []
    for area in room.areas:
        sides = [side - parameters.size_mm * BOARD_SHARE for side in (area.width_mm, area.height_mm)]
        if min(sides) >= 0.0:
            across, along = (np.linspace(-0.5, 0.5, int(side / parameters.spacing_mm) + 1) * side for side in sides)
            places += [_Place(area, area.centre_mm + x * area.right + y * area.down) for x in across for y in along]
    return places


def _hung(place: _Place, number: int, code: Code, size_mm: float) -> Cross:
    rotation = np.column_stack([place.area.right, place.area.down, np.cross(place.area.right, place.area.down)])
    pose = RigidTransform("room", "cross", rotation, place.centre_mm)
    return Cross(f"{place.area.name} {number + 1}", code, size_mm, pose)


class _Prediction:
    """What each place tells of each view."""

    def __init__(
        self, places: list[_Place], views: list[RigidTransform], camera: Camera, parameters: DesignParameters,
        rng: np.random.Generator,
    ) -> None:  # fmt: skip
        crosses = [_hung(place, 0, cross_codes()[0], parameters.size_mm) for place in places]
        self.whole = np.zeros((len(views), len(places)), dtype=bool)
        self._normal = np.zeros((len(views), len(places), 6, 6))
        covered = rng.random(self.whole.shape) < _HIDDEN
        self._tip = np.zeros((len(views), 3, 6))
        for v, room_from_trocar in enumerate(views):
            camera_from_room = _to_camera(room_from_trocar)
            self._tip[v] = _tip_by_pose(camera_from_room, parameters.tool_mm)
            for k, cross in enumerate(crosses):
                if not covered[v, k] and is_whole(cross, camera, camera_from_room):
                    self.whole[v, k] = True
                    _, by_all = project_with_jacobian(camera, camera_from_room, cross.corners_mm)
                    by_pose = by_all[:, :, :6].reshape(-1, 6) / _CORNER_PX
                    self._normal[v, k] = by_pose.T @ by_pose

    def tip_errors(self, chosen: list[int]) -> FloatArray:
        """Predicted error (v,) of the tip, mm, with crosses at some places; where two are not seen that without any."""
        prior = np.diag(1.0 / np.array([_PRIOR_RAD] * 3 + [_PRIOR_MM] * 3) ** 2)
        seen = self.whole[:, chosen].sum(axis=1) >= 2
        normal = prior + np.where(seen[:, None, None], self._normal[:, chosen].sum(axis=1), 0.0)
        covariance = self._tip @ np.linalg.solve(normal, self._tip.transpose(0, 2, 1))
        return np.asarray(np.sqrt(np.trace(covariance, axis1=1, axis2=2)))


def _best(table: _Prediction, others: list[int], places: list[_Place], size_mm: float) -> int:
    """The place that, beside others, makes the least error; sheets do not overlap.

    Until two crosses are seen nothing is known, so that of places that are equally good the one that most views show
    is taken.
    """
    taken = [places[k].centre_mm for k in others]
    apart = size_mm * BOARD_SHARE * np.sqrt(2.0)
    free = [
        k
        for k, place in enumerate(places)
        if k not in others and all(np.linalg.norm(place.centre_mm - centre) >= apart for centre in taken)
    ]
    if not free:
        raise BadInput("The areas have no room for so many crosses; take fewer or smaller ones.")
    return min(free, key=lambda k: (np.mean(np.log(table.tip_errors([*others, k]))), -table.whole[:, k].sum()))


def is_whole(cross: Cross, camera: Camera, camera_from_room: RigidTransform) -> bool:
    """Whether all of a cross's front is in the image, large enough to be measured."""
    in_camera = camera_from_room.apply(cross.corners_mm)
    into_wall = camera_from_room.rotation @ cross.room_from_cross.rotation[:, 2]
    if (in_camera[:, 2] <= 1.0).any() or in_camera[0] @ into_wall <= 0.0:
        return False
    # Beyond the image the distortion's polynomial may come back into it.
    if (np.abs(in_camera[:, :2] / in_camera[:, 2:]) > [camera.width, camera.height] / camera.focal_px).any():
        return False
    pixels = project(camera, camera_from_room, cross.corners_mm)
    inside = (pixels > 3.0).all() and (pixels < [camera.width - 4.0, camera.height - 4.0]).all()
    edges = np.linalg.norm(np.roll(pixels, -1, axis=0) - pixels, axis=1)
    return bool(inside and edges.min() > _LEAST_EDGE_PX)


def _to_camera(room_from_trocar: RigidTransform) -> RigidTransform:
    back = room_from_trocar.inverse()
    return RigidTransform("camera", "room", back.rotation, back.translation_mm)


def _tip_by_pose(camera_from_room: RigidTransform, tool_mm: float) -> FloatArray:
    """Derivative (3, 6) of the tip in the room by d and e of camera_from_room; the tool lies inwards along the axis."""
    back = camera_from_room.rotation.T
    arm = np.array([0.0, 0.0, -tool_mm]) - camera_from_room.translation_mm
    return np.hstack([back @ cross_matrix(arm), -back])
