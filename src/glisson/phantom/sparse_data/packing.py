"""The liver packed from below: what is done to it, and the finite-element model that tells where it goes.

As in the challenge's phantom, packs push the underside towards the front. The model is not the one under test:
its law is the neo-Hookean one in logarithms, its tissue uneven, its attachments follow the exact vena cava and the
falciform ligament, and a part of gravity acts, because the table is tilted.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TetMesh
from glisson.core.model import Material, Model
from glisson.core.scenario import ContactLaw, Move, Scenario, Stage
from glisson.geometry.normals import vertex_normals
from glisson.phantom.family import build_anatomy
from glisson.phantom.heterogeneity import Contains, stiffness_levels, uneven_moduli
from glisson.phantom.implicit import Solid
from glisson.phantom.liver_shape import build_shape
from glisson.phantom.proportions import Proportions, draw_proportions
from glisson.phantom.sparse_data.liver import FALCIFORM, SparseLiver
from glisson.phantom.sparse_data.swabbing import evenly_along

_LAW, _LEVELS = "neo-hookean-log", 10
_CAVA_MM, _FALCIFORM_MM = 3.0, 5.0
_UNDERSIDE = 0.6
"""Packs touch where the surface faces the patient's back by a cosine of so much."""

_RIGHT = ((-90.0, -12.0), (-62.0, 32.0), (-52.0, -42.0))
_LEFT = ((26.0, 6.0), (54.0, 24.0))
"""Where packs may lie under a lobe of the nominal member, x and z in mm."""

_PUSH_MM, _ASIDE_MM = (13.0, 22.0), 5.0
_RADIUS_MM = (30.0, 42.0)
_APART_MM = 10.0
_SHARE_OF_WEIGHT = (0.1, 0.4)


@dataclass(frozen=True)
class Pack:
    """Underside within `radius_mm` of a point is carried by a displacement (mm, LPS)."""

    point_mm: tuple[float, float, float]
    radius_mm: float
    displacement_mm: tuple[float, float, float]


@dataclass(frozen=True)
class Packing:
    """Packs, tissue and ligaments; of `gravity` (unit vector, LPS) a share acts: what has changed since the scan."""

    packs: tuple[Pack, ...]
    gravity: tuple[float, float, float]
    share_of_weight: float
    young_modulus_kpa: float
    poisson_ratio: float
    ligament_kpa_mm: float


def draw_packing(seed: int, member: int, deformation: int, attempt: int = 0) -> Packing:
    """How a liver is packed: a pack under either lobe, and sometimes a second one under the right.

    Another `attempt` is another draw, for packings under which the tissue finds no equilibrium.
    """
    random = np.random.default_rng([seed, member, deformation, 4, attempt])
    proportions = draw_proportions(member)
    right = random.permutation(len(_RIGHT))[: int(random.integers(1, 3))]
    places = [*(_RIGHT[place] for place in right), _LEFT[int(random.integers(len(_LEFT)))]]
    gravity = np.array([random.uniform(-0.6, 0.6), 1.0, random.uniform(-0.6, 0.6)])
    gravity /= np.linalg.norm(gravity)
    return Packing(
        tuple(_draw_pack(proportions, place, random) for place in places),
        (float(gravity[0]), float(gravity[1]), float(gravity[2])),
        float(random.uniform(*_SHARE_OF_WEIGHT)),
        float(np.exp(random.uniform(np.log(3.0), np.log(12.0)))),
        float(random.uniform(0.46, 0.49)),
        float(np.exp(random.uniform(np.log(0.02), np.log(0.2)))),
    )


def packed(packing: Packing, mesh: TetMesh, liver: SparseLiver) -> tuple[Model, Scenario]:
    """The model on a mesh of the liver, and the scenario that packs it."""
    tumours = build_anatomy(liver.member).interior.tumours
    moduli = uneven_moduli(mesh, packing.young_modulus_kpa, [_contains(tumour.solid) for tumour in tumours])
    levels, means = stiffness_levels(moduli, _LEVELS)
    density = 1150.0 * packing.share_of_weight
    held = _held(mesh, liver)
    sets = {**held, **_pack_sets(mesh, packing.packs, held["vena cava"])}
    model = Model(
        TetMesh(mesh.nodes, mesh.tetrahedra, levels),
        {n: Material(_LAW, float(mean), packing.poisson_ratio, density) for n, mean in enumerate(means)},
        {n: f"level {n}" for n in range(len(means))},
        sets,
        ligaments={"falciform": packing.ligament_kpa_mm},
    )
    moves = tuple(Move(f"pack {n}", pack.displacement_mm) for n, pack in enumerate(packing.packs))
    stage = Stage("packed", ContactLaw(), fixed=("vena cava",), moves=moves)
    gravity = np.array(packing.gravity)
    return model, Scenario((), (stage,), surgery_gravity=gravity, rest_shape="as-scanned")


def _contains(solid: Solid) -> Contains:
    return lambda points: solid.distance(points) < 0.0


def _draw_pack(proportions: Proportions, place: tuple[float, float], random: np.random.Generator) -> Pack:
    x, y, z = proportions.place([place[0], 0.0, place[1]]) + random.uniform(-8.0, 8.0, size=3) * [1.0, 0.0, 1.0]
    aside = random.uniform(-_ASIDE_MM, _ASIDE_MM, size=2)
    push = (float(aside[0]), -float(random.uniform(*_PUSH_MM)), float(aside[1]))
    return Pack((float(x), float(y), float(z)), float(random.uniform(*_RADIUS_MM)), push)


def _held(mesh: TetMesh, liver: SparseLiver) -> dict[str, IntArray]:
    """What the vena cava holds, and what the falciform ligament draws back."""
    surface, _ = _surface_nodes(mesh)
    points = mesh.nodes[surface]
    cava = build_shape(draw_proportions(liver.member)).cava
    line = evenly_along(liver.features[FALCIFORM], 1.0)
    return {
        "vena cava": surface[cava.distance(points) < _CAVA_MM],
        "falciform": surface[cKDTree(line).query(points)[0] < _FALCIFORM_MM],
    }


def _pack_sets(mesh: TetMesh, packs: Sequence[Pack], fixed: IntArray) -> dict[str, IntArray]:
    """Nodes of each pack, which keeps off what is fixed and off those before it."""
    surface, normals = _surface_nodes(mesh)
    off_fixed, _ = cKDTree(mesh.nodes[fixed]).query(mesh.nodes[surface])
    free = (normals[:, 1] > _UNDERSIDE) & (off_fixed > _APART_MM)
    sets = {}
    for number, pack in enumerate(packs):
        away = np.linalg.norm(mesh.nodes[surface] - pack.point_mm, axis=1)
        sets[f"pack {number}"] = surface[free & (away < pack.radius_mm)]
        free &= away > pack.radius_mm + _APART_MM
    return sets


def _surface_nodes(mesh: TetMesh) -> tuple[IntArray, FloatArray]:
    """Numbers (k,) of the surface's nodes, and their normals (k, 3)."""
    triangles, _ = mesh.boundary()
    surface = np.unique(triangles)
    return surface, vertex_normals(mesh.nodes, triangles)[surface]
