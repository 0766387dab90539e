"""The seeded family of digital livers."""

from collections.abc import Sequence

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Deformation
from glisson.core.errors import BadInput
from glisson.core.image import Grid
from glisson.core.mesh import TriangleSurface
from glisson.core.structures import Curve, Structures, Tumour, VesselTree
from glisson.phantom.appearance import PORTAL_PHASE, Appearance
from glisson.phantom.body import BODY_BOX
from glisson.phantom.interior import Interior, build_interior
from glisson.phantom.lever_lift import lever_lift
from glisson.phantom.liver_shape import build_shape
from glisson.phantom.loading import Loading
from glisson.phantom.phantom import Phantom
from glisson.phantom.proportions import draw_proportions
from glisson.phantom.scan import Anatomy, make_scan

DEFAULT_SPACING_MM = (1.5, 1.5, 2.0)


def make_phantom(
    seed: int,
    spacing_mm: Sequence[float] = DEFAULT_SPACING_MM,
    grid: Grid | None = None,
    appearance: Appearance = PORTAL_PHASE,
) -> Phantom:
    """Member `seed` (≥ 0) of the family, without a deformed truth.

    Its procedural shape is taken as the scanned (loaded) shape A. `grid` may be any grid in LPS and
    overrules `spacing_mm`, which asks for one that shows the upper abdomen. `appearance` says how tissues look.

    Raises:
        BadInput: the seed is negative or the spacing is not three lengths of 0.3 to 10 mm.
    """
    return assemble(build_anatomy(seed), seed, scan_grid(spacing_mm) if grid is None else grid, appearance=appearance)


def build_anatomy(seed: int, loading: Loading | None = None) -> Anatomy:
    """Shape and interior of a member; `loading` takes its rest shape to the scanned one."""
    if seed < 0:
        raise BadInput(f"A phantom's seed must be a whole number from 0 on, not {seed}.")
    proportions = draw_proportions(seed)
    shape = build_shape(proportions)
    return Anatomy(proportions, shape, build_interior(proportions, shape, seed), loading)


def assemble(
    anatomy: Anatomy,
    seed: int,
    grid: Grid,
    truth: Deformation | None = None,
    appearance: Appearance = PORTAL_PHASE,
) -> Phantom:
    """Render an anatomy and put everything known about it together."""
    scan = make_scan(anatomy, grid, seed, appearance)
    return Phantom(
        seed=seed,
        volume=scan.volume,
        organ=scan.organ,
        tumours=scan.tumours,
        structures=scan.structures,
        couinaud=scan.couinaud,
        exact=scanned_structures(anatomy.interior, anatomy.loading),
        scenario=lever_lift(anatomy.proportions),
        truth=truth,
    )


def scan_grid(spacing_mm: Sequence[float]) -> Grid:
    """A grid with the patient's axes that shows the whole upper abdomen at this spacing."""
    spacing = np.asarray(spacing_mm, dtype=np.float64)
    if spacing.shape != (3,) or not (np.all(spacing >= 0.3) and np.all(spacing <= 10.0)):
        raise BadInput(f"The phantom's voxel spacing must be three lengths of 0.3 to 10 mm, not {spacing.tolist()}.")
    # Zero lies on a voxel face: centres half a voxel off the flat underside count its volume without bias.
    first, last = np.floor(BODY_BOX[0] / spacing), np.ceil(BODY_BOX[1] / spacing)
    shape = (last - first).astype(int)
    return Grid((int(shape[0]), int(shape[1]), int(shape[2])), spacing, (first + 0.5) * spacing)


def scanned_structures(interior: Interior, loading: Loading | None) -> Structures:
    """The interior in the scanned shape A."""

    def scanned(points: FloatArray) -> FloatArray:
        return points if loading is None else loading.scanned(points)

    def moved_tree(tree: VesselTree) -> VesselTree:
        return VesselTree(tree.name, scanned(tree.points_mm), tree.radii_mm, tree.edges)

    tumours = []
    for tumour in interior.tumours:
        surface = tumour.surface
        tumours.append(Tumour(tumour.name, TriangleSurface(scanned(surface.vertices), surface.triangles)))
    return Structures(
        tumours=tuple(tumours),
        trees=(moved_tree(interior.portal), moved_tree(interior.hepatic)),
        duct=Curve(scanned(interior.duct.points_mm)),
        wire_length_mm=_scanned_length(interior, loading),
    )


def _scanned_length(interior: Interior, loading: Loading | None) -> float:
    """Arc length in A of the part of the duct that holds the wire."""
    if loading is None:
        return interior.wire_length_mm
    inside = interior.duct.arc_lengths_mm <= interior.wire_length_mm
    return Curve(loading.scanned(interior.duct.points_mm[inside])).length_mm
