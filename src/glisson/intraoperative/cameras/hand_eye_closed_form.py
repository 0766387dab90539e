"""Hand–eye and robot–world calibration in closed form."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from glisson.core.transform import RigidTransform
from glisson.geometry.rotations import nearest_rotation


def hand_eye_closed_form(
    camera_from_board: Sequence[RigidTransform], marker_from_base: Sequence[RigidTransform]
) -> tuple[RigidTransform, RigidTransform]:
    """`camera_from_marker` X and `base_from_board` Z of A = X B Z, for A and B of three or more views.

    The rotation of X turns the axes of the marker's relative motions into those of the camera's (Park and Martin 1994,
    their least squares solved by the singular value decomposition); Z's is the mean of what it leaves; the two
    translations together solve a linear system.
    """
    first, second = np.triu_indices(len(camera_from_board), 1)
    seen = np.stack([pose.rotation for pose in camera_from_board])
    tracked = np.stack([pose.rotation for pose in marker_from_base])
    of_camera = Rotation.from_matrix(seen[first] @ seen[second].transpose(0, 2, 1)).as_rotvec()
    of_marker = Rotation.from_matrix(tracked[first] @ tracked[second].transpose(0, 2, 1)).as_rotvec()
    turn_x = nearest_rotation(of_camera.T @ of_marker)
    turn_z = nearest_rotation(((turn_x @ tracked).transpose(0, 2, 1) @ seen).sum(axis=0))
    rows, right = [], []
    for a, b in zip(camera_from_board, marker_from_base, strict=True):
        rows.append(np.hstack([np.eye(3), turn_x @ b.rotation]))
        right.append(a.translation_mm - turn_x @ b.translation_mm)
    shifts = np.linalg.lstsq(np.concatenate(rows), np.concatenate(right), rcond=None)[0]
    return RigidTransform("camera", "marker", turn_x, shifts[:3]), RigidTransform("base", "board", turn_z, shifts[3:])
