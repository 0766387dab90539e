"""From an image to the trocar's pose: what both techniques share."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from glisson.core.camera import Camera
from glisson.core.crosses import CrossLayout
from glisson.core.errors import BadInput
from glisson.core.localisation import Localisation
from glisson.core.parameters import parameter
from glisson.core.status import Status
from glisson.core.transform import RigidTransform
from glisson.intraoperative.trocar.corners import SeenCorners, corners_at
from glisson.intraoperative.trocar.growth import without_growth
from glisson.intraoperative.trocar.measurement import measure_corners
from glisson.intraoperative.trocar.outlines import cross_outlines
from glisson.intraoperative.trocar.pose import FoundPose
from glisson.intraoperative.trocar.reading import Reading, read_crosses
from glisson.intraoperative.trocar.sizes import other_size

_OUTLINE_PX = 1.0
"""Standard deviation of an outline's corner."""

_REACHES_PX = (5.0, 3.0, 3.0)
"""Edges are looked for so far from where they are expected: first by the outlines, then by the pose before."""


_MISFIT = 2.0
"""With residuals this many times as large as they should be, another size of the crosses is tried."""

_UNUSUAL = 1.5
"""Residuals this many times as large as they should be are told; those of good cameras and layouts came to 1.4."""


@dataclass(frozen=True)
class LocaliserParameters:
    """How wide the bounds of a pose may be."""

    position_limit_mm: float = parameter(
        5.0, "A position that may err by more in one of 10,000 cases is flagged, mm.", 0.01
    )
    angle_limit_deg: float = parameter(
        1.0, "An orientation that may err by more in one of 10,000 cases is flagged, degrees.", 0.001
    )


class CrossLocaliser(ABC):
    """Outlines, colours, a first pose, edges measured where it has them, the pose, and its doubts."""

    _parameters: LocaliserParameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """None."""
        return ()

    def localise(self, image: NDArray[np.uint8], camera: Camera, layout: CrossLayout) -> Localisation:
        """See `glisson.core.protocols.Localiser`."""
        if image.shape != (camera.height, camera.width, 3) or image.dtype != np.uint8:
            raise BadInput(
                f"The image is {image.shape[1]} × {image.shape[0]} px{'' if image.ndim == 3 else ' and grey'}, but its "
                f"camera takes colour images of {camera.width} × {camera.height} px; give the camera that took it."
            )
        reading = read_crosses(image, cross_outlines(image), layout)
        if (refusal := _refusal(reading, layout, grey=bool((image == image[:, :, :1]).all()))) is not None:
            return refusal
        count = len(reading.crosses)
        numbers = np.repeat([one.number for one in reading.crosses], 12).astype(np.int64)
        outlines = np.concatenate([one.corners_px for one in reading.crosses])
        rough = corners_at(camera, layout, numbers, np.tile(np.arange(12), count), outlines, _OUTLINE_PX)
        measured = seen = rough
        found = self._first_pose(rough, camera, layout)
        for reach_px in _REACHES_PX:
            if found is None:
                break
            measured = measure_corners(image, camera, layout, found.camera_from_room, reach_px)
            seen = without_growth(measured, found.camera_from_room)
            found = self._pose(seen, camera, layout, found.camera_from_room)
        told = _unexplained(seen, layout) if found is None else self.judged(found, seen, camera, layout)
        if found is None or found.scale > _MISFIT:
            # What crosses of another size look like must not be taken for ink that has grown.
            size = other_size(measured) or other_size(rough)
            if size is not None:
                return replace(told, status=Status.BAD_INPUT, message=_size_sentence(size))
        return told

    @abstractmethod
    def _first_pose(self, seen: SeenCorners, camera: Camera, layout: CrossLayout) -> FoundPose | None:
        """A pose without any before."""

    @abstractmethod
    def _pose(self, seen: SeenCorners, camera: Camera, layout: CrossLayout, before: RigidTransform) -> FoundPose | None:
        """The pose where `camera_from_room` is nearly known."""

    def judged(self, found: FoundPose, seen: SeenCorners, camera: Camera, layout: CrossLayout) -> Localisation:
        """The pose with its status."""
        used = seen.of(found.agree)
        names = tuple(layout.crosses[number].name for number in used.crosses)
        status, message = self._status(found)
        variance = np.linalg.inv(used.information).trace(axis1=1, axis2=2) / 2.0
        return Localisation(
            status,
            message,
            _of_trocar(found.camera_from_room),
            None if found.second is None else _of_trocar(found.second),
            names,
            used.pixels,
            found.bound_mm,
            found.bound_rad,
            float(np.sqrt(np.median(variance)) * camera.focal_px.mean() * found.scale),
            _notes(found, camera, layout),
        )

    def _status(self, found: FoundPose) -> tuple[Status, str]:
        if found.second is not None:
            apart = np.linalg.norm(
                found.second.inverse().translation_mm - found.camera_from_room.inverse().translation_mm
            )
            return Status.AMBIGUOUS, (
                f"A second pose, {apart:.0f} mm away, explains the crosses as well; show the camera more of them."
            )
        limit_mm, limit_deg = self._parameters.position_limit_mm, self._parameters.angle_limit_deg
        bound_deg = float(np.rad2deg(found.bound_rad))
        if found.bound_mm > limit_mm or bound_deg > limit_deg:
            return Status.UNOBSERVABLE, (
                f"In one of 10,000 cases the position may err by {found.bound_mm:.2f} mm and the orientation by "
                f"{bound_deg:.3f}°; the limits are {limit_mm:g} mm and {limit_deg:g}°. Show the camera "
                "crosses that are farther apart."
            )
        return Status.CONVERGED, Status.CONVERGED.sentence


