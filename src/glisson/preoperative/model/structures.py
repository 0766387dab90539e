"""What lies inside the organ, from label maps: tumours as surfaces, vessel trees, bile duct and wire."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.interpolate import splev, splprep

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.image import Grid, LabelMap
from glisson.core.structures import Curve, Structures, Tumour, VesselTree
from glisson.geometry.distance_map import distance_inside
from glisson.preoperative.meshing.surface import MarchingCubes, MarchingCubesParameters
from glisson.preoperative.vessels.centrelines import Tree, centreline_trees, path_from

VESSELS = ("portal", "hepatic", "artery")
"""Labels that become vessel trees."""

SHORTEST_TREE_MM = 10.0
"""Separate pieces of a vessel that are shorter than this are left out."""

_BORDER_MM = 3.0
"""Vessels are followed so far beyond the organ's mask, so that their trunks reach its surface."""


def build_structures(organ: LabelMap, tumours: LabelMap | None, structures: LabelMap | None) -> Structures:
    """Tumours, trees, duct and wire of label maps on one grid (groups of a case).

    A vessel in several pieces gives a tree for each: "portal", "portal 2", … .

    Raises:
        BadInput: a tumour lies outside the organ.
    """
    mask = organ.mask("liver")
    trees = () if structures is None else _vessel_trees(mask, structures)
    duct, wire_length = (None, None) if structures is None else _duct_and_wire(mask, structures, trees)
    return Structures(() if tumours is None else _tumours(mask, tumours), trees, duct, wire_length)


def _tumours(organ: NDArray[np.bool_], tumours: LabelMap) -> tuple[Tumour, ...]:
    extractor = MarchingCubes(MarchingCubesParameters(edge_length_mm=2.0))
    found = []
    for name in tumours.names.values():
        mask = tumours.mask(name)
        if not mask.any():
            continue
        if (mask & organ).sum() < 0.5 * mask.sum():
            raise BadInput(f"{name!r} lies mostly outside the liver's mask; check the labels or the liver's outline.")
        found.append(Tumour(name, extractor.extract(mask, tumours)))
    return tuple(found)


def _vessel_trees(organ: NDArray[np.bool_], structures: LabelMap) -> tuple[VesselTree, ...]:
    near = _grown(organ, structures.grid, _BORDER_MM)
    found = []
    for name in VESSELS:
        if name in structures.names.values():
            trees = centreline_trees(structures.mask(name) & near, structures.grid, SHORTEST_TREE_MM)
            for n, tree in enumerate(trees, start=1):
                own_name = name if n == 1 else f"{name} {n}"
                found.append(VesselTree(own_name, tree.points_mm, tree.radii_mm, tree.edges))
    return tuple(found)


def _duct_and_wire(
    organ: NDArray[np.bool_], structures: LabelMap, trees: tuple[VesselTree, ...]
) -> tuple[Curve | None, float | None]:
    """The duct's centreline from its mouth inward, and the length of the wire that lies in it.

    The wire takes its voxels from the duct in a label map, so both together are the duct. Without a wire
    the length is that of the whole duct; without a duct the wire's own centreline stands for it.
    """
    grid, present = structures.grid, set(structures.names.values())
    labels = [name for name in ("duct", "wire") if name in present]
    near = _grown(organ, grid, _BORDER_MM)
    tube = structures.mask(*labels) & near
    lines = centreline_trees(tube, grid)
    if not lines:
        return None, None
    curve = _tube_curve(lines[0], tube, _mouth_side(organ, structures, trees, lines[0]), grid)
    wire = structures.mask("wire") & near if "wire" in present else np.zeros_like(near)
    return curve, _arc_length_reached(curve, wire, grid)


def _mouth_side(
    organ: NDArray[np.bool_], structures: LabelMap, trees: tuple[VesselTree, ...], line: Tree
) -> FloatArray:
    """A point (3,) towards the hilum: the portal trunk, else the gallbladder, else the way out of the organ."""
    grid = structures.grid
    portal = [tree for tree in trees if tree.name == "portal"]
    if portal:
        towards = portal[0].points_mm[0]
    elif "gallbladder" in structures.names.values():
        cells = np.argwhere(structures.mask("gallbladder"))
        towards = grid.points_from_indices(cells).mean(axis=0)
    else:
        depth = distance_inside(organ, grid.spacing_mm)
        on_line = np.rint(grid.indices_from_points(line.points_mm)).astype(int)
        towards = line.points_mm[int(np.argmin(depth[tuple(on_line.T)]))]
    return np.asarray(towards, dtype=np.float64)


def _tube_curve(line: Tree, tube: NDArray[np.bool_], mouth: FloatArray, grid: Grid) -> Curve:
    """A smooth centreline, 1 mm steps, as long as the tube.

    Thinning moves the line by up to half a voxel to and fro and stops short of the tube's ends: a cubic
    smoothing spline takes out the first, and straight ends up to the tube's own make up for the second.
    """
    points = path_from(line, mouth)
    points = np.vstack([_end_of_tube(points[0] - points[min(4, len(points) - 1)], points[0], tube, grid), points])
    points = np.vstack([points, _end_of_tube(points[-1] - points[max(-5, -len(points))], points[-1], tube, grid)])
    points = points[np.r_[True, np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-6]]
    if len(points) < 5:
        return Curve(points)
    tolerance = 0.4 * float(grid.spacing_mm.mean())
    spline, _ = splprep(points.T, s=len(points) * tolerance**2, k=3)
    length = Curve(points).length_mm
    return Curve(np.array(splev(np.linspace(0.0, 1.0, max(int(length), 8) + 1), spline)).T)


def _end_of_tube(outward: FloatArray, end: FloatArray, tube: NDArray[np.bool_], grid: Grid) -> FloatArray:
    """The last point (3,) inside the tube on the way from its line's end straight on."""
    steps = np.arange(0.0, 50.0, 0.25)[:, None] * outward / max(float(np.linalg.norm(outward)), 1e-12)
    values = ndimage.map_coordinates(tube.astype(np.float32), grid.indices_from_points(end + steps).T, order=1)
    outside = np.flatnonzero(values < 0.5)
    result: FloatArray = end + steps[max(int(outside[0]) - 1, 0) if len(outside) else -1]
    return result


def _arc_length_reached(curve: Curve, wire: NDArray[np.bool_], grid: Grid) -> float:
    """Arc length from the mouth to the innermost place that the wire reaches; the whole duct without one."""
    if not wire.any():
        return curve.length_mm
    points = grid.points_from_indices(np.argwhere(wire))
    nearest = np.linalg.norm(points[:, None, :] - curve.points_mm, axis=2).argmin(axis=1)
    return float(max(curve.arc_lengths_mm[nearest].max(), curve.arc_lengths_mm[1]))


def _grown(mask: NDArray[np.bool_], grid: Grid, distance_mm: float) -> NDArray[np.bool_]:
    """The mask and everything within a distance of it."""
    outside: NDArray[np.bool_] = distance_inside(~mask, grid.spacing_mm) <= distance_mm
    return outside
