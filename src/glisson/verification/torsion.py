"""A round bar twisted at constant length, nearly incompressible: twisting moment and axial thrust.

Rivlin's solution for an incompressible neo-Hookean bar (Rivlin 1949, "Large elastic deformations of isotropic
materials VI", Phil. Trans. R. Soc. A 242:173): cross-sections stay plane and turn, M = π µ τ a⁴ / 2 and
N = −π µ τ² a⁴ / 4, with the twist τ in rad/mm and the radius a.
"""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.model import Material
from glisson.verification.bodies import body_of, equilibrium, reactions
from glisson.verification.check import Case, Check, relative
from glisson.verification.meshes import disc, extruded, rounded

_NAME = "closed-form/torsion"
_RADIUS, _LENGTH = 10.0, 10.0
_TURN = 0.8  # of the upper end, rad
_STEPS = 4
_RINGS, _LAYERS = 4, 12


def _turned(places: FloatArray, twist: float) -> FloatArray:
    """Places (n, 3) turned about the z axis by `twist` z."""
    angle = twist * places[:, 2]
    x, y, z = places.T
    return np.stack([x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle), z], axis=1)


def _torsion() -> list[Check]:
    material = Material("neo-hookean", 7.0, 0.4999)
    rings = np.arange(1, _RINGS + 1)
    points, triangles = disc(_RADIUS * rings / _RINGS, [int(6 * ring) for ring in rings])
    mesh = extruded(points, triangles, np.linspace(0.0, _LENGTH, _LAYERS + 1)).as_quadratic()
    mesh = rounded(mesh, _RADIUS)
    ends = (mesh.nodes[:, 2] < 1e-9) | (mesh.nodes[:, 2] > _LENGTH - 1e-9)
    body = body_of(mesh, material, np.repeat(ends[:, None], 3, axis=1))
    twist = _TURN / _LENGTH
    positions = np.array(mesh.nodes)
    for _ in range(_STEPS):
        # From one equilibrium towards the next by a further twist of everything.
        positions = equilibrium(body, _turned(positions, twist / _STEPS), 1e-8)
    upper = mesh.nodes[:, 2] > _LENGTH - 1e-9
    forces = reactions(body, positions)[upper]
    moment = np.cross(positions[upper], forces)[:, 2].sum()
    scale = np.pi * material.shear_modulus_kpa * twist * _RADIUS**4
    source = "Rivlin 1949, incompressible"
    return [
        relative(f"{_NAME}/moment", moment, 0.5 * scale, 0.005, "mN mm", source),
        relative(f"{_NAME}/thrust", forces[:, 2].sum(), -0.25 * twist * scale, 0.005, "mN", source),
    ]


CASES = (Case(_NAME, "round bar twisted by 46° over the length of a radius, T10, ν = 0.4999", _torsion, slow=True),)
