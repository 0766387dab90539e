"""Where crosses hang that were put up by eye, from views of a calibrated camera and one measured distance."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from glisson.core.camera import Camera
from glisson.core.crosses import CrossLayout
from glisson.core.errors import BadInput, StageFailed
from glisson.core.status import Status
from glisson.core.transform import RigidTransform
from glisson.intraoperative.trocar.bundle import Bundle, adjusted
from glisson.intraoperative.trocar.corners import SeenCorners, corners_at, joined
from glisson.intraoperative.trocar.measurement import measure_corners
from glisson.intraoperative.trocar.outlines import cross_outlines
from glisson.intraoperative.trocar.pose import global_pose
from glisson.intraoperative.trocar.reading import read_crosses

_FACTOR = 2.0
"""A measured distance that makes the crosses larger or smaller by more is in another unit, or of other crosses."""

_AS_PRINTED = 0.02
"""Prints at true scale are as large as the layout says but for this share, and the sigmas below."""
_SIGMAS = 4.0


@dataclass(frozen=True)
class Distance:
    """A distance between the middles of two crosses, by name, as measured with a tape or a laser."""

    first: str
    second: str
    length_mm: float
    sigma_mm: float = 1.0


@dataclass(frozen=True, eq=False)
class Survey:
    """The layout as it hangs, each cross with covariance.

    `size_factor` ± `size_sigma` is how large the prints are beside what the layout says; the layout has it in its
    sizes. `residual_px` is the root mean square error of a corner's coordinate, `views` how many images were used.
    """

    layout: CrossLayout
    size_factor: float
    size_sigma: float
    residual_px: float
    views: int

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on what a person should look at."""
        if abs(self.size_factor - 1.0) < _AS_PRINTED + _SIGMAS * self.size_sigma:
            return ()
        return (
            f"By the measured distance the crosses are {self.size_factor:.3f} times as large as the layout says: "
            "measure the distance again, and a cross on its sheet; all places err as the distance does.",
        )


def survey_layout(
    images: Sequence[NDArray[np.uint8]], camera: Camera, layout: CrossLayout, distance: Distance
) -> Survey:
    """The places of all crosses of a layout.

    All are found anew. Of the layout names and colours are taken, sizes but for a common factor, and the frame: the
    middles of all crosses come as near to the designed ones as one motion of all can bring them.

    Args:
        images: [row, column, red green blue]; each cross in two at least, and all linked by what is seen together.
        camera: has taken them.
        layout: as designed.
        distance: sets the scale.

    Raises:
        BadInput: there are not two images, or the distance names no cross or cannot be that of the two.
        StageFailed: a cross is not seen often enough or not linked to the first.
    """
    if len(images) < 2:
        raise BadInput("A survey needs two images at least; take 20 or more, each cross in several of them.")
    names = [cross.name for cross in layout.crosses]
    if distance.first == distance.second or not {distance.first, distance.second} <= set(names):
        raise BadInput(f"The measured distance must be between two of the crosses {', '.join(names)}.")
    if not (np.isfinite(distance.length_mm) and distance.length_mm > 0.0):
        raise BadInput(f"The measured distance must be positive, not {distance.length_mm} mm.")
    measured = (_corners(image, camera, layout) for image in images)
    views = [corners for corners in measured if corners is not None and len(corners.crosses) >= 2]
    for number, name in enumerate(names):
        if sum(number in view.crosses for view in views) < 2:
            raise StageFailed(
                f"The cross {name!r} is not seen beside another in two images; take more of it.", Status.UNOBSERVABLE
            )
    bundle = _linked(views, camera, layout)
    first, second = names.index(distance.first), names.index(distance.second)
    _check_distance(bundle, first, second, distance)
    result = adjusted(bundle, camera, layout, first, second, distance.length_mm, distance.sigma_mm)
    crosses = tuple(
        replace(cross, size_mm=cross.size_mm * result.size_factor, room_from_cross=place)
        for cross, place in zip(layout.crosses, result.places, strict=True)
    )
    return Survey(CrossLayout(crosses), result.size_factor, result.size_sigma, result.residual_px, len(views))


def _check_distance(bundle: Bundle, first: int, second: int, distance: Distance) -> None:
    apart = float(np.linalg.norm(bundle.places[second].translation_mm - bundle.places[first].translation_mm))
    if not 1.0 / _FACTOR < distance.length_mm / apart < _FACTOR:
        raise BadInput(
            f"If the crosses are as large as the layout says, {distance.first!r} and {distance.second!r} hang about "
            f"{apart:.0f} mm apart, not {distance.length_mm:g} mm; give the measured distance of their middles in mm."
        )


def _corners(image: NDArray[np.uint8], camera: Camera, layout: CrossLayout) -> SeenCorners | None:
    """Corners of each cross that can be read, measured for itself: where it hangs is not known yet."""
    seen = []
    for read in read_crosses(image, cross_outlines(image), layout).crosses:
        alone = CrossLayout((layout.crosses[read.number],))
        corners = corners_at(camera, alone, np.zeros(12, dtype=np.int64), np.arange(12), read.corners_px, 1.0)
        for reach_px in (5.0, 3.0):
            pose = global_pose(corners)
            if pose is None:
                break
            about = RigidTransform("camera", "room", pose.rotation, pose.translation_mm)
            corners = measure_corners(image, camera, alone, about, reach_px)
        if len(corners) >= 8:
            seen.append(replace(corners, cross=np.full(len(corners), read.number)))
    return joined(seen) if seen else None


def _linked(views: Sequence[SeenCorners], camera: Camera, layout: CrossLayout) -> Bundle:
    """Places and poses to begin with: from cross to cross by the views that show both."""
    places: dict[int, RigidTransform] = {0: layout.crosses[0].room_from_cross}
    poses: dict[int, RigidTransform] = {}
    # camera_from_layout of each cross for itself, as if it hung where the layout says.
    alone = [{number: _alone(view, number) for number in view.crosses} for view in views]
    while len(poses) < len(views):
        known = [
            (int(np.sum(view.cross == number)), v, number)
            for v, view in enumerate(views)
            if v not in poses
            for number in view.crosses
            if number in places
        ]
        if not known:
            raise StageFailed(
                f"Nothing that is seen together links the cross {layout.crosses[0].name!r} with "
                f"{', '.join(cross.name for n, cross in enumerate(layout.crosses) if n not in places)}; take images "
                "that show both.",
                Status.UNOBSERVABLE,
            )
        _, v, number = max(known)
        poses[v] = alone[v][number].after(layout.crosses[number].room_from_cross).after(places[number].inverse())
        for other in views[v].crosses:
            if other not in places:
                in_camera = alone[v][other].after(layout.crosses[other].room_from_cross)
                places[other] = poses[v].inverse().after(in_camera)
    return Bundle(views, [poses[v] for v in range(len(views))], [places[n] for n in range(len(layout))])


def _alone(view: SeenCorners, number: int) -> RigidTransform:
    pose = global_pose(view.of(view.cross == number))
    if pose is None:
        raise StageFailed("A cross that was measured has no pose; leave out its image.", Status.UNOBSERVABLE)
    return RigidTransform("camera", "room", pose.rotation, pose.translation_mm)
