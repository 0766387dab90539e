"""What acts on an organ beside its tissue and tools: capsule, gas, and ligaments that give way."""

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from glisson.core.mesh import TetMesh
from glisson.core.model import Capsule, Material
from glisson.geometry.boxes import box_mesh
from glisson.mechanics.elastic_attachments import ElasticAttachments
from glisson.mechanics.gas_pressure import GasPressure
from glisson.mechanics.membrane import Membrane
from glisson.verification.bodies import body_of, box_model, distorted, equilibrium
from glisson.verification.check import Case, Check, relative, vanishing
from glisson.verification.meshes import ball

_RADIUS = 20.0
_CAPSULE = Capsule(young_modulus_kpa=300.0, thickness_mm=0.5)
_FAINT = Material("neo-hookean-log", 1e-3, 0.0)  # fills the balloon, and weighs nothing against its skin
_STRETCH = 1.25
_GAS_KPA = 3.0
_SIZES = (40.0, 30.0, 10.0)
_LIGAMENT_KPA_MM = 2.0


def _held(mesh: TetMesh, *nodes: int) -> NDArray[np.bool_]:
    """Six unknowns that take the rigid motion and no force: a node, one along x of it, one along y of it."""
    fixed = np.zeros(mesh.nodes.shape, dtype=bool)
    origin, along_x, along_y = nodes
    fixed[origin] = True
    fixed[along_x, 1:] = True
    fixed[along_y, 2] = True
    return fixed


def _balloon(name: str) -> list[Check]:
    """A ball of next to nothing in a capsule, blown up to p = 2 (t / r0) µ (1/λ − 1/λ⁷)."""
    mesh = ball(_RADIUS, 2)
    skin_kpa = _CAPSULE.young_modulus_kpa / 3.0
    pressure = 2.0 * _CAPSULE.thickness_mm / _RADIUS * skin_kpa * (_STRETCH**-1 - _STRETCH**-7)
    centre = np.linalg.norm(mesh.nodes, axis=1).argmin()
    fixed = _held(mesh, int(centre), int(mesh.nodes[:, 0].argmax()), int(mesh.nodes[:, 1].argmax()))
    gas = GasPressure(mesh)
    body = body_of(mesh, _FAINT, fixed, parts=[Membrane(mesh, _CAPSULE)], gas=gas)
    positions = np.array(mesh.nodes)
    for share in (0.25, 0.5, 0.75, 1.0):
        gas.pressure_kpa = -share * pressure
        positions = equilibrium(body, positions, 1e-8)
    outside = np.linalg.norm(mesh.nodes, axis=1) > _RADIUS - 1e-6
    reached = np.linalg.norm(positions[outside], axis=1).mean()
    return [relative(f"{name}/radius", reached, _STRETCH * _RADIUS, 0.005, "mm", "closed form of the thin balloon")]


def _squeezed(name: str, quadratic: bool) -> list[Check]:
    """Under gas alone every body shrinks evenly, until its Cauchy stress is −p everywhere."""
    material = Material("neo-hookean-log", 7.0, 0.3)
    mesh = distorted(box_mesh((30.0, 20.0, 10.0), (3, 3, 3)), 1.0)
    mesh = mesh.as_quadratic() if quadratic else mesh
    corner = np.linalg.norm(mesh.nodes, axis=1).argmin()
    ends = (np.linalg.norm(mesh.nodes - end, axis=1).argmin() for end in ([30.0, 0.0, 0.0], [0.0, 20.0, 0.0]))
    gas = GasPressure(mesh)
    body = body_of(mesh, material, _held(mesh, int(corner), *map(int, ends)), gas=gas)
    gas.pressure_kpa = _GAS_KPA

    def excess(stretch: float) -> float:
        volume = stretch**3
        shear, lame = material.shear_modulus_kpa, material.lame_lambda_kpa
        return float((shear * (stretch**2 - 1.0) + lame * np.log(volume)) / volume + _GAS_KPA)

    expected = brentq(excess, 0.5, 1.0, xtol=1e-14)
    end = equilibrium(body, np.array(mesh.nodes), 1e-12)
    error = np.abs(end - expected * mesh.nodes).max() / np.abs((1.0 - expected) * mesh.nodes).max()
    return [vanishing(f"{name}/displacement", error, 1e-9, "", "closed form of even compression")]


