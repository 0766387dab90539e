"""Taylor tests: every gradient and Hessian is the derivative of what it claims to be the derivative of."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.mesh import TetMesh, TriangleSurface
from glisson.core.model import Capsule, Material, Rod
from glisson.core.scenario import ContactLaw
from glisson.core.structures import Curve
from glisson.core.tools import Board, Cylinder, Lever, MeshTool, Slot
from glisson.geometry.boxes import box_mesh
from glisson.mechanics.body import Body
from glisson.mechanics.contact import Touch
from glisson.mechanics.contact_law import Cushion, shear_share, shear_slope, slip_energy
from glisson.mechanics.cylinder import CylinderTool
from glisson.mechanics.elasticity import Elasticity
from glisson.mechanics.gas_pressure import GasPressure
from glisson.mechanics.lever_tool import LeverTool
from glisson.mechanics.materials.law import find_law
from glisson.mechanics.membrane import Membrane
from glisson.mechanics.parts import Part
from glisson.mechanics.pattern import block_pattern
from glisson.mechanics.sliding_rod import SlidingRod
from glisson.mechanics.tools import RigidTool, make_tool
from glisson.verification.bodies import FRAME_INDIFFERENT, LAWS, body_of, distorted, floor, mapped, material_of
from glisson.verification.check import Case, Check, NoSolution, taylor_check, vanishing


def _law(name: str, law_name: str) -> list[Check]:
    """Stress and tangent at twenty random deformation gradients."""
    law, material = find_law(law_name), material_of(law_name)
    gradients = np.eye(3) + np.random.default_rng(3).uniform(-0.2, 0.2, (20, 3, 3))
    direction = np.random.default_rng(4).uniform(-1, 1, (20, 3, 3))
    energy, stress = law.energy(gradients, material), law.stress(gradients, material)
    slope = np.einsum("nij,nij->n", stress, direction)
    change = (law.tangent(gradients, material) @ direction.reshape(20, 9, 1)).reshape(20, 3, 3)

    def energy_rest(h: float) -> Any:
        return law.energy(gradients + h * direction, material) - energy - h * slope

    def stress_rest(h: float) -> Any:
        return law.stress(gradients + h * direction, material) - stress - h * change

    stress_name = f"{name}/tangent"
    if law_name == "linear-elastic":
        rest = float(np.abs(stress_rest(1e-2)).max())
        second = vanishing(stress_name, rest, 1e-12, "kPa", "a linear law has no remainder")
    else:
        second = taylor_check(stress_name, stress_rest, (1e-2, 1e-3))
    return [taylor_check(f"{name}/stress", energy_rest, (1e-2, 1e-3)), second]


def _bent() -> tuple[TetMesh, FloatArray, FloatArray]:
    """A distorted T10 mesh, deformed positions and a direction."""
    mesh = distorted(box_mesh((30.0, 20.0, 10.0), (3, 2, 2)), 0.5).as_quadratic()
    rng = np.random.default_rng(1)
    positions = mesh.nodes + rng.uniform(-0.3, 0.3, mesh.nodes.shape)
    return mesh, positions, rng.uniform(-1, 1, mesh.nodes.shape)


def _body(name: str, law_name: str) -> list[Check]:
    """Forces and stiffness of a whole body, by its deformed and by its unloaded positions."""
    mesh, positions, direction = _bent()
    materials = {0: material_of(law_name)}
    body = body_of(mesh, materials[0])
    elasticity = body.elasticity
    energy, forces = elasticity.energy(positions), elasticity.forces(positions)
    change = _times(body, body.stiffness(positions, body.touches(positions), project=False), direction)
    pattern = block_pattern(mesh.tetrahedra, len(mesh.nodes))
    blocks = np.zeros((pattern.block_count, 3, 3))
    elasticity.add_rest_derivative(positions, pattern, blocks)
    rest_change = (pattern.matrix(blocks) @ direction.ravel()).reshape(direction.shape)

    def energy_rest(h: float) -> float:
        return elasticity.energy(positions + h * direction) - energy - h * float(np.vdot(forces, direction))

    def force_rest(h: float) -> Any:
        return elasticity.forces(positions + h * direction) - forces - h * change

    def shape_rest(h: float) -> Any:
        moved = Elasticity(mesh, materials, mesh.nodes + h * direction)
        return moved.forces(positions) - forces - h * rest_change

    return [
        taylor_check(f"{name}/forces", energy_rest, (1e-2, 1e-3)),
        taylor_check(f"{name}/stiffness", force_rest, (1e-3, 1e-4)),
        taylor_check(f"{name}/unloaded-shape", shape_rest, (1e-2, 1e-3)),
    ]


def _part(name: str, make: Callable[[TetMesh], Part]) -> list[Check]:
    """Forces and stiffness of a part of the body."""
    mesh, positions, direction = _bent()
    part = make(mesh)
    energy, forces = part.energy(positions), part.forces(positions)
    groups, local = part.stiffness(positions, project=False)
    change = np.zeros_like(positions)
    np.add.at(change, groups, np.einsum("kabij,kbj->kai", local, direction[groups]))

    def energy_rest(h: float) -> float:
        return part.energy(positions + h * direction) - energy + h * float(np.vdot(forces, direction))

    def force_rest(h: float) -> Any:
        return part.forces(positions + h * direction) - forces + h * change

    return [
        taylor_check(f"{name}/forces", energy_rest, (1e-1, 1e-2)),
        taylor_check(f"{name}/stiffness", force_rest, (1e-2, 1e-3)),
    ]


def _gas(mesh: TetMesh) -> GasPressure:
    gas = GasPressure(mesh)
    gas.pressure_kpa = 2.0
    return gas


def _rod(mesh: TetMesh) -> SlidingRod:
    """A rod that has slid, at limits of friction as they were before."""
    duct = Curve(np.array([[2.0, 9.0, 5.0], [10.0, 11.0, 4.0], [18.0, 9.0, 6.0], [28.0, 10.0, 5.0]]))
    rod = SlidingRod(mesh, duct, 24.0, Rod(0.05, axial_stiffness_n=2.0, friction=0.3, grip_n_mm=1e-3))
    rod.drawn_mm = 1.0
    rod.renew(mesh.nodes)
    return rod


def _times(body: Body, blocks: FloatArray, direction: FloatArray) -> FloatArray:
    result: FloatArray = (body.matrix(blocks) @ direction.ravel()).reshape(direction.shape)
    return result


def _pressed(law: ContactLaw, tool: RigidTool) -> tuple[Body, FloatArray, tuple[Touch, ...], FloatArray]:
    """A block that presses on a tool, with anchors behind it: body, positions, touches and a direction."""
    mesh = box_mesh((40.0, 30.0, 20.0), (3, 3, 2))
    body = body_of(mesh, Material("neo-hookean", 50.0, 0.3), tools=[tool], stick_mm=0.05)
    body.law = law
    rng = np.random.default_rng(2)
    anchored = mesh.nodes + rng.uniform(-0.003, 0.003, mesh.nodes.shape)
    body.renew_cohesion(anchored)
    body.touches(anchored)
    positions = anchored + [0.02, 0.01, 0.0]
    return body, positions, body.touches(positions), rng.uniform(-1, 1, mesh.nodes.shape)


def _contact(name: str, law: ContactLaw, tool: RigidTool) -> list[Check]:
    """Contact forces and stiffness, with friction limits held and with limits that follow the pressure."""
    body, positions, touches, direction = _pressed(law, tool)
    if not any(len(touch.points) for touch in touches):
        raise NoSolution("the block does not touch the tool")
    start, energy = body.balance(positions, touches).unbalanced, body.energy(positions)
    blocks = body.stiffness(positions, touches, project=False)
    change = _times(body, blocks, direction)
    body.add_friction_by_pressure(positions, touches, blocks)
    full_change = _times(body, blocks, direction)

    def energy_rest(h: float) -> float:
        return body.energy(positions + h * direction) - energy + h * float(np.vdot(start, direction))

    def force_rest(h: float, follow: bool, linear: FloatArray) -> Any:
        moved = positions + h * direction
        return body.balance(moved, body.touches(moved, follow)).unbalanced - start + h * linear

    checks = [
        taylor_check(f"{name}/forces", energy_rest, (1e-4, 1e-5)),
        taylor_check(f"{name}/stiffness", lambda h: force_rest(h, False, change), (1e-4, 1e-5)),
    ]
    if law.friction > 0.0:
        checks.append(taylor_check(f"{name}/by-pressure", lambda h: force_rest(h, True, full_change), (1e-4, 1e-5)))
    return checks


def _cushion(name: str) -> list[Check]:
    """Pressure over gap and shear over slip as slopes of their energies."""
    cushion, stick = Cushion(0.1, 2000.0), 0.02
    # Away from the bends in the laws, across which a remainder is of lower order.
    gaps, slips = np.array([-0.03, 0.01, 0.03, 0.07, 0.09]), np.array([0.001, 0.007, 0.015, 0.018])
    lows = {
        "pressure": (cushion.energy, lambda gap: -cushion.pressure(gap), gaps),
        "slope": (cushion.pressure, lambda gap: -cushion.slope(gap), gaps),
        "shear": (lambda slip: slip_energy(slip, stick), lambda slip: shear_share(slip, stick), slips),
        "shear-slope": (lambda slip: shear_share(slip, stick), lambda slip: shear_slope(slip, stick), slips),
    }
    return [_slope_check(f"{name}/{what}", *laws) for what, laws in lows.items()]


def _slope_check(
    name: str,
    value: Callable[[FloatArray], FloatArray],
    slope: Callable[[FloatArray], FloatArray],
    places: FloatArray,
) -> Check:
    return taylor_check(name, lambda h: value(places + h) - value(places) - h * slope(places), (1e-4, 1e-5))


def _tool(name: str, tool: RigidTool) -> list[Check]:
    """Normal and curvature of a tool's distance, at points outside it."""
    rng = np.random.default_rng(0)
    points = rng.uniform([-20, -20, -20], [80, 20, 20], (200, 3))
    gaps = tool.distance(points)
    points = points[(gaps > 1.0) & (gaps < 10.0)]
    direction = rng.uniform(-1, 1, points.shape)
    normals, hessians = tool.derivatives(points)

    def distance_rest(h: float) -> Any:
        change = h * np.einsum("pi,pi->p", normals, direction)
        return tool.distance(points + h * direction) - tool.distance(points) - change

    def normal_rest(h: float) -> Any:
        change = h * np.einsum("pij,pj->pi", hessians, direction)
        return tool.derivatives(points + h * direction)[0] - normals - change

    return [
        taylor_check(f"{name}/normal", distance_rest, (1e-3, 1e-4)),
        taylor_check(f"{name}/curvature", normal_rest, (1e-3, 1e-4)),
    ]


