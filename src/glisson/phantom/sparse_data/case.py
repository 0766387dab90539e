"""One case of the twin: what a technique is given, and the truth that it is scored by."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from glisson.core.arrays import FloatArray
from glisson.core.observations import Observations
from glisson.core.transform import RigidTransform
from glisson.geometry.normals import vertex_normals
from glisson.phantom.sparse_data.bends import draw_bend
from glisson.phantom.sparse_data.closed_form import InTurn
from glisson.phantom.sparse_data.design import CaseDesign
from glisson.phantom.sparse_data.liver import SparseLiver
from glisson.phantom.sparse_data.observing import FRONT, draw_room_from_patient, observe
from glisson.phantom.sparse_data.swabbing import Swab, swab

Carry = Callable[[FloatArray], FloatArray]
"""Where the truth takes material points (n, 3) of A, LPS mm."""


@dataclass(frozen=True, eq=False)
class SparseCase:
    """A case; `observations` are in the frame "room", and so are the `true_targets_mm` (159, 3).

    `deformed_targets_mm` are the same before the organ was moved as a whole, in the patient's frame: what
    `room_from_patient`, which no technique is told, takes to the truth. `swab` has the touched points in A, without
    noise.
    """

    design: CaseDesign
    observations: Observations
    targets_mm: FloatArray
    deformed_targets_mm: FloatArray
    true_targets_mm: FloatArray
    room_from_patient: RigidTransform
    swab: Swab


def make_case(design: CaseDesign, liver: SparseLiver, carry: Carry) -> SparseCase:
    """The case of a liver that the truth has deformed; the same design gives the same case."""
    random = np.random.default_rng([design.seed, design.member, design.number, 2])
    deformed = carry(liver.surface.vertices)
    seen = swab(liver, deformed, design.coverage, random)
    vertex = cKDTree(liver.surface.vertices)
    outward = vertex_normals(deformed, liver.surface.triangles)
    touched = {FRONT: seen.front, **seen.features}
    normals = {name: outward[vertex.query(points)[1]] for name, points in touched.items()}
    moved = {name: carry(points) for name, points in touched.items()}
    room = draw_room_from_patient(random)
    observations = observe(moved, normals, room, design.noise_mm, design.outlier_share, random)
    targets = carry(liver.targets_mm)
    return SparseCase(design, observations, liver.targets_mm, targets, room.apply(targets), room, seen)


def bend_of(design: CaseDesign, liver: SparseLiver) -> InTurn:
    """The truth in closed form of a case that has one."""
    random = np.random.default_rng([design.seed, design.member, design.deformation, 3])
    return draw_bend(liver.targets_mm.mean(axis=0), random)
