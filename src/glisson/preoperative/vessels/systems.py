"""Portal and hepatic veins of a mask: a label for each voxel, and trees from their roots."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from glisson.core.arrays import FloatArray
from glisson.core.image import Grid, LabelMap
from glisson.core.structures import VesselTree
from glisson.preoperative.vessels.centrelines import Tree, centred, smoothed
from glisson.preoperative.vessels.roots import Root, likely_roots
from glisson.preoperative.vessels.skeleton import FREE, Piece, skeleton_pieces
from glisson.preoperative.vessels.splitting import ROOT, Grown, split_pieces

SYSTEMS = ("portal", "hepatic")
"""The vessel systems that are told apart, in the order of their labels."""

UNTOLD = "vessels"
"""Label of what no system reaches."""

_SHORTEST_MM = 10.0
_CANDIDATES = 8


@dataclass(frozen=True, eq=False)
class VesselSystems:
    """What was told apart.

    `labels` holds the systems and, as "vessels", what none reaches; `trees` the rooted centrelines of each system, the
    one from the root first ("portal", "portal 2", …); `roots` where each starts; `notes` what a person should check.
    """

    labels: LabelMap
    trees: tuple[VesselTree, ...]
    roots: Mapping[str, Root]
    notes: tuple[str, ...]


def split_systems(vessels: NDArray[np.bool_], organ: LabelMap, clicks: Mapping[str, FloatArray]) -> VesselSystems:
    """A mask [i, j, k] of all vessels, split into systems.

    Args:
        vessels: the mask, on the organ's grid.
        organ: the organ ("liver").
        clicks: roots (k, 3) LPS mm by system; a system without one starts where it likely does.

    Raises:
        BadInput: a click lies far from all vessels.
    """
    pieces = skeleton_pieces(vessels, organ.grid)
    roots = likely_roots(dict.fromkeys(SYSTEMS, pieces), organ, clicks)
    grown = split_pieces(pieces, [roots[name].points_mm for name in SYSTEMS])
    voxels = _voxel_systems(vessels, organ.grid, pieces, grown)
    labels = LabelMap(voxels, organ.grid, _label_names(voxels))
    trees = _named_trees(pieces, grown, vessels, organ.grid)
    return VesselSystems(labels, trees, roots, (*_root_notes(roots), *_touching_notes(pieces, grown)))


def given_systems(given: LabelMap, organ: LabelMap, clicks: Mapping[str, FloatArray]) -> VesselSystems:
    """Systems that a label map tells apart already, with their trees.

    Args:
        given: has labels "portal" and "hepatic", on the organ's grid.
        organ: the organ ("liver").
        clicks: as in `split_systems`.

    Raises:
        BadInput: a click lies far from its system.
    """
    masks = {name: given.mask(name) for name in SYSTEMS}
    pieces = {name: skeleton_pieces(mask, given.grid) for name, mask in masks.items()}
    roots = likely_roots(pieces, organ, clicks)
    trees: list[VesselTree] = []
    voxels = np.zeros(given.grid.shape, dtype=np.uint8)
    for number, name in enumerate(SYSTEMS, start=1):
        voxels[masks[name]] = number
        grown = split_pieces(pieces[name], [roots[name].points_mm])
        own = {n: Grown(number - 1, step.parent, step.start) for n, step in grown.items()}
        trees += _named_trees(pieces[name], own, masks[name], given.grid)
    return VesselSystems(LabelMap(voxels, given.grid, _label_names(voxels)), tuple(trees), roots, _root_notes(roots))


def _label_names(voxels: NDArray[np.uint8]) -> dict[int, str]:
    names = dict(enumerate((*SYSTEMS, UNTOLD), start=1))
    return names if (voxels == len(names)).any() else {n: name for n, name in names.items() if name != UNTOLD}


def _root_notes(roots: Mapping[str, Root]) -> tuple[str, ...]:
    return tuple(
        f"where the {name} veins start is a guess, {root.doubt}; check it, and click it with --{name} X,Y,Z"
        for name, root in roots.items()
        if root.doubt
    )


def _touching_notes(pieces: Sequence[Piece], grown: Mapping[int, Grown]) -> tuple[str, ...]:
    """What to say where pieces of several systems meet: nothing but their course tells which is which there."""
    at_site: dict[int, set[int]] = defaultdict(set)
    for number, step in grown.items():
        for site in pieces[number].sites:
            at_site[site].add(step.system)
    count = sum(len(systems) > 1 for site, systems in at_site.items() if site != FREE)
    if not count:
        return ()
    return (
        f"portal and hepatic veins touch at {count} place{'' if count == 1 else 's'}, where their course alone tells "
        "which is which; check them, and click more branches with --portal and --hepatic X,Y,Z",
    )


def _voxel_systems(
    mask: NDArray[np.bool_], grid: Grid, pieces: Sequence[Piece], grown: Mapping[int, Grown]
) -> NDArray[np.uint8]:
    """Number of the system (from 1 on) to whose piece each voxel belongs, one more where no system reaches it.

    A voxel belongs to the piece whose wall it is nearest to, or in which it lies deepest.
    """
    voxels = np.zeros(grid.shape, dtype=np.uint8)
    untold = len(SYSTEMS) + 1
    if not pieces:
        voxels[mask] = untold
        return voxels
    points = np.concatenate([piece.points_mm for piece in pieces])
    radii = np.concatenate([piece.radii_mm for piece in pieces])
    system = np.concatenate([
        np.full(len(piece.points_mm), grown[n].system + 1 if n in grown else untold) for n, piece in enumerate(pieces)
    ])  # fmt: skip
    count = min(_CANDIDATES, len(points))
    apart, near = cKDTree(points).query(grid.points_from_indices(np.argwhere(mask)), count)
    apart, near = apart.reshape(-1, count), near.reshape(-1, count)
    best = near[np.arange(len(near)), (apart - radii[near]).argmin(axis=1)]
    voxels[mask] = system[best]
    return voxels


def _named_trees(
    pieces: Sequence[Piece], grown: Mapping[int, Grown], mask: NDArray[np.bool_], grid: Grid
) -> tuple[VesselTree, ...]:
    """The trees of all systems in the middle of the mask; short ones beside a system's first are left out."""
    found = _trees(pieces, grown)
    middle = centred([smoothed(tree) for _, tree in found], mask, grid)
    named: list[VesselTree] = []
    for number, name in enumerate(SYSTEMS):
        own = [tree for (system, _), tree in zip(found, middle, strict=True) if system == number]
        kept = [tree for n, tree in enumerate(own) if n == 0 or tree.length_mm >= _SHORTEST_MM]
        named += [
            VesselTree(name if n == 1 else f"{name} {n}", tree.points_mm, tree.radii_mm, tree.edges)
            for n, tree in enumerate(kept, start=1)
        ]
    return tuple(named)


