"""What is seen of a lifted liver: its front through a laparoscope, the wire, and where the lever touches."""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Deformation
from glisson.core.mesh import TriangleSurface
from glisson.core.observations import Observation, ObservationKind, Observations
from glisson.core.structures import Curve, Structures
from glisson.core.units import radians
from glisson.geometry.mapping import PointMap
from glisson.geometry.quadratic import boundary_surface
from glisson.navigation.wire import carried_wire
from glisson.phantom.liver_view import TriangleScene
from glisson.phantom.sparse_data.swabbing import evenly_along, thinned
from glisson.phantom.truth_checks import gap_to_lever
from glisson.studies.lever_lift.cases import LeverCase, lever_of, true_scenario

NOISE_MM = 1.0

_CAMERA_MM = np.array([15.0, -150.0, -90.0])
"""Before the organ and below it; the board is at y = 0, the hilum near x = z = 0."""

_LOOKS_AT_MM = np.array([10.0, -35.0, 5.0])
_HALF_ANGLE_DEG = 35.0
_RAYS = 120
_FACING = 0.25
"""Seen is what faces the laparoscope by a cosine of so much."""

_APART_MM = 7.0
_WIRE_STEP_MM = 3.0
_TOUCHING_MM, _TOUCHES_APART_MM = 0.4, 8.0


def observe(case: LeverCase, truth: Deformation, structures: Structures) -> Observations:
    """Points of the lifted liver in the patient's frame, each coordinate with noise; no tumour is among them."""
    random = np.random.default_rng([case.member, 7])
    surface = boundary_surface(truth.mesh, truth.mesh.moved(truth.displacement))
    lever = lever_of(true_scenario(case))
    near = surface.vertices[gap_to_lever(surface.vertices, lever, radians(case.angle_deg)) < _TOUCHING_MM]
    found: list[tuple[ObservationKind, str, FloatArray]] = [
        ("surface", "front", front(surface)),
        ("curve", "wire", _along_wire(truth, structures)),
        ("contact", lever.name, near[thinned(near, _TOUCHES_APART_MM)]),
    ]
    items = [
        Observation(kind, name, points + random.normal(scale=NOISE_MM, size=points.shape), NOISE_MM)
        for kind, name, points in found
    ]
    return Observations(tuple(items))


def front(surface: TriangleSurface) -> FloatArray:
    """Points (n, 3) of a surface that the laparoscope sees, in mm."""
    axis = (_LOOKS_AT_MM - _CAMERA_MM) / np.linalg.norm(_LOOKS_AT_MM - _CAMERA_MM)
    right, down = np.linalg.svd(axis[None])[2][1:]
    line = np.tan(radians(_HALF_ANGLE_DEG)) * np.linspace(-1.0, 1.0, _RAYS)
    u, v = (grid.ravel() for grid in np.meshgrid(line, line))
    inside = np.hypot(u, v) <= line[-1]
    rays = axis + u[inside, None] * right + v[inside, None] * down
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    far, normals = TriangleScene(surface).hits(_CAMERA_MM, rays)
    seen = np.isfinite(far) & ((rays * normals).sum(axis=1) < -_FACING)
    points = _CAMERA_MM + far[seen, None] * rays[seen]
    kept: FloatArray = points[thinned(points, _APART_MM)]
    return kept


def _along_wire(truth: Deformation, structures: Structures) -> FloatArray:
    duct, length = structures.duct, structures.wire_length_mm
    assert duct is not None  # every member has a wire
    assert length is not None
    wire, _ = carried_wire(duct, length, PointMap(truth.mesh, truth.displacement))
    return evenly_along(Curve(wire.points_mm), _WIRE_STEP_MM)
