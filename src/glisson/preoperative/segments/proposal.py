"""Landmarks proposed from the shape of both vein trees, for a person to look at and to move.

Branches are told by the direction in which they end, seen from the bifurcation (portal) or the confluence (hepatic), as
shares of the liver's extent: the segments 7 and 6 lie right and behind, 8 and 5 right and in front, 2 and 3 left, 7, 8
and 2 above, 5, 6 and 3 below. Fissures are proposed halfway between the branches of the segments on either side.
"""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.image import LabelMap
from glisson.core.landmarks import Landmarks
from glisson.core.structures import VesselTree
from glisson.preoperative.segments.landmarks import (
    BIFURCATION,
    CAUDATE_FRONT,
    CAUDATE_LEFT,
    CAUDATE_RIGHT,
    CAVA,
    CONFLUENCE,
    GALLBLADDER_FOSSA,
    LEFT_PORTAL,
    LEFT_VEIN,
    MIDDLE_VEIN,
    RIGHT_FISSURE,
    RIGHT_PORTAL,
    RIGHT_VEIN,
    UMBILICAL,
    UMBILICAL_FISSURE,
)

_RIGHT = {"P5": (-0.4, -0.5, -1.0), "P8": (-0.3, -0.8, 1.0), "P6": (-1.0, 0.5, -1.0), "P7": (-1.0, 0.4, 1.0)}
_LEFT = {"P2": (1.0, 0.0, 0.7), "P3": (1.0, -0.3, -0.7), "P4": (-0.5, -0.5, -1.0)}
_VEINS = {RIGHT_VEIN: (-1.0, 0.0, -0.5), MIDDLE_VEIN: (0.2, -0.3, -1.0), LEFT_VEIN: (1.0, -0.2, -0.5)}
_SIDE_SHARE = 0.15
"""A side of the bifurcation carries at least this share of the tree; less is a twig."""
_CAUDATE_SHARE = 0.09
"""Half of the caudate lobe's width over the liver's."""


def propose_landmarks(
    organ: LabelMap, portal: tuple[VesselTree, ...], hepatic: tuple[VesselTree, ...], cava: FloatArray | None = None
) -> Landmarks:
    """All landmarks; they are a first guess.

    Args:
        organ: the organ ("liver").
        portal: trees of the portal vein, the main one first, rooted where it enters.
        hepatic: trees of the hepatic veins, the main one first, rooted where they leave.
        cava: points (n, 3) in LPS mm of the vena cava, where it is known.

    Raises:
        BadInput: a tree is missing or has too few branches on a side.
    """
    if not portal or not hepatic:
        raise BadInput("Landmarks are proposed from portal and hepatic veins, and one is missing; give landmarks.")
    inside = organ.grid.points_from_indices(np.argwhere(organ.mask("liver")))
    extent = np.ptp(inside, axis=0)
    fork, root = _bifurcation(portal[0]), hepatic[0].points_mm[0]
    ends = np.concatenate([_ends(tree) for tree in portal])
    is_right = ends[:, 0] < fork[0]
    found = {BIFURCATION: fork, CONFLUENCE: root}
    found |= _extremes(ends[is_right], fork, extent, _RIGHT) | _extremes(ends[~is_right], fork, extent, _LEFT)
    found |= _extremes(np.concatenate([_ends(tree) for tree in hepatic]), root, extent, _VEINS)
    anterior, posterior = _mean(found, "P5", "P8"), _mean(found, "P6", "P7")
    lateral, medial = _mean(found, "P2", "P3"), found["P4"]
    found[RIGHT_FISSURE] = found[RIGHT_PORTAL] = 0.5 * (anterior + posterior)
    found[GALLBLADDER_FOSSA] = 0.5 * (anterior + medial)
    found[UMBILICAL_FISSURE], found[LEFT_PORTAL] = 0.5 * (medial + lateral), lateral
    left_middle = _mean(found, "P2", "P3", "P4")
    found[UMBILICAL] = portal[0].points_mm[np.linalg.norm(portal[0].points_mm - left_middle, axis=1).argmin()]
    found |= _caudate(inside, extent, fork, root, cava)
    return Landmarks({name: point[None] for name, point in found.items()})


def _bifurcation(tree: VesselTree) -> FloatArray:
    """Where the trunk first divides into two sides of some size."""
    children: dict[int, list[int]] = {}
    for parent, child in tree.edges.tolist():
        children.setdefault(parent, []).append(child)
    order = [0]
    for point in order:
        order.extend(children.get(point, []))
    size = np.ones(len(tree.points_mm))
    for point in reversed(order):
        size[point] += sum(size[child] for child in children.get(point, []))
    point = 0
    while own := sorted(children.get(point, []), key=lambda child: -size[child]):
        if len(own) > 1 and size[own[1]] >= _SIDE_SHARE * len(size):
            break
        point = own[0]
    fork: FloatArray = tree.points_mm[point]
    return fork


def _ends(tree: VesselTree) -> FloatArray:
    ends: FloatArray = tree.points_mm[np.setdiff1d(np.arange(len(tree.points_mm)), tree.edges[:, 0])]
    return ends


def _extremes(
    ends: FloatArray, origin: FloatArray, extent: FloatArray, directions: dict[str, tuple[float, float, float]]
) -> dict[str, FloatArray]:
    """For each name the end that lies farthest in its direction; no end is taken twice."""
    if len(ends) < len(directions):
        raise BadInput(f"The veins have too few branches to propose {', '.join(directions)}; give landmarks.")
    away, free, found = (ends - origin) / extent, np.ones(len(ends), dtype=bool), {}
    for name, direction in directions.items():
        number = int(np.where(free, away @ np.array(direction), -np.inf).argmax())
        free[number], found[name] = False, ends[number]
    return found


def _mean(found: dict[str, FloatArray], *names: str) -> FloatArray:
    mean: FloatArray = np.mean([found[name] for name in names], axis=0)
    return mean


def _caudate(
    inside: FloatArray, extent: FloatArray, fork: FloatArray, root: FloatArray, cava: FloatArray | None
) -> dict[str, FloatArray]:
    """The lobe about the vena cava, or about the liver's back where that is not known."""
    low, high = sorted((fork[2], root[2]))
    height, half = 0.5 * (low + high), np.array([_CAUDATE_SHARE * extent[0], 0.0, 0.0])
    if cava is not None:
        cava = cava[np.abs(cava[:, 2] - height) <= 0.5 * (high - low)]
    if cava is not None and len(cava) > 0:
        middle = cava.mean(axis=0)
    else:
        near = np.abs(inside - [root[0], 0.0, height])[:, [0, 2]].max(axis=1) < 10.0
        back = inside[near, 1].max() if near.any() else inside[:, 1].max()
        middle = np.array([root[0], back, height])
    front = np.array([middle[0], min(root[1], fork[1], middle[1] - 0.1 * extent[1]), height])
    return {CAVA: middle, CAUDATE_LEFT: middle + half, CAUDATE_RIGHT: middle - half, CAUDATE_FRONT: front}
