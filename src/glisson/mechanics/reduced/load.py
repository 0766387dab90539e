"""What is done to the organ at one instant: weight, forces on a few nodes, and a rigid tool."""

from dataclasses import dataclass, field, replace

import numpy as np

from glisson.core.arrays import FloatArray, IntArray, frozen_floats, frozen_ints
from glisson.core.errors import BadInput
from glisson.mechanics.tools import RigidTool


@dataclass(frozen=True, eq=False)
class Load:
    """One load; what it leaves out does not act.

    `weight` (3,) is the net weight in multiples of the organ's own (a unit vector: all of it, in that direction);
    `forces` (k, 3) in mN act on the nodes of the numbers `nodes` (k,). The `tool` presses without friction; it came
    by `approach` (3,) in mm from where it did not touch.
    """

    weight: FloatArray = field(default_factory=lambda: np.zeros(3))
    nodes: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    forces: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    tool: RigidTool | None = None
    approach: FloatArray = field(default_factory=lambda: np.zeros(3))
    withdrawn: float = 0.0
    """The share of its approach by which the tool is still away."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "weight", frozen_floats(self.weight, (3,), "weight"))
        object.__setattr__(self, "nodes", frozen_ints(self.nodes, (None,), "loaded nodes"))
        object.__setattr__(self, "forces", frozen_floats(self.forces, (None, 3), "forces on nodes"))
        object.__setattr__(self, "approach", frozen_floats(self.approach, (3,), "tool's approach"))
        if len(self.nodes) != len(self.forces):
            raise BadInput(f"There are {len(self.nodes)} loaded nodes, but {len(self.forces)} forces.")

    def part(self, share: float) -> "Load":
        """The load on its way: a share of its forces, and the tool at that share of its approach."""
        return replace(self, weight=share * self.weight, forces=share * self.forces, withdrawn=1.0 - share)
