"""Recognises an instrument by its wheel of coloured sectors and tells where its tip is (dissertation, section 5.2)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput, StageFailed
from glisson.core.instruments import RINGS, SECTORS, Instrument, InstrumentLibrary, SeenInstrument
from glisson.core.status import Status
from glisson.core.transform import RigidTransform
from glisson.core.trocar import Trocar
from glisson.intraoperative.cameras.projection import undistorted
from glisson.intraoperative.instruments.circle_pose import circle_poses, conic_through
from glisson.intraoperative.instruments.codes import instrument_of
from glisson.intraoperative.instruments.rim_edges import rim_edges, white_paper
from glisson.intraoperative.instruments.wheel_colours import paper_colour, read_sectors
from glisson.intraoperative.instruments.wheel_finding import find_wheel
from glisson.intraoperative.instruments.wheel_pose import WheelPose, disagreement, fitted_pose, past_pivot

_CONTRADICTED = 23.0
"""Squared Mahalanobis distance from the pivot that one right wheel in 100,000 exceeds (2 degrees of freedom)."""
_AS_GOOD = 9.0
"""A second pose whose squared residuals are larger by less than this explains the image as well."""
_APART = 3.0
"""Tips so many standard deviations apart are different ones."""


@dataclass(frozen=True)
class ColourWheelParameters:
    """None: all that varies is the trocar's and the library's."""


class ColourWheel:
    """The wheel's ellipse gives the pose, its sectors the name; the pivot decides between the ellipse's two poses."""

    name: ClassVar[str] = "colour-wheel"
    summary: ClassVar[str] = "A wheel of coloured sectors: the name by its code, the pose by its rims and the pivot."
    Parameters: ClassVar[type[ColourWheelParameters]] = ColourWheelParameters

    def __init__(self, parameters: ColourWheelParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """None."""
        return ()

    def recognise(self, image: NDArray[np.uint8], trocar: Trocar, library: InstrumentLibrary) -> SeenInstrument:
        """See `glisson.core.protocols.InstrumentRecogniser`."""
        camera = trocar.camera
        if image.shape != (camera.height, camera.width, 3):
            raise BadInput(
                f"The image is {image.shape[1]} × {image.shape[0]} px, the trocar's camera {camera.width} × "
                f"{camera.height} px; give the camera that took it."
            )
        paper = white_paper(image)
        # Before the name is known, neither is the wheel's size: until then all is in wheel radii.
        either = [_fit(paper, trocar, start, 1.0) for start in _starts(paper, trocar)]
        clearest = max(either, key=lambda fit: fit.edges.share).pose
        reading, angle = read_sectors(image, camera, clearest, 1.0)
        instrument, begin = instrument_of(reading, library)
        turn = angle - begin * 2.0 * np.pi / SECTORS
        x = clearest.rotation @ [np.cos(turn), np.sin(turn), 0.0]
        balanced = white_paper(image, paper_colour(image, camera, clearest, 1.0))
        return _placed(balanced, trocar, instrument, [_sized(fit.pose, instrument) for fit in either], x)


def _placed(
    paper: NDArray[np.float32], trocar: Trocar, instrument: Instrument, starts: list[RigidTransform], x: FloatArray
) -> SeenInstrument:
    """The instrument at the better of both poses, if the pivot has no objection; x (3,) is where its sectors begin."""
    radius = 0.5 * instrument.wheel_mm
    free = [_fit(paper, trocar, start, radius) for start in starts]
    apart = [disagreement(fit, trocar) for fit in free]
    likelier = free[int(np.argmin(apart))].pose
    off, _ = past_pivot(likelier, trocar)
    along = float((trocar.pivot_mm - likelier.translation_mm) @ likelier.rotation[:, 2])
    if min(apart) > _CONTRADICTED or not 0.0 < along < instrument.length_mm:
        raise StageFailed(_other_size(instrument, likelier, trocar, along), Status.BAD_INPUT)
    held = [_fit(paper, trocar, fit.pose, radius, held=True) for fit in free]
    noise = min(fit.noise_px for fit in held)
    best, other = sorted(held, key=lambda fit: fit.misfit(noise, trocar))
    (tip, covariance), (second, _) = best.point(instrument.tip_mm), other.point(instrument.tip_mm)
    far = float((second - tip) @ np.linalg.solve(covariance, second - tip)) > _APART**2
    if far and other.misfit(noise, trocar) - best.misfit(noise, trocar) < _AS_GOOD:
        raise StageFailed(
            f"Two poses of {instrument.name!r} explain the image equally well, with tips "
            f"{np.linalg.norm(second - tip):.1f} mm apart.",
            Status.AMBIGUOUS,
        )
    pose = _turned(best.pose, x)
    lean = float(np.arccos(np.clip(-pose.rotation[:, 2] @ trocar.axis, -1.0, 1.0)))
    return SeenInstrument(instrument, pose, lean, float(np.linalg.norm(off)), best.edges.share)


def _starts(paper: NDArray[np.float32], trocar: Trocar) -> list[RigidTransform]:
    """Both poses, in wheel radii, of the ellipse that the wheel's white ring makes."""
    ellipse = find_wheel(paper)
    poses = []
    if ellipse is not None:
        poses = circle_poses(conic_through(undistorted(trocar.camera, ellipse.points())), RINGS.white)
    if not poses:
        raise StageFailed("No instrument's wheel can be seen in the image.", Status.UNOBSERVABLE)
    return [RigidTransform("trocar", "instrument", _facing(normal), centre) for centre, normal in poses]


def _fit(
    paper: NDArray[np.float32], trocar: Trocar, start: RigidTransform, radius_mm: float, *, held: bool = False
) -> WheelPose:
    """A pose on the wheel's edges; `held` by the pivot, too, or not."""
    camera = trocar.camera
    return fitted_pose(
        camera,
        start,
        radius_mm,
        lambda pose, window: rim_edges(paper, camera, pose, radius_mm, window),
        trocar if held else None,
    )


def _sized(pose: RigidTransform, instrument: Instrument) -> RigidTransform:
    """A pose in wheel radii, in mm."""
    return RigidTransform(pose.target, pose.source, pose.rotation, 0.5 * instrument.wheel_mm * pose.translation_mm)


def _facing(normal: FloatArray) -> FloatArray:
    """A rotation (3, 3) with z along a normal."""
    x = np.cross([0.0, 1.0, 0.0], normal)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(normal, x), normal])


def _other_size(instrument: Instrument, pose: RigidTransform, trocar: Trocar, along_mm: float) -> str:
    """What is wrong where pivot and wheel contradict each other, with the diameter that would fit."""
    across = pose.rotation[:, :2].T
    seen, wanted = across @ pose.translation_mm, across @ trocar.pivot_mm
    fitting = instrument.wheel_mm * float(seen @ wanted) / float(seen @ seen)
    off = float(np.linalg.norm(wanted - seen))
    return (
        f"The axis of {instrument.name!r} passes the trocar's pivot by {off:.1f} mm, with the pivot {along_mm:.0f} mm "
        f"from the wheel: is its wheel not {instrument.wheel_mm:g} mm wide but {fitting:.0f} mm, or the trocar another?"
    )


def _turned(pose: RigidTransform, x: FloatArray) -> RigidTransform:
    """A pose turned about its z so that its x is as near to a direction (3,) as may be."""
    z = pose.rotation[:, 2]
    flat = x - (x @ z) * z
    flat /= np.linalg.norm(flat)
    rotation = np.column_stack([flat, np.cross(z, flat), z])
    return RigidTransform(pose.target, pose.source, rotation, pose.translation_mm, pose.covariance)
