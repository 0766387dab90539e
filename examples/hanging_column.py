"""A column that hangs from its top and grows under its own weight: a mechanical model from nothing.

With Poisson's ratio 0 the growth is known: ρ g L² / (2 E). Run it with: python examples/hanging_column.py
"""

from itertools import permutations

import numpy as np

from glisson.core import ContactLaw, Material, Model, Scenario, Stage, TetMesh
from glisson.core.mesh import signed_volumes
from glisson.core.registry import make_technique
from glisson.core.units import STANDARD_GRAVITY_MM_S2, density_from_kg_m3

LENGTH_MM = 80.0
TISSUE = Material("neo-hookean", young_modulus_kpa=700.0, poisson_ratio=0.0, density_kg_m3=1150.0)


def column(cubes: int = 8) -> TetMesh:
    """Cubes on top of each other along z, each cut into the six tetrahedra between two opposite corners."""
    size = LENGTH_MM / cubes
    nodes = size * np.array([(i, j, k) for k in range(cubes + 1) for j in (0, 1) for i in (0, 1)], dtype=float)
    paths = np.array([(0, a, a + b, 7) for a, b, _ in permutations((1, 2, 4))])
    cells = np.concatenate([paths + 4 * layer for layer in range(cubes)])
    turned = signed_volumes(nodes, cells) < 0.0
    cells[turned] = cells[turned][:, [0, 2, 1, 3]]
    return TetMesh(nodes, cells)


def main() -> tuple[float, float]:
    """Growth in mm as computed, and as known in closed form for small strain."""
    mesh = column()
    top = np.flatnonzero(mesh.nodes[:, 2] == LENGTH_MM)
    bottom = np.flatnonzero(mesh.nodes[:, 2] == 0.0)
    model = Model(mesh, {0: TISSUE}, {0: "tissue"}, {"top": top})
    hang = Stage("hang", ContactLaw(), fixed=("top",))
    down = np.array([0.0, 0.0, -1.0])
    scenario = Scenario(tools=(), stages=(hang,), surgery_gravity=down, rest_shape="as-scanned")
    solver = make_technique("solver", "quasi-static", {"tolerance": 1e-8}, "the example")
    deformation = solver.solve(model, scenario)
    print(deformation.message)
    grown = -float(deformation.displacement[bottom, 2].mean())
    weight = density_from_kg_m3(TISSUE.density_kg_m3) * STANDARD_GRAVITY_MM_S2
    known = weight * LENGTH_MM**2 / (2.0 * TISSUE.young_modulus_kpa)
    print(f"grown by {grown:.4f} mm; small strain gives {known:.4f} mm")
    return grown, known


if __name__ == "__main__":
    main()
