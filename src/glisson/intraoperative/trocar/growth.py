"""How far ink or paper seems to have grown, estimated together with the pose.

Cameras show dark levels brighter than they are (gamma), inks spread, and bright paper blooms. All this moves all edges
of one colour to the same side, by some tenths of a pixel, whereas a pose that is a little wrong moves opposite edges to
opposite sides.
"""

from dataclasses import replace

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.transform import RigidTransform
from glisson.intraoperative.trocar.corners import SeenCorners
from glisson.intraoperative.trocar.refinement import RefinedPose
from glisson.intraoperative.trocar.uncertainty import slopes_by_pose

LIKELY_GROWTH_PX = 0.5
"""Its standard deviation before anything is seen."""

_REWEIGHTED = 5
_SOFT = 9.0


def without_growth(seen: SeenCorners, camera_from_room: RigidTransform) -> SeenCorners:
    """Corners with the growth of each colour taken away, and its covariance given.

    Args:
        seen: corners with their derivative by the growth.
        camera_from_room: nearly the pose; its error is estimated along, linearly.
    """
    if seen.growth is None or len(seen) < 8:
        return seen
    pose = RefinedPose(camera_from_room.rotation, camera_from_room.translation_mm, np.zeros(0), np.zeros((6, 6)))
    in_camera = camera_from_room.apply(seen.points_mm)
    off = seen.slopes - in_camera[:, :2] / in_camera[:, 2:]
    design = np.concatenate([slopes_by_pose(seen, pose), seen.growth], axis=2)
    prior = np.diag([0.0] * 6 + [1.0 / LIKELY_GROWTH_PX**2] * seen.growth.shape[2])
    weights = np.ones(len(seen))
    for _ in range(_REWEIGHTED):
        weighted = design.transpose(0, 2, 1) @ (seen.information * weights[:, None, None])
        normal: FloatArray = (weighted @ design).sum(axis=0) + prior
        found = np.linalg.solve(normal, (weighted @ off[:, :, None]).sum(axis=0)[:, 0])
        rest = off - design @ found
        squares = np.einsum("ni,nij,nj->n", rest, seen.information, rest)
        # Geman and McClure's weights, about the typical error: the noise may be more than is stated.
        weights = 1.0 / (1.0 + squares / (_SOFT * max(1.0, float(np.median(squares))))) ** 2
    covariance = np.asarray(np.linalg.inv(normal)[6:, 6:], dtype=np.float64)
    return replace(seen, slopes=seen.slopes - seen.growth @ found[6:], growth_covariance=covariance)
