"""A small body without any symmetry, what is seen of its surface, and its registration."""

import numpy as np
from blocks import block

from glisson.core.arrays import FloatArray
from glisson.core.mesh import TetMesh
from glisson.core.model import Material, Model
from glisson.core.observations import Observation, Observations
from glisson.core.protocols import PreparedRegistration, Registration
from glisson.core.registered import Registered
from glisson.core.registry import make_technique
from glisson.core.structures import Curve, Structures


def prepared(technique: str, model: Model, **values: float) -> PreparedRegistration:
    made: Registration = make_technique("registration", technique, values, "register")
    return made.prepare(model)


def registered(technique: str, model: Model, observations: Observations, **values: float) -> Registered:
    found: Registered = prepared(technique, model, **values).register(observations)
    return found


def lump(cells: tuple[int, int, int] = (9, 6, 4)) -> TetMesh:
    """A smooth body without any symmetry."""
    plain = block(cells, (2.0, 2.0, 2.0), (-1.0, -1.0, -1.0))
    x, y, z = plain.nodes.T
    round_ = np.sqrt(np.stack([1 - y**2 / 2 - z**2 / 2 + y**2 * z**2 / 3, 1 - x**2 / 2 - z**2 / 2 + x**2 * z**2 / 3,
                               1 - x**2 / 2 - y**2 / 2 + x**2 * y**2 / 3], axis=1))  # fmt: skip
    ball = plain.nodes * round_
    taper = 1.0 - 0.35 * ball[:, :1]
    nodes = ball * [80.0, 55.0, 35.0] * np.hstack([np.ones_like(taper), taper, taper * 1.1])
    nodes[:, 2] += 12.0 * np.sin(nodes[:, 0] / 40.0) + 6.0 * np.cos(nodes[:, 1] / 25.0)
    return TetMesh(nodes, plain.tetrahedra)


def lump_model() -> Model:
    """It with a part of the surface, a tip and a duct."""
    mesh = lump()
    surface = np.unique(mesh.boundary()[0])
    upper = surface[mesh.nodes[surface, 2] > np.percentile(mesh.nodes[surface, 2], 45)]
    duct = Curve(np.stack([np.linspace(-40.0, 30.0, 15), np.linspace(-5.0, 10.0, 15), np.linspace(-3.0, 6.0, 15)], 1))
    sets = {"upper": upper, "tip": surface[np.argsort(mesh.nodes[surface, 0])[-4:]]}
    return Model(
        mesh, {0: Material("neo-hookean", 5.0, 0.45)}, {0: "liver"}, sets, Structures(duct=duct, wire_length_mm=60.0)
    )


def seen_surface(
    model: Model, positions: FloatArray, rng: np.random.Generator, sigma: float, name: str = "upper", count: int = 400
) -> Observation:
    """Points evenly strewn over a part of the surface, where the nodes are at `positions`."""
    triangles = model.mesh.boundary()[0]
    triangles = triangles[np.isin(triangles, model.node_set(name)).all(axis=1)]
    corners = positions[triangles]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    chosen = rng.choice(len(triangles), count, p=areas / areas.sum())
    points = np.einsum("pa,pai->pi", rng.dirichlet(np.ones(3), count), corners[chosen])
    return Observation("surface", name, points + sigma * rng.normal(size=points.shape), max(sigma, 0.05), "room")