def _wedge() -> TriangleSurface:
    """A box whose upper side slopes."""
    mesh = mapped(box_mesh((50.0, 20.0, 10.0), (1, 1, 1)), lambda p: p + 0.1 * p[:, :1] * [0, 0, 1])
    return TriangleSurface(mesh.nodes - [0.0, 10.0, 5.0], mesh.boundary()[0])


_LEVER = Lever.lifting("lever", np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, -1.0, 0.0]), length_mm=60.0)
_TOOLS: dict[str, RigidTool] = {
    "lever": LeverTool(_LEVER),
    "cylinder": CylinderTool(Cylinder("cylinder", np.zeros(3), np.array([12.0, 8.0, 36.0]), 5.0)),
    "slotted-board": make_tool(
        Board(
            "board",
            np.array([0.0, 0.0, -5.0]),
            np.array([0.0, 0.0, 1.0]),
            slot=Slot(np.array([20.0, 0.0, -5.0]), np.array([1.0, 0.0, 0.0]), 60.0, 20.0, edge_radius_mm=3.0),
        )
    ),
    "mesh": make_tool(MeshTool("mesh", _wedge(), skin_mm=2.0)),
}
# Below the block, which begins at z = 0: a flat one, a wide one whose face and rounded edge touch, and a round one.
_FLOOR = make_tool(floor(0.05))
_EDGE = LeverTool(
    Lever.lifting("lever", np.array([10.0, 15.0, 0.04]), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
)
_ROUND = CylinderTool(Cylinder("cylinder", np.array([-30.0, 0.0, -4.95]), np.array([70.0, 30.0, -4.95]), 5.0))
_CONTACTS: dict[str, tuple[ContactLaw, RigidTool]] = {
    "floor-frictionless": (ContactLaw(0.0), _FLOOR),
    "floor-friction": (ContactLaw(0.3), _FLOOR),
    "floor-cohesion": (ContactLaw(0.3, 2.0), _FLOOR),
    "lever-cohesion": (ContactLaw(0.3, 2.0), _EDGE),
    "cylinder-friction": (ContactLaw(0.3), _ROUND),
}
_PARTS: dict[str, Callable[[TetMesh], Part]] = {
    "capsule": lambda mesh: Membrane(mesh, Capsule(young_modulus_kpa=300.0, thickness_mm=0.2)),
    "gas": _gas,
    "rod": _rod,
}

CASES = (
    *(Case(f"taylor/law/{law}", f"stress and tangent, {law}", partial(_law, f"taylor/law/{law}", law)) for law in LAWS),
    *(
        Case(
            f"taylor/body/{law}",
            f"forces and stiffness of a T10 body, {law}",
            partial(_body, f"taylor/body/{law}", law),
        )
        for law in FRAME_INDIFFERENT
    ),
    *(
        Case(name, f"a block that presses on a tool, {what}", partial(_contact, name, law, tool))
        for what, (law, tool) in _CONTACTS.items()
        for name in [f"taylor/contact/{what}"]
    ),
    *(
        Case(name, f"forces and stiffness of the {what} of a T10 body", partial(_part, name, make))
        for what, make in _PARTS.items()
        for name in [f"taylor/part/{what}"]
    ),
    Case("taylor/contact-law", "pressure over gap, shear over slip", partial(_cushion, "taylor/contact-law")),
    *(
        Case(f"taylor/tool/{what}", f"distance to the {what}", partial(_tool, f"taylor/tool/{what}", tool))
        for what, tool in _TOOLS.items()
    ),
)
