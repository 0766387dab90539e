"""Loads on the liver, drawn at random: part of its weight, the pull of a grasper, and a bar that presses on it.

A patch of 40 mm does not hold 18 N of liver of 6 kPa: under its whole weight the tip would hang down by hundreds of
millimetres. What acts is the part of the weight that its neighbours don't bear, a small share in any direction.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.model import Model
from glisson.core.tools import Cylinder
from glisson.mechanics.cylinder import CylinderTool
from glisson.mechanics.reduced.load import Load
from glisson.studies.reduced.liver import TIP

_WEIGHT = 0.02  # largest share of the weight
_REACH = 0.5  # of the organ's length from its tip, where graspers and bars get
_GRASP_MM = (12.0, 20.0)  # standard deviation of a grasper's pull over the surface
_PULL_MN = (15.0, 150.0)
_RADIUS_MM = (10.0, 15.0)
_DEPTH_MM = (4.0, 22.0)  # of a bar's tip under where the surface was
_CLEAR_MM = 2.0
_BESIDE_MM = 35.0  # a grasper's spread, and by which a bar may slide
_SLANT = 0.5  # tangent of the bar's angle to the surface's normal, standard deviation
_SHAFT_MM = 150.0


@dataclass(frozen=True, eq=False)
class Draw:
    """Draws loads for a model; `kinds` in turn are a grasper, a bar, and both."""

    model: Model

    def load(self, number: int, seed: int) -> Load:
        """Load number `number` (0, 1, …) of a seed."""
        random = np.random.default_rng((seed, number))
        weight = _direction(random) * _WEIGHT * random.uniform(0.0, 1.0)
        kind = number % 3
        nodes, forces = np.zeros(0, dtype=np.int64), np.zeros((0, 3))
        if kind != 1:
            nodes, forces = self._grasp(random)
        if kind == 0:
            return Load(weight, nodes, forces)
        tool, approach = self._bar(random)
        return Load(weight, nodes, forces, tool, approach)

    @property
    def reach(self) -> IntArray:
        """Surface nodes that a bar may touch and graspers pull."""
        mesh = self.model.mesh
        surface = np.unique(mesh.boundary()[0])
        away = np.linalg.norm(mesh.nodes[surface] - mesh.nodes[self.model.node_set(TIP)[0]], axis=1)
        found: IntArray = surface[away < _REACH * np.ptp(mesh.nodes, axis=0).max() + _BESIDE_MM]
        return found

    def _grasp(self, random: np.random.Generator) -> tuple[IntArray, FloatArray]:
        places, surface, _ = self._surface
        centre = places[random.integers(len(places))]
        spread = random.uniform(*_GRASP_MM)
        nodes_at = self.model.mesh.nodes[surface]
        shares = np.exp(-0.5 * np.sum((nodes_at - centre) ** 2, axis=1) / spread**2)
        near = shares > 0.01
        pull = _direction(random) * np.exp(random.uniform(*np.log(_PULL_MN)))
        return surface[near], (shares[near] / shares[near].sum())[:, None] * pull

    def _bar(self, random: np.random.Generator) -> tuple[CylinderTool, FloatArray]:
        """A bar, and the way by which it came from where it did not touch."""
        places, surface, normals = self._surface
        nodes = self.model.mesh.nodes[surface]
        while True:
            at = int(random.integers(len(places)))
            inward = -normals[at] + _SLANT * random.normal(size=3) / np.sqrt(2.0)
            inward /= np.linalg.norm(inward)
            radius, depth = random.uniform(*_RADIUS_MM), random.uniform(*_DEPTH_MM)
            end = places[at] + (depth - radius) * inward
            bar = CylinderTool(Cylinder("bar", end - _SHAFT_MM * inward, end, radius))
            approach = (depth + _CLEAR_MM) * inward
            if bar.distance(nodes + approach).min() > 0.0:
                return bar, approach

    @cached_property
    def _surface(self) -> tuple[FloatArray, IntArray, FloatArray]:
        """Places (f, 3) on the surface that tools reach, surface nodes (s,), and the places' outward normals (f, 3)."""
        mesh = self.model.mesh
        triangles, _ = mesh.boundary()
        corners = mesh.nodes[triangles]
        middles = corners.mean(axis=1)
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        tip = mesh.nodes[self.model.node_set(TIP)[0]]
        near = np.linalg.norm(middles - tip, axis=1) < _REACH * np.ptp(mesh.nodes, axis=0).max()
        return middles[near], np.unique(triangles), normals[near]


def _direction(random: np.random.Generator) -> FloatArray:
    vector = random.normal(size=3)
    unit: FloatArray = vector / np.linalg.norm(vector)
    return unit
