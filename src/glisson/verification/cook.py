"""Cook's membrane, a tapered cantilever that is sheared at its end, nearly incompressible and in plane strain."""

from functools import partial

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.mesh import TetMesh
from glisson.core.model import Material
from glisson.geometry.boxes import box_mesh
from glisson.mechanics.elements import surface_quadrature
from glisson.verification.bodies import body_of, equilibrium, mapped
from glisson.verification.check import Case, Check, relative

_LENGTH, _ROOT, _TIP, _RISE = 48.0, 44.0, 16.0, 44.0
_COUNTS = (24, 24)
_CORNER, _MIDDLE = (48.0, 60.0), (48.0, 52.0)  # of the tip


def _tapered(places: FloatArray) -> FloatArray:
    """(share of the length, share of the height, z) to places, the finer the nearer to the root's upper corner.

    There the stress is singular.
    """
    along, across = places[:, 0] ** 2, 1.0 - (1.0 - places[:, 1]) ** 1.5
    height = _ROOT + along * (_TIP - _ROOT)
    return np.stack([_LENGTH * along, _RISE * along + height * across, places[:, 2]], axis=1)


def _membrane() -> TetMesh:
    """One layer of T10 elements with straight edges."""
    return mapped(box_mesh((1.0, 1.0, _LENGTH / _COUNTS[0]), (*_COUNTS, 1)), _tapered).as_quadratic()


def _rise(material: Material, force: float, steps: int, point: tuple[float, float]) -> float:
    """How far a point rises under a dead shear force (mN per mm of thickness) spread evenly over the tip."""
    mesh = _membrane()
    fixed = np.repeat(mesh.nodes[:, :1] < 1e-9, 3, axis=1)
    fixed[:, 2] = True
    body = body_of(mesh, material, fixed)
    surface = surface_quadrature(mesh.nodes, mesh)
    areas = np.where(surface.normals[:, 0] > 1.0 - 1e-9, surface.areas, 0.0)
    loads = surface.scatter(areas[:, None] * [0.0, force / _TIP, 0.0])
    positions = np.array(mesh.nodes)
    for share in np.linspace(0.0, 1.0, steps + 1)[1:]:
        body.external = share * loads
        positions = equilibrium(body, positions, 1e-7)
    node = np.linalg.norm(mesh.nodes[:, :2] - point, axis=1).argmin()
    return float(positions[node, 1] - mesh.nodes[node, 1])


def _small_strain(name: str) -> list[Check]:
    material = Material("linear-elastic", 0.75 * 1.4999, 0.4999)  # µ = 0.375 kPa
    rise = _rise(material, 1.0, 1, _MIDDLE)
    source = "Krysl, FinEALE Cook_3D_strain (extrapolated)"
    return [relative(f"{name}/middle-of-the-tip", rise, 16.432584, 0.01, "mm", source)]


def _finite_strain(name: str) -> list[Check]:
    material = Material("neo-hookean", 240.565, 0.4999)  # µ = 80.1938 and κ = 400,942, as published in MPa
    rise = _rise(material, 100.0, 4, _CORNER)
    source = "Elguedj et al. 2008, CMAME 197:2732, 128 × 128 mesh (as in FinEALE)"
    return [relative(f"{name}/corner-of-the-tip", rise, 6.9083, 0.01, "mm", source)]


CASES = (
    Case(
        "cook/small-strain",
        "Cook's membrane in plane strain, small strain, T10, ν = 0.4999",
        partial(_small_strain, "cook/small-strain"),
        slow=True,
    ),
    Case(
        "cook/neo-hookean",
        "Cook's membrane in plane strain, finite strain, T10, ν = 0.4999",
        partial(_finite_strain, "cook/neo-hookean"),
        slow=True,
    ),
)