def _closed(name: str) -> list[Check]:
    """The gas neither pushes nor turns a body as a whole, whatever its shape."""
    mesh = distorted(box_mesh((30.0, 20.0, 10.0), (3, 3, 3)), 1.0).as_quadratic()
    positions = mesh.nodes + np.random.default_rng(5).uniform(-0.5, 0.5, mesh.nodes.shape)
    gas = GasPressure(mesh)
    gas.pressure_kpa = _GAS_KPA
    forces = gas.forces(positions)
    source = "divergence theorem"
    return [
        vanishing(f"{name}/force", np.abs(forces.sum(axis=0)).max(), 1e-9, "mN", source),
        vanishing(f"{name}/moment", np.abs(np.cross(positions, forces).sum(axis=0)).max(), 1e-8, "mN·mm", source),
    ]


def _turned(name: str) -> list[Check]:
    """A capsule that only turns pulls nowhere."""
    mesh = ball(_RADIUS, 1)
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
    forces = Membrane(mesh, _CAPSULE).forces(mesh.nodes @ turn.T + [5.0, -3.0, 2.0])
    return [vanishing(f"{name}/forces", np.abs(forces).max(), 1e-9, "mN", "frame-indifference")]


def _bedded(name: str) -> list[Check]:
    """A stiff block on ligaments sinks by F / (k A) and tilts by M / (k I) under an eccentric load."""
    mesh = box_mesh(_SIZES, (4, 3, 1), quadratic=True)
    low = np.flatnonzero(mesh.nodes[:, 2] < 1e-9)
    plain = box_model(mesh, Material("linear-elastic", 1e7, 0.3), under=low)
    model = replace(plain, ligaments={"under": _LIGAMENT_KPA_MM})
    body = body_of(mesh, model.materials[0], parts=[ElasticAttachments(model)])
    force = 500.0  # mN down at a corner's middle of the upper edge x = 40
    body.external = np.zeros_like(mesh.nodes)
    edge = np.linalg.norm(mesh.nodes - [_SIZES[0], 0.5 * _SIZES[1], _SIZES[2]], axis=1).argmin()
    body.external[edge, 2] = -force
    moved = equilibrium(body, np.array(mesh.nodes), 1e-9) - mesh.nodes
    slope, middle = np.polyfit(mesh.nodes[low, 0] - 0.5 * _SIZES[0], moved[low, 2], 1)
    area, inertia = _SIZES[0] * _SIZES[1], _SIZES[1] * _SIZES[0] ** 3 / 12.0
    source = "rigid body on springs"
    return [
        relative(f"{name}/sinking", -middle, force / (_LIGAMENT_KPA_MM * area), 0.01, "mm", source),
        relative(f"{name}/tilt", -slope, 0.5 * force * _SIZES[0] / (_LIGAMENT_KPA_MM * inertia), 0.01, "", source),
    ]


CASES = (
    Case("parts/balloon", "a capsule blown up by a quarter, T10", partial(_balloon, "parts/balloon")),
    *(
        Case(name, f"a body squeezed by gas alone, {element}", partial(_squeezed, name, element == "T10"))
        for element in ("T4", "T10")
        for name in [f"parts/gas-{element}"]
    ),
    Case("parts/closed", "gas around a crumpled body", partial(_closed, "parts/closed")),
    Case("parts/turned-capsule", "a capsule that only turns", partial(_turned, "parts/turned-capsule")),
    Case("parts/ligaments", "a stiff block on ligaments that give way", partial(_bedded, "parts/ligaments")),
)
