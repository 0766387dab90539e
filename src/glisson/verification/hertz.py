"""A round elastic body pressed on a rigid plane, against Hertz's contact.

How far the body is pressed depends on its size and on how it is held; contact radius and largest pressure under a
given force do not, up to the third power of radius over size (Johnson 1985, "Contact mechanics", section 5.8): the
body is eight contact radii wide and high.
"""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.mesh import TetMesh
from glisson.core.model import Material
from glisson.core.scenario import ContactLaw
from glisson.mechanics.contact_law import Cushion
from glisson.verification.bodies import body_of, equilibrium, floor, mapped
from glisson.verification.check import Case, Check, relative
from glisson.verification.meshes import disc, extruded

_NAME = "hertz/sphere"
_ROUNDING = 50.0  # radius of the sphere, mm
_CONTACT = 4.0  # radius of the contact to aim at, mm
_SIZE = 8.0 * _CONTACT
_FINE, _GROWTH = 0.9, 1.5  # element size at the contact in mm, and how fast it grows beyond
_MATERIAL = Material("linear-elastic", 1000.0, 0.3)
_PLANE_MODULUS = _MATERIAL.young_modulus_kpa / (1.0 - _MATERIAL.poisson_ratio**2)  # kPa
_CUSHION = Cushion(range_mm=0.01, stiffness_kpa_mm=5e4)


def _graded(fine_until: float) -> FloatArray:
    """Ascending lengths from the first element size to `_SIZE`."""
    lengths = list(np.arange(_FINE, fine_until, _FINE))
    step = _FINE
    while lengths[-1] < _SIZE:
        step *= _GROWTH
        lengths.append(lengths[-1] + step)
    found = np.array(lengths)
    coarse = found > fine_until
    # The coarse part is stretched so that it ends where the body does.
    inner = found[~coarse][-1]
    found[coarse] = inner + (found[coarse] - inner) * (_SIZE - inner) / (found[-1] - inner)
    return found


def _quarter() -> TetMesh:
    """A quarter of the body: a cylinder whose lower end is a cap of the sphere, touching z = 0 at the origin."""
    radii = _graded(1.4 * _CONTACT)
    most = int(np.ceil(1.4 * _CONTACT / _FINE))
    points, triangles = disc(radii, [min(ring + 1, most) for ring in range(len(radii))], 0.5 * np.pi)
    mesh = extruded(points, triangles, np.concatenate([[0.0], _graded(0.7 * _CONTACT)])).as_quadratic()

    def capped(places: FloatArray) -> FloatArray:
        cap = _ROUNDING - np.sqrt(_ROUNDING**2 - places[:, 0] ** 2 - places[:, 1] ** 2)
        height = cap + places[:, 2] * (_SIZE - cap) / _SIZE
        return np.column_stack([places[:, :2], height])

    return mapped(mesh, capped)


def _pressed() -> list[Check]:
    mesh = _quarter()
    fixed = np.zeros(mesh.nodes.shape, dtype=bool)
    fixed[:, :2] = np.abs(mesh.nodes[:, :2]) < 1e-9
    upper = mesh.nodes[:, 2] > _SIZE - 1e-9
    fixed[upper] = True
    body = body_of(mesh, _MATERIAL, fixed, boards=[floor()], cushion=_CUSHION)
    body.law = ContactLaw(friction=0.0)
    positions = np.array(mesh.nodes)
    # Pressed a little further than Hertz's approach a² / R, since the body gives way as a whole too.
    positions[:, 2] -= 1.1 * _CONTACT**2 / _ROUNDING * mesh.nodes[:, 2] / _SIZE
    positions = equilibrium(body, positions, 1e-8)
    touch = body.touches(positions)[0]
    areas = body.surface.areas[touch.points]
    reach = np.sum(body.surface.positions(positions)[touch.points, :2] ** 2, axis=1)
    quarter_force = float(areas @ touch.pressures)
    force = 4.0 * quarter_force
    # Of p = p0 √(1 − r²/a²): mean r², weighted by p, is 2/5 a²; mean p, weighted by p, is 3/4 p0.
    radius = np.sqrt(2.5 * (areas * touch.pressures) @ reach / quarter_force)
    peak = 4.0 / 3.0 * (areas @ touch.pressures**2) / quarter_force
    expected = (0.75 * force * _ROUNDING / _PLANE_MODULUS) ** (1.0 / 3.0)
    return [
        relative(f"{_NAME}/contact-radius", radius, expected, 0.03, "mm", "Hertz 1882"),
        relative(f"{_NAME}/largest-pressure", peak, 1.5 * force / (np.pi * expected**2), 0.03, "kPa", "Hertz 1882"),
    ]


CASES = (Case(_NAME, "elastic sphere on a rigid plane, without friction, T10", _pressed, slow=True),)
