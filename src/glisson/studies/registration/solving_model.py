"""The model that a user would have of a liver of the twin: from a mask with errors, coarse and homogeneous.

It knows neither the truth's tissue nor its attachments; its features are drawn by hand, too, and are off by some
millimetres.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.arrays import FloatArray
from glisson.core.image import Grid, LabelMap
from glisson.core.mesh import TetMesh
from glisson.core.model import Material, Model
from glisson.core.structures import Curve, Structures
from glisson.geometry.distance import SurfaceTree
from glisson.phantom.canvas import voxel_places
from glisson.phantom.family import scan_grid
from glisson.phantom.liver_shape import build_shape
from glisson.phantom.proportions import draw_proportions
from glisson.phantom.sparse_data.liver import build_sparse_liver
from glisson.preoperative.meshing.mmg import Mmg, MmgParameters
from glisson.preoperative.meshing.surface import MarchingCubes, MarchingCubesParameters
from glisson.preoperative.model.attachments import DEFAULT_ATTACHMENTS, node_sets
from glisson.preoperative.model.regions import ORGAN
from glisson.studies.point import Outcome, Point, Task
from glisson.studies.registration.truths import PACKAGES
from glisson.studies.store import read_arrays

MODEL = Task(f"{__name__}:make_model", (*PACKAGES, "glisson.preoperative", __name__))

TISSUE = Material("neo-hookean", 5.0, 0.45)
"""What a user who has measured nothing would take."""

EDGE_MM, ENVELOPE_MM = 20.0, 1.5
"""Some 5,000 linear elements."""

_VOXELS_MM = (1.5, 1.5, 2.0)
_BORDER_SIGMA_MM, _BORDER_LENGTH_MM = 0.7, 8.0
"""A contour is off by so much, alike over such lengths."""

_DRAWN_SIGMA_MM = 1.5
"""So much a feature's line is off, all of it by the same."""


def model_point(seed: int, member: int) -> Point:
    """The point that makes a liver's model."""
    return Point(MODEL, {"seed": seed, "member": member, "edge_mm": EDGE_MM, "envelope_mm": ENVELOPE_MM}, cost=0.4)


def make_model(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """Mesh (T4) of a mask that a seed draws the errors of, and the features as they were drawn on it."""
    member = inputs["member"]
    random = np.random.default_rng([inputs["seed"], member, 5])
    grid = scan_grid(_VOXELS_MM)
    mask = _mask(member, grid, random)
    labels = LabelMap(mask.astype(np.uint8), grid, {1: ORGAN})
    surface = MarchingCubes(MarchingCubesParameters()).extract(mask, labels)
    mesh = Mmg(MmgParameters(edge_length_mm=inputs["edge_mm"], envelope_mm=inputs["envelope_mm"])).mesh(surface)
    skin = mesh.surface()
    tree = SurfaceTree(skin.vertices, skin.triangles)
    curves = {
        name: tree.nearest(curve.points_mm + random.normal(scale=_DRAWN_SIGMA_MM, size=3)).closest_mm
        for name, curve in build_sparse_liver(member).features.items()
    }
    arrays = {"nodes": mesh.nodes, "tetrahedra": mesh.tetrahedra, **{f"curve {n}": c for n, c in curves.items()}}
    return Outcome({"elements": len(mesh.tetrahedra)}, arrays)


def read_model(folder: Path, key: str) -> Model:
    """The model of that point.

    Raises:
        OSError: its file is missing or damaged.
    """
    arrays = read_arrays(folder, key)
    mesh = TetMesh(arrays["nodes"], arrays["tetrahedra"])
    curves = {name.removeprefix("curve "): Curve(arrays[name]) for name in arrays if name.startswith("curve ")}
    sets = node_sets(mesh, DEFAULT_ATTACHMENTS)
    return Model(mesh, {0: TISSUE}, {0: ORGAN}, sets, Structures(curves=curves))


def _mask(member: int, grid: Grid, random: np.random.Generator) -> NDArray[np.bool_]:
    solid = build_shape(draw_proportions(member)).liver
    noise: FloatArray = ndimage.gaussian_filter(
        random.normal(size=grid.shape), _BORDER_LENGTH_MM / np.asarray(grid.spacing_mm), mode="wrap"
    )
    mask: NDArray[np.bool_] = solid.distance(voxel_places(grid)) + _BORDER_SIGMA_MM * noise / noise.std() < 0.0
    return mask