def _trees(pieces: Sequence[Piece], grown: Mapping[int, Grown]) -> list[tuple[int, Tree]]:
    """System and tree of each piece that starts at a root and of all that come from it, in the order of growth."""
    first: dict[int, int] = {}
    for number, step in grown.items():
        first[number] = number if step.parent == ROOT else first[step.parent]
    trees = []
    for start in dict.fromkeys(first.values()):
        points: list[FloatArray] = []
        parents: list[int] = []
        place: dict[int, int] = {}
        for number in (n for n in grown if first[n] == start):
            step, piece = grown[number], pieces[number]
            way = piece.points_mm if step.start == 0 else piece.points_mm[::-1]
            stem = -1
            if step.parent != ROOT:
                before = np.array(points[place[step.parent] :][: len(pieces[step.parent].points_mm)])
                stem = place[step.parent] + int(np.linalg.norm(before - way[0], axis=1).argmin())
            place[number] = len(points)
            parents += [stem, *range(len(points), len(points) + len(way) - 1)]
            points += list(way)
        radii = np.concatenate([_in_order(pieces[n], grown[n].start) for n in grown if first[n] == start])
        if len(points) > 1:
            trees.append((grown[start].system, Tree(np.array(points), radii, np.array(parents, dtype=np.int64))))
    return trees


def _in_order(piece: Piece, start: int) -> FloatArray:
    return piece.radii_mm if start == 0 else piece.radii_mm[::-1]
