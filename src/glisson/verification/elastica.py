"""A slender cantilever bent by a dead force at its end, against the elastica."""

import numpy as np

from glisson.core.model import Material
from glisson.geometry.boxes import box_mesh
from glisson.mechanics.elements import surface_quadrature
from glisson.verification.bodies import body_of, equilibrium
from glisson.verification.check import Case, Check, relative

_NAME = "elastica"
_LENGTH, _HEIGHT, _WIDTH = 100.0, 2.0, 2.0
_YOUNG = 1e5  # kPa
_COUNTS = (50, 1, 1)
_TIPS = {1.0: (0.30172, 0.05643), 4.0: (0.66996, 0.32894), 10.0: (0.81061, 0.55500)}
"""P L² / (E I) → deflection and shortening of the tip over the length (Mattiasson 1981, IJNME 17:145, table I)."""
_STEP = 0.5  # of P L² / (E I)


def _bent() -> list[Check]:
    # Without Poisson's ratio a solid beam has the elastica's stiffness E I; its strains stay small.
    material = Material("neo-hookean-log", _YOUNG, 0.0)
    mesh = box_mesh((_LENGTH, _WIDTH, _HEIGHT), _COUNTS, quadratic=True)
    root = np.repeat(mesh.nodes[:, :1] < 1e-9, 3, axis=1)
    body = body_of(mesh, material, root)
    surface = surface_quadrature(mesh.nodes, mesh)
    end = surface.normals[:, 0] > 0.5
    traction = np.where(end, surface.areas, 0.0)[:, None] * [0.0, 0.0, 1.0] / surface.areas[end].sum()
    unit = surface.scatter(traction)
    scale = _YOUNG * _WIDTH * _HEIGHT**3 / 12.0 / _LENGTH**2  # E I / L², mN
    tip = mesh.nodes[:, 0] > _LENGTH - 1e-9
    positions, checks = np.array(mesh.nodes), []
    for load in np.arange(_STEP, max(_TIPS) + 1e-9, _STEP):
        body.external = load * scale * unit
        positions = equilibrium(body, positions, 1e-7)
        if load in _TIPS:
            moved = (positions - mesh.nodes)[tip].mean(axis=0) / _LENGTH
            deflection, shortening = _TIPS[load]
            told, source = f"{_NAME}/cantilever", "Mattiasson 1981"
            checks += [
                relative(f"{told}/deflection-{load:g}", moved[2], deflection, 0.01, "of length", source),
                relative(f"{told}/shortening-{load:g}", -moved[0], shortening, 0.01, "of length", source),
            ]
    return checks


CASES = (Case(f"{_NAME}/cantilever", "slender cantilever under a dead end force, P L² / E I to 10, T10", _bent),)
