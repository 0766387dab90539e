"""Energy balance of a load path without friction: the work done on the body is the energy stored in it."""

import numpy as np

from glisson.core.model import Material
from glisson.core.scenario import ContactLaw
from glisson.geometry.boxes import box_mesh
from glisson.verification.bodies import body_of, distorted, equilibrium, floor, reactions
from glisson.verification.check import Case, Check, relative

_NAME = "energy/press-and-pull"
_STEPS = 16  # an even number, for Simpson's rule
_WAY = np.array([3.0, 1.0, -2.0])  # of the upper face, mm


def _path() -> list[Check]:
    """A block on a smooth floor, pulled sideways by dead loads on one side while its upper face is pressed down."""
    mesh = distorted(box_mesh((20.0, 16.0, 12.0), (4, 3, 3)), 0.8).as_quadratic()
    upper = mesh.nodes[:, 2] > 12.0 - 1e-9
    held = np.repeat(upper[:, None], 3, axis=1)
    body = body_of(mesh, Material("neo-hookean", 7.0, 0.45), held, boards=[floor(-0.09)])
    body.law = ContactLaw(friction=0.0)
    loads = np.zeros_like(mesh.nodes)
    side = mesh.nodes[:, 0] > 20.0 - 1e-9
    loads[side, 0] = 200.0 / side.sum()
    positions = np.array(mesh.nodes)
    stored, pushes, ways = [], [], []
    for share in np.linspace(0.0, 1.0, _STEPS + 1):
        positions[upper] = mesh.nodes[upper] + share * _WAY
        body.external = share * loads
        positions = equilibrium(body, positions, 1e-10)
        # The body's potential counts the dead loads; what is stored does not.
        moved = positions - mesh.nodes
        stored.append(body.energy(positions) + float(np.vdot(body.external, moved)))
        pushes.append(float(reactions(body, positions).sum(axis=0) @ _WAY))
        ways.append(float(np.vdot(loads, moved)))
    weights = np.ones(_STEPS + 1)
    weights[1:-1:2], weights[2:-1:2] = 4.0, 2.0
    work = float(weights @ pushes) / (3.0 * _STEPS)
    # Partial integration: ∫ s dw = w(1) − ∫ w ds for a load that grows with s.
    work += ways[-1] - float(weights @ ways) / (3.0 * _STEPS)
    return [relative(f"{_NAME}/work", work, stored[-1] - stored[0], 1e-4, "µJ", "conservation of energy")]


CASES = (Case(_NAME, "block on a smooth floor, pressed and pulled along a path", _path),)
