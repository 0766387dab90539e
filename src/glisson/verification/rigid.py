"""A rotation is no strain: no stress, and no forces of a whole body."""

from functools import partial

import numpy as np
from scipy.spatial.transform import Rotation

from glisson.geometry.boxes import box_mesh
from glisson.mechanics.elasticity import Elasticity
from glisson.mechanics.materials.law import find_law
from glisson.verification.bodies import FRAME_INDIFFERENT, distorted, material_of
from glisson.verification.check import Case, Check, vanishing

_TURNS = Rotation.from_rotvec(
    np.array([[0.4, -1.1, 0.7], [0.0, 0.0, 1.5], [2.9, 0.3, 0.2], [-1.0, 2.0, 1.0]])
).as_matrix()


def _rigid(name: str, law_name: str) -> list[Check]:
    material = material_of(law_name)
    stress = np.abs(find_law(law_name).stress(_TURNS, material)).max()
    mesh = distorted(box_mesh((30.0, 20.0, 10.0), (3, 2, 2)), 0.5).as_quadratic()
    body = Elasticity(mesh, {0: material}, mesh.nodes)
    forces = max(np.abs(body.forces(mesh.nodes @ turn.T + [5.0, -3.0, 2.0])).max() for turn in _TURNS)
    return [
        vanishing(f"{name}/stress", stress, 1e-9, "kPa", "frame-indifference"),
        vanishing(f"{name}/forces", forces, 1e-9, "mN", "frame-indifference"),
    ]


CASES = tuple(
    Case(name, f"rotations up to 170°, {law}", partial(_rigid, name, law))
    for law in FRAME_INDIFFERENT
    for name in [f"rigid/{law}"]
)
