"""A soft body that bends and comes back, followed frame by frame from points on a part of its surface.

The bend keeps the volume and is known in closed form, so that the error is known everywhere. Run it with:
python examples/following_a_breath.py
"""

from itertools import permutations

import numpy as np

from glisson.core import Material, Model, Observation, Observations, TetMesh
from glisson.core.mesh import signed_volumes
from glisson.core.registry import make_technique
from glisson.mechanics.registration.following import Following
from glisson.phantom.sparse_data.closed_form import Bend, Frame

CELLS = np.array([14, 10, 7])
HALF_MM = np.array([80.0, 55.0, 35.0])
NOISE_MM = 0.5


def egg() -> TetMesh:
    """A box of cubes, each cut into six tetrahedra between two opposite corners, drawn in to an egg."""
    grid = np.indices(CELLS + 1).reshape(3, -1).T
    number = np.arange(len(grid)).reshape(CELLS + 1)
    first = np.indices(CELLS).reshape(3, -1).T
    paths = [
        np.cumsum([np.zeros(3, int), *np.eye(3, dtype=int)[list(order)]], axis=0) for order in permutations(range(3))
    ]
    cells = np.concatenate([number[tuple((first[:, None] + path).transpose(2, 0, 1))] for path in paths])
    cube = 2.0 * grid / CELLS - 1.0
    others = cube[:, [[1, 2], [2, 0], [0, 1]]] ** 2
    ball = cube * np.sqrt(1.0 - others.sum(axis=2) / 2.0 + others.prod(axis=2) / 3.0)
    nodes = ball * HALF_MM * (1.0 - [0.0, 0.3, 0.35] * ball[:, :1])
    nodes[:, 1] += 15.0 * np.sin(nodes[:, 0] / 40.0)  # no two sides alike, or it could lie in two ways
    turned = signed_volumes(nodes, cells) < 0.0
    cells[turned] = cells[turned][:, [0, 2, 1, 3]]
    return TetMesh(nodes, cells)


def main() -> tuple[list[float], list[float]]:
    """Mean errors of all nodes in mm, frame by frame: as followed, and had the body not moved."""
    mesh = egg()
    model = Model(mesh, {0: Material("neo-hookean", 5.0, 0.45)}, {0: "tissue"}, {})
    surface = np.unique(mesh.boundary()[0])
    seen = surface[mesh.nodes[surface, 2] > -5.0]
    prepared = make_technique("registration", "tractions", {}, "the example").prepare(model)
    following = Following(model, prepared, drift_mm_per_s=10.0)
    random, errors, still = np.random.default_rng(0), [], []
    for number, share in enumerate(np.sin(np.linspace(0.1, 3.0, 6))):
        bend = Bend(Frame(np.zeros(3), np.eye(3)[:, [2, 0, 1]]), 400.0 / share)
        there = bend.forward(mesh.nodes) + [0.0, 0.0, 12.0 * share]
        points = there[seen] + NOISE_MM * random.normal(size=(len(seen), 3))
        frame = Observations((Observation("surface", "front", points, NOISE_MM, time_s=0.5 * number),))
        answer = following.next(frame)
        errors.append(float(np.linalg.norm(answer.found.positions_mm - there, axis=1).mean()))
        still.append(float(np.linalg.norm(mesh.nodes - there, axis=1).mean()))
        print(f"{answer.time_s:.1f} s  {answer.found.status.value}, off by {errors[-1]:.2f} mm of {still[-1]:.2f} mm")
    return errors, still


if __name__ == "__main__":
    main()