def _of_trocar(camera_from_room: RigidTransform) -> RigidTransform:
    pose = camera_from_room.inverse()
    return RigidTransform("room", "trocar", pose.rotation, pose.translation_mm, pose.covariance)


def _notes(found: FoundPose, camera: Camera, layout: CrossLayout) -> tuple[str, ...]:
    notes = []
    if camera.covariance is None:
        notes.append(
            "The camera has no covariance and is taken as exact: the bounds do not count how well it is known."
        )
    if any(cross.room_from_cross.covariance is None for cross in layout.crosses):
        notes.append(
            "The crosses' places have no covariance and are taken as exact: the bounds do not count how they were hung."
        )
    if found.scale > _UNUSUAL:
        notes.append(
            f"The corners are {found.scale:.1f} times as far off as they should be, so the pose may err by more than "
            "the bounds: is it this camera, with this lens and focus, and do the crosses hang where the layout says?"
        )
    return tuple(notes)


def _refusal(reading: Reading, layout: CrossLayout, *, grey: bool) -> Localisation | None:
    """What is told where too little can be read for a pose."""
    if reading.mirrored > len(reading.crosses):
        return Localisation(
            Status.BAD_INPUT, f"{reading.mirrored} crosses are seen as in a mirror; give the image as it was taken."
        )
    names = tuple(layout.crosses[one.number].name for one in reading.crosses)
    if len(names) >= 2:
        return None
    others = f" {_count(reading.foreign)} not in the layout." if reading.foreign else ""
    if names:
        return Localisation(
            Status.UNOBSERVABLE,
            f"Only one cross can be read, {names[0]}: it takes two at least for a pose.{others}",
            crosses=names,
            corners_px=reading.crosses[0].corners_px,
        )
    why = ", which is grey: crosses are told by their colours" if grey else ""
    return Localisation(Status.UNOBSERVABLE, f"No cross of the layout can be read in the image{why}.{others}")


def _count(foreign: int) -> str:
    return "One outline of a cross is" if foreign == 1 else f"{foreign} outlines of crosses are"


def _unexplained(seen: SeenCorners, layout: CrossLayout) -> Localisation:
    names = tuple(layout.crosses[number].name for number in seen.crosses)
    return Localisation(
        Status.UNOBSERVABLE,
        f"No pose explains the crosses that are seen, {_listed(names)}; check the layout, and whether one was moved.",
        crosses=names,
        corners_px=seen.pixels,
    )


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names) if names else "none of which could be measured"


def _size_sentence(size: float) -> str:
    return f"The crosses seem {size:.3f} times as large as the layout says; measure one and correct its size_mm."
