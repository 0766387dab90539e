"""The technique that needs no guess."""

from typing import ClassVar

from glisson.core.camera import Camera
from glisson.core.crosses import CrossLayout
from glisson.core.transform import RigidTransform
from glisson.intraoperative.trocar.corners import SeenCorners
from glisson.intraoperative.trocar.localiser import CrossLocaliser, LocaliserParameters
from glisson.intraoperative.trocar.pose import FoundPose, pose_from_corners


class GlobalLocaliser(CrossLocaliser):
    """SQPnP over all crosses that agree, refined; a second pose and wide bounds are flagged."""

    name: ClassVar[str] = "global"
    summary: ClassVar[str] = "Pose by SQPnP without a guess, refined by reprojection, with all doubts told."
    Parameters: ClassVar[type[LocaliserParameters]] = LocaliserParameters

    def __init__(self, parameters: LocaliserParameters) -> None:
        self._parameters = parameters

    def _first_pose(self, seen: SeenCorners, camera: Camera, layout: CrossLayout) -> FoundPose | None:
        return pose_from_corners(seen, camera, layout)

    def _pose(self, seen: SeenCorners, camera: Camera, layout: CrossLayout, before: RigidTransform) -> FoundPose | None:
        return pose_from_corners(seen, camera, layout)
