"""Meshes of a wanted number of elements: studies compare sizes, meshers take lengths."""

import numpy as np

from glisson.core.mesh import TetMesh, TriangleSurface
from glisson.phantom.liver_shape import build_shape
from glisson.phantom.proportions import Proportions
from glisson.phantom.solid_surface import solid_surface
from glisson.preoperative.meshing.mmg import Mmg, MmgParameters

_ENVELOPE = 1.0 / 16.0
"""How far the surface may stray, in edge lengths: as the mesher's own default for a fine mesh, about."""

_LARGEST_ENVELOPE_MM = 3.0
_FIRST_EDGE_MM, _FIRST_ELEMENTS, _FIRST_POWER = 16.0, 8400.0, 2.0
_CLOSE = 0.02
_SURFACE_STEP_MM = 2.5
_TRIES = 7


def member_surface(proportions: Proportions) -> TriangleSurface:
    """The surface of a member of the phantom family in its rest shape, as fine as studies mesh it."""
    return solid_surface(build_shape(proportions).liver, _SURFACE_STEP_MM)


def member_mesh(proportions: Proportions, edge_mm: float) -> TetMesh:
    """A T4 mesh of a member with elements of about that edge length.

    Raises:
        StageFailed: no mesh could be made.
    """
    return Mmg(MmgParameters(edge_length_mm=edge_mm, envelope_mm=_ENVELOPE * edge_mm)).mesh(member_surface(proportions))


def mesh_of_size(surface: TriangleSurface, elements: int) -> tuple[TetMesh, float]:
    """A T4 mesh with about that number of elements (mostly within 2 %), and the edge length (mm) aimed at.

    The number falls with a power of the edge length; the power is found on the way.

    Raises:
        StageFailed: no mesh could be made.
    """
    edge, power = _FIRST_EDGE_MM * (_FIRST_ELEMENTS / elements) ** (1.0 / _FIRST_POWER), _FIRST_POWER
    tried: list[tuple[float, float, TetMesh]] = []
    for _ in range(_TRIES):
        mesh = Mmg(MmgParameters(edge_length_mm=edge, envelope_mm=min(_ENVELOPE * edge, _LARGEST_ENVELOPE_MM))).mesh(
            surface
        )
        excess = float(np.log(len(mesh.tetrahedra) / elements))
        if tried and tried[-1][0] != excess:
            steepness = (tried[-1][0] - excess) / np.log(edge / tried[-1][1])
            power = float(np.clip(steepness, 1.0, 4.0))
        tried.append((excess, edge, mesh))
        if abs(excess) < _CLOSE:
            break
        edge = float(np.clip(edge * np.exp(excess / power), 0.5, 100.0))
    _, edge, mesh = min(tried, key=lambda made: abs(made[0]))
    return mesh, edge
