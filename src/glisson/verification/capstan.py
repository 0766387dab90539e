"""Belt friction: an elastic strip over a rigid cylinder, against the capstan equation T2 = T1 exp(µ θ) of Euler.

The strip hangs over the cylinder with a straight piece on either side; one end carries a dead load, the other is
held, and then drawn down. While it is held the load pulls the strip towards itself, so the held end feels less; when
it is drawn the strip slides the other way everywhere, and the drawn end must overcome load and friction.
"""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.mesh import TetMesh
from glisson.core.model import Material
from glisson.core.scenario import ContactLaw
from glisson.core.tools import Cylinder
from glisson.geometry.boxes import box_mesh
from glisson.mechanics.contact_law import Cushion
from glisson.mechanics.cylinder import CylinderTool
from glisson.mechanics.elements import surface_quadrature
from glisson.verification.bodies import body_of, equilibrium, mapped, reactions
from glisson.verification.check import Case, Check, relative

_NAME = "capstan/strip"
_RADIUS, _TAIL = 20.0, 4.0
_THICKNESS, _WIDTH = 0.3, 2.0
_FRICTION = 0.3
_LOAD = 6.0  # mN, a strain of 1 %
_CUSHION = Cushion(range_mm=0.02, stiffness_kpa_mm=200.0)
_COUNTS = (72, 1, 1)
_DRAWN = 2.0  # mm
_LOAD_STEPS, _DRAW_STEPS = 4, 10


def _strip() -> TetMesh:
    """A strip whose rest shape follows the cylinder, with straight pieces downwards at both ends."""
    half = 0.5 * np.pi * _RADIUS

    def wound(places: FloatArray) -> FloatArray:
        along = places[:, 0] - half - _TAIL
        angle = np.clip(along, -half, half) / _RADIUS
        radius = _RADIUS + _CUSHION.range_mm + places[:, 2]
        below = np.maximum(np.abs(along) - half, 0.0)
        return np.stack([radius * np.sin(angle), places[:, 1], radius * np.cos(angle) - below], axis=1)

    return mapped(box_mesh((2.0 * (half + _TAIL), _WIDTH, _THICKNESS), _COUNTS, quadratic=True), wound)


def _drawn() -> list[Check]:
    # Without Poisson's ratio the strip does not narrow, and all friction acts along it.
    mesh = _strip()
    low = mesh.nodes[:, 2] < mesh.nodes[:, 2].min() + 1e-9
    held = low & (mesh.nodes[:, 0] > 0.0)
    cylinder = CylinderTool(Cylinder("cylinder", np.array([0.0, -50.0, 0.0]), np.array([0.0, 50.0, 0.0]), _RADIUS))
    fixed = np.repeat(held[:, None], 3, axis=1)
    material = Material("neo-hookean-log", 1000.0, 0.0)
    body = body_of(mesh, material, fixed, cushion=_CUSHION, stick_mm=0.005, tools=[cylinder])
    body.law = ContactLaw(_FRICTION)
    surface = surface_quadrature(mesh.nodes, mesh)
    end = (surface.normals[:, 2] < -0.9) & (surface.positions(mesh.nodes)[:, 0] < 0.0)
    end &= surface.positions(mesh.nodes)[:, 2] < mesh.nodes[:, 2].min() + 1e-9
    areas = np.where(end, surface.areas, 0.0)
    loads = surface.scatter(areas[:, None] * [0.0, 0.0, -_LOAD / areas.sum()])
    positions = np.array(mesh.nodes)

    def slide() -> float:
        """Equilibrium, after which anchors follow; the tension at the held end in mN."""
        nonlocal positions
        positions = equilibrium(body, positions, 1e-7, limit=200)
        body.accept(positions)
        return float(-reactions(body, positions)[:, 2].sum())

    for share in np.linspace(0.0, 1.0, _LOAD_STEPS + 1)[1:]:
        body.external = share * loads
        holding = slide()
    for _ in range(_DRAW_STEPS):
        positions[held, 2] -= _DRAWN / _DRAW_STEPS
        drawing = slide()
    factor = np.exp(_FRICTION * np.pi)
    return [
        relative(f"{_NAME}/holding", holding, _LOAD / factor, 0.03, "mN", "capstan equation"),
        relative(f"{_NAME}/drawing", drawing, _LOAD * factor, 0.03, "mN", "capstan equation"),
    ]


CASES = (Case(_NAME, f"elastic strip over half a rigid cylinder, µ = {_FRICTION}, T10", _drawn, slow=True),)
