"""A rod in a duct: drawn through a straight and a curved tube that do not give way, and bent on three supports."""

from functools import partial

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.mesh import TetMesh
from glisson.core.model import Material, Rod
from glisson.core.structures import Curve
from glisson.core.units import newtons_from_millinewtons
from glisson.geometry.boxes import box_mesh
from glisson.mechanics.sliding_rod import SlidingRod
from glisson.verification.bodies import body_of, equilibrium
from glisson.verification.check import Case, Check, relative

_LENGTH, _THICKNESS = 120.0, 4.0
_GRIP = 0.5  # mN/mm
_AXIAL = 4000.0  # mN
_FRICTION = 0.4
_RADIUS, _ANGLE = 40.0, 0.5 * np.pi
_BENDING = 2e4  # mN mm²


def _tube(length: float) -> TetMesh:
    mesh = box_mesh((length, _THICKNESS, _THICKNESS), (int(length / _THICKNESS), 1, 1), quadratic=True)
    return TetMesh(mesh.nodes - [0.0, 0.5 * _THICKNESS, 0.5 * _THICKNESS], mesh.tetrahedra)


def _rod(mesh: TetMesh, points: FloatArray, length: float, **rod: float) -> SlidingRod:
    return SlidingRod(mesh, Curve(points), length, Rod(**rod))


def _drawn(rod: SlidingRod, mesh: TetMesh, reach: float, steps: int) -> float:
    """The pull in mN at the mouth when the rod has been drawn out by `reach` mm."""
    for drawn in np.linspace(0.0, reach, steps + 1)[1:]:
        rod.drawn_mm = float(drawn)
        rod.renew(mesh.nodes)
        rod.accept(mesh.nodes)
    return 1e3 * rod.report(mesh.nodes).tension_n


def _sheared(name: str) -> list[Check]:
    """Shear lag: the front of slip runs inward as the rod is drawn, and the pull is √(2 q E A δ)."""
    mesh = _tube(_LENGTH)
    axial, grip = newtons_from_millinewtons(_AXIAL), newtons_from_millinewtons(_GRIP)
    points = np.array([[0.0, 0.0, 0.0], [_LENGTH, 0.0, 0.0]])
    rod = _rod(mesh, points, _LENGTH, bending_stiffness_n_mm2=0.0, axial_stiffness_n=axial, grip_n_mm=grip)
    reach = 0.4
    pull = _drawn(rod, mesh, reach, 20)
    return [relative(f"{name}/pull", pull, np.sqrt(2.0 * _GRIP * _AXIAL * reach), 0.02, "mN", "shear lag")]


def _curved(name: str) -> list[Check]:
    """Drawn through a bend until it slides everywhere: dT/ds = q + µ T / R from a free tip."""
    arc = _RADIUS * _ANGLE
    mesh = _tube(arc)
    angles = mesh.nodes[:, 0] / _RADIUS
    reach = _RADIUS + mesh.nodes[:, 1]
    wound = np.stack([reach * np.sin(angles), reach * np.cos(angles), mesh.nodes[:, 2]], axis=1)
    bent = TetMesh(wound, mesh.tetrahedra)
    angles = np.linspace(0.0, _ANGLE, 200)
    points = _RADIUS * np.stack([np.sin(angles), np.cos(angles), np.zeros(200)], axis=1)
    axial, grip = newtons_from_millinewtons(_AXIAL), newtons_from_millinewtons(_GRIP)
    rod = _rod(
        bent, points, arc, bending_stiffness_n_mm2=0.0, axial_stiffness_n=axial, friction=_FRICTION, grip_n_mm=grip
    )
    expected = _GRIP * _RADIUS / _FRICTION * (np.exp(_FRICTION * _ANGLE) - 1.0)
    return [relative(f"{name}/pull", _drawn(rod, bent, 0.6, 10), expected, 0.02, "mN", "capstan equation with grip")]


def _supported(name: str) -> list[Check]:
    """A rod in a tube of next to nothing, on two supports and pressed in the middle: 48 E I δ / L³."""
    mesh = _tube(_LENGTH)
    x = mesh.nodes[:, 0]
    points = np.array([[0.0, 0.0, 0.0], [_LENGTH, 0.0, 0.0]])
    rod = _rod(
        mesh, points, _LENGTH, bending_stiffness_n_mm2=newtons_from_millinewtons(_BENDING), axial_stiffness_n=4.0
    )
    middle = np.abs(x - 0.5 * _LENGTH) < 1e-9
    fixed = np.zeros(mesh.nodes.shape, dtype=bool)
    fixed[:, 1] = True
    fixed[:, 2] = (x < 1e-9) | (x > _LENGTH - 1e-9) | middle
    fixed[x < 1e-9, 0] = True
    body = body_of(mesh, Material("neo-hookean-log", 0.1, 0.0), fixed, parts=[rod])
    sag = 1.0
    positions = np.array(mesh.nodes)
    share = np.minimum(x, _LENGTH - x) / _LENGTH
    positions[:, 2] -= sag * share * (3.0 - 4.0 * share**2)
    positions = equilibrium(body, positions, 1e-8)
    force = rod.forces(positions)[middle, 2].sum()
    return [relative(f"{name}/force", force, 48.0 * _BENDING * sag / _LENGTH**3, 0.02, "mN", "Euler–Bernoulli beam")]


CASES = (
    Case("rod/straight", "a rod drawn out of a straight tube that hugs it", partial(_sheared, "rod/straight")),
    Case("rod/bend", f"a rod drawn through a bend of 90°, µ = {_FRICTION}", partial(_curved, "rod/bend")),
    Case("rod/supports", "a rod on two supports, pressed in the middle", partial(_supported, "rod/supports")),
)
