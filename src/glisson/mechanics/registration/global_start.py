"""Where the organ may be, without any guess: many starts of iterated closest points, of which the best go on.

The closest points are weighted by feature, as by Clements et al. 2008: each named part of the surface counts as much as
any other, however few points there are of it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from glisson.core.arrays import FloatArray
from glisson.core.observations import Observation, Observations
from glisson.geometry.rotations import nearest_rotation
from glisson.geometry.spreading import evenly_spread
from glisson.mechanics.registration.places import Places

_POINTS = 60
_WHOLE = 10
"""With so many points, a part counts as much as any other; a single touch does not."""

_PLACES = 24
_ROUNDS = ((1, 40.0, 400), (3, 30.0, 60), (20, 15.0, 20), (20, 6.0, 8))
"""Iterations, the scale in mm beyond which points count little (Geman and McClure), how many starts go on."""

_APART_MM = 3.0


@dataclass(frozen=True, eq=False)
class RigidStart:
    """x = R X + t takes the model to the observations; `cost_mm` is a mean distance, far points counting little."""

    rotation: FloatArray
    translation_mm: FloatArray
    cost_mm: float


@dataclass(frozen=True, eq=False)
class _Part:
    """Points (p, 3) that were seen, and those (m, 3) of the model to which they belong."""

    seen: FloatArray
    tree: KDTree
    weight: float


def rigid_starts(places: Places, observations: Observations) -> list[RigidStart]:
    """The best distinct places of the organ, the best first."""
    parts = [_part(item, places) for item in observations.items if len(item.points_mm)]
    middles = places.nodes[:: max(len(places.nodes) // 4000, 1)]
    rotations, shifts = _starts(parts)
    for iterations, scale, kept in _ROUNDS:
        for _ in range(iterations):
            rotations, shifts = _closer(parts, rotations, shifts, scale)
        costs = _costs(parts, rotations, shifts, scale)
        order = np.argsort(costs)[:kept]
        rotations, shifts, costs = rotations[order], shifts[order], costs[order]
    found: list[RigidStart] = []
    for rotation, shift, cost in zip(rotations, shifts, costs, strict=True):
        there = middles @ rotation.T + shift
        others = (middles @ other.rotation.T + other.translation_mm for other in found)
        if all(np.linalg.norm(there - other, axis=1).mean() > _APART_MM for other in others):
            found.append(RigidStart(rotation, shift, float(cost)))
    return found


def _part(item: Observation, places: Places) -> _Part:
    nodes = places.nodes
    seen = item.points_mm[evenly_spread(item.points_mm, _POINTS)]
    if item.kind == "landmark":
        model = places.landmark(item.name).at(nodes)
    elif item.kind == "curve":
        curve = places.curve(item.name)
        ends = curve.points.at(nodes)[curve.segments]
        shares = np.linspace(0.0, 1.0, 5)
        model = (ends[:, 0, None] + shares[:, None] * (ends[:, 1] - ends[:, 0])[:, None]).reshape(-1, 3)
    else:
        corners = nodes[places.surface(item.name)]
        model = np.concatenate([corners.mean(axis=1), corners.reshape(-1, 3)])
    return _Part(seen, KDTree(np.unique(model, axis=0)), 1.0 / max(len(seen), _WHOLE))


def _starts(parts: list[_Part]) -> tuple[FloatArray, FloatArray]:
    """Turns of the icosahedron, each with the middle of the largest part at places all over its surface."""
    largest = max(parts, key=lambda part: len(part.seen) * len(part.tree.data))
    turns = Rotation.create_group("I").as_matrix()
    goals = largest.tree.data[evenly_spread(largest.tree.data, _PLACES)]
    middle = largest.seen.mean(axis=0)
    rotations = np.repeat(turns, len(goals), axis=0)
    shifts = middle - np.einsum("sij,sj->si", rotations, np.tile(goals, (len(turns), 1)))
    return rotations, shifts


def _matched(parts: list[_Part], rotations: FloatArray, shifts: FloatArray) -> list[FloatArray]:
    """For each part the nearest points of the model (s, p, 3), in the model's frame."""
    found = []
    for part in parts:
        back = np.einsum("sji,spj->spi", rotations, part.seen[None] - shifts[:, None])
        _, nearest = part.tree.query(back, workers=2)
        found.append(part.tree.data[nearest])
    return found


def _shares(part: _Part, model: FloatArray, rotations: FloatArray, shifts: FloatArray) -> FloatArray:
    """Squared distance (s, p) of each point from its nearest point of the model, mm²."""
    there = np.einsum("sij,spj->spi", rotations, model) + shifts[:, None]
    squared: FloatArray = ((part.seen[None] - there) ** 2).sum(axis=2)
    return squared


def _costs(parts: list[_Part], rotations: FloatArray, shifts: FloatArray, scale: float) -> FloatArray:
    total = np.zeros(len(rotations))
    for part, model in zip(parts, _matched(parts, rotations, shifts), strict=True):
        squared = _shares(part, model, rotations, shifts)
        total += part.weight * (squared / (1.0 + squared / scale**2)).sum(axis=1)
    return np.sqrt(total / len(parts))


def _closer(
    parts: list[_Part], rotations: FloatArray, shifts: FloatArray, scale: float
) -> tuple[FloatArray, FloatArray]:
    """The rigid motions that bring each start nearest to its matches (Kabsch 1976)."""
    matched = _matched(parts, rotations, shifts)
    weights = [
        part.weight / (1.0 + _shares(part, model, rotations, shifts) / scale**2) ** 2
        for part, model in zip(parts, matched, strict=True)
    ]
    model, weight = np.concatenate(matched, axis=1), np.concatenate(weights, axis=1)[:, :, None]
    seen = np.concatenate([part.seen for part in parts])[None]
    whole = weight.sum(axis=1, keepdims=True)
    from_middle = (weight * model).sum(axis=1, keepdims=True) / whole
    to_middle = (weight * seen).sum(axis=1, keepdims=True) / whole
    turned = nearest_rotation(np.einsum("spi,spj->sij", weight * (seen - to_middle), model - from_middle))
    return turned, to_middle[:, 0] - np.einsum("sij,sj->si", turned, from_middle[:, 0])
