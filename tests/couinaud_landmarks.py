"""Landmarks that a person would click in a phantom, and its segments by blood supply."""

import numpy as np
from scipy.spatial import cKDTree

from glisson.core.landmarks import Landmarks
from glisson.core.structures import VesselTree
from glisson.phantom import interior
from glisson.phantom.family import build_anatomy
from glisson.preoperative.vessels.centrelines import centreline_trees

_RIGHT, _LEFT = (8, 5, 7, 6), (2, 3, 4)
_VEINS = {"RHV": interior._RIGHT_VEIN, "MHV": interior._MIDDLE_VEIN, "LHV": interior._LEFT_VEIN}
_FISSURES = {"right fissure": "RHV", "gallbladder fossa": "MHV", "umbilical fissure": "LHV"}
_BRANCHES = dict(zip((*_RIGHT, *_LEFT), (*interior._RIGHT_BRANCHES, *interior._LEFT_BRANCHES), strict=True))


def portal_trees(phantom):
    """Centrelines of the portal vein's mask inside the liver, as a user has them."""
    mask = phantom.structures.mask("portal") & phantom.organ.mask("liver")
    found = centreline_trees(mask, phantom.organ.grid, 10.0)
    return tuple(
        VesselTree(f"portal {n}", tree.points_mm, tree.radii_mm, tree.edges) for n, tree in enumerate(found, start=1)
    )


def true_landmarks(phantom):
    """Name → point (3,): vessels from the construction, fissures and caudate where the segments meet the surface."""
    anatomy = build_anatomy(phantom.seed)
    place, planes = anatomy.proportions.place, anatomy.interior.planes
    found = {
        "portal bifurcation": place(interior._BIFURCATION),
        "hepatic confluence": place(interior._CONFLUENCE),
        "umbilical portion": place(interior._LEFT_PORTAL[-1]),
        "IVC": place([-13.0, -4.0, 16.0]),
    }
    found |= {f"P{number}": 0.5 * place(branch).sum(axis=0) for number, branch in _BRANCHES.items()}
    found |= {name: place(vein[-1]) for name, vein in _VEINS.items()}
    points = phantom.organ.grid.points_from_indices(np.argwhere(phantom.organ.mask("liver")))
    scissurae = (planes.right_scissura, planes.middle_scissura, planes.left_scissura)
    for (name, vein), plane in zip(_FISSURES.items(), scissurae, strict=True):
        on_it = points[np.abs(plane.distance_mm(points)) < 1.0]
        found[name] = on_it[_before_vein(on_it, found["hepatic confluence"], found[vein]).argmax()]
    for name, plane, side in (
        ("right portal plane", planes.right_portal, -1.0),
        ("left portal plane", planes.left_portal, 1.0),
    ):
        on_it = points[np.abs(plane.distance_mm(points)) < 1.0]
        found[name] = on_it[(side * on_it[:, 0]).argmax()]
    return found | _caudate(phantom)


def clicked(landmarks, random, rms_mm=2.5):
    """Landmarks with an isotropic error of each click."""
    errors = {name: rms_mm / np.sqrt(3.0) * random.normal(size=3) for name in landmarks}
    return Landmarks({name: (point + errors[name])[None] for name, point in landmarks.items()})


def supplied_segments(phantom):
    """Segments by the nearest branch of the phantom's exact tree, within each side of its middle plane."""
    anatomy, tree = build_anatomy(phantom.seed), phantom.exact.trees[0]
    place = anatomy.proportions.place
    parent = np.full(len(tree.points_mm), -1)
    parent[tree.edges[:, 1]] = tree.edges[:, 0]
    ways = {}
    for number, branch in _BRANCHES.items():  # from each main branch's end to the root
        way = [int(np.linalg.norm(tree.points_mm - place(branch[-1]), axis=1).argmin())]
        while way[-1] > 0:
            way.append(int(parent[way[-1]]))
        ways[number] = set(way)
    own = {number: way.difference(*(other for n, other in ways.items() if n != number)) for number, way in ways.items()}
    trunk = set().union(*ways.values()).difference(*own.values())
    numbers = np.zeros(len(parent), dtype=np.int64)
    for point in range(1, len(parent)):  # parents come before children
        if point not in trunk:
            numbers[point] = next((n for n, way in own.items() if point in way), numbers[parent[point]])
    mask = phantom.organ.mask("liver")
    points = phantom.organ.grid.points_from_indices(np.argwhere(mask))
    is_left, found = anatomy.interior.planes.middle_scissura.distance_mm(points) > 0.0, np.zeros(len(points), dtype=int)
    for side, own in ((is_left, _LEFT), (~is_left, _RIGHT)):
        branches = np.isin(numbers, own)
        _, nearest = cKDTree(tree.points_mm[branches]).query(points[side])
        found[side] = numbers[branches][nearest]
    found[phantom.couinaud.voxels[mask] == 1] = 1
    whole = np.zeros(mask.shape, dtype=np.uint8)
    whole[mask] = found
    return whole


def dice_of_segments(found, true):
    """Dice of the segments 1 to 8, (8,)."""
    return np.array(
        [2.0 * ((found == n) & (true == n)).sum() / ((found == n).sum() + (true == n).sum()) for n in range(1, 9)]
    )


def _before_vein(points, start, end):
    """How far points lie before the straight vein, beside its length."""
    along = (end - start) / np.linalg.norm(end - start)
    offset = (points - start) - ((points - start) @ along)[:, None] * along
    return np.where(offset[:, 1] < 0.0, np.linalg.norm(offset, axis=1), 0.0)


def _caudate(phantom):
    """The outermost points of segment 1, on its voxels' outer faces, but for its back."""
    points = phantom.couinaud.grid.points_from_indices(np.argwhere(phantom.couinaud.voxels == 1))
    half = 0.5 * phantom.couinaud.grid.spacing_mm
    return {
        "caudate left": points[points[:, 0].argmax()] + [half[0], 0.0, 0.0],
        "caudate right": points[points[:, 0].argmin()] - [half[0], 0.0, 0.0],
        "caudate front": points[points[:, 1].argmin()] - [0.0, half[1], 0.0],
        "caudate top": points[points[:, 2].argmax()] + [0.0, 0.0, half[2]],
        "caudate bottom": points[points[:, 2].argmin()] - [0.0, 0.0, half[2]],
    }
