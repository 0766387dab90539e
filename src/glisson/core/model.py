"""The organ's mechanical model: mesh, materials, what holds it, and what is embedded in it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from glisson.core.arrays import IntArray, check_range, frozen_ints
from glisson.core.errors import BadInput
from glisson.core.mesh import TetMesh
from glisson.core.structures import Structures

_LARGEST_POISSON_RATIO = 0.499999
"""Beyond, the bulk modulus is more than 500,000 times the shear modulus, and answers drown in rounding."""


@dataclass(frozen=True)
class Material:
    """Elastic material of one region. `law` names a material technique (for example "neo-hookean").

    `constants` are what a law needs beside Young's modulus and Poisson's ratio, which hold for small strain.
    """

    law: str
    young_modulus_kpa: float
    poisson_ratio: float
    density_kg_m3: float = 1150.0
    constants: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "constants", tuple(self.constants))
        for number in (self.young_modulus_kpa, self.poisson_ratio, self.density_kg_m3, *self.constants):
            if isinstance(number, bool) or not isinstance(number, (int, float, np.integer, np.floating)):
                raise BadInput(f"A material is described by numbers, not by {number!r}.")
        if not np.isfinite(self.constants).all():
            raise BadInput(f"Constants of a material law must be finite numbers, not {list(self.constants)}.")
        if not self.young_modulus_kpa > 0.0 or not np.isfinite(self.young_modulus_kpa):
            raise BadInput(f"Young's modulus must be positive, not {self.young_modulus_kpa} kPa.")
        if not -1.0 < self.poisson_ratio <= _LARGEST_POISSON_RATIO:
            raise BadInput(
                f"Poisson's ratio must lie above -1 and below 0.5 (at most {_LARGEST_POISSON_RATIO}), not "
                f"{self.poisson_ratio}; for nearly incompressible tissue use 0.45 to 0.499."
            )
        if not 0.0 <= self.density_kg_m3 < 30_000.0:
            raise BadInput(f"Density must lie between 0 and 30000 kg/m³, not {self.density_kg_m3}.")

    @property
    def shear_modulus_kpa(self) -> float:
        """µ = E / (2 (1 + ν))."""
        return self.young_modulus_kpa / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def bulk_modulus_kpa(self) -> float:
        """κ = E / (3 (1 − 2ν))."""
        return self.young_modulus_kpa / (3.0 * (1.0 - 2.0 * self.poisson_ratio))

    @property
    def lame_lambda_kpa(self) -> float:
        """λ = κ − 2µ/3."""
        return self.bulk_modulus_kpa - 2.0 / 3.0 * self.shear_modulus_kpa


@dataclass(frozen=True)
class Capsule:
    """The organ's skin: an incompressible elastic membrane, free of stress in A."""

    young_modulus_kpa: float
    thickness_mm: float

    def __post_init__(self) -> None:
        if not (0.0 < self.young_modulus_kpa < np.inf and 0.0 < self.thickness_mm < 10.0):
            raise BadInput(
                "A capsule needs a positive Young's modulus and a thickness of up to 10 mm, not "
                f"{self.young_modulus_kpa} kPa and {self.thickness_mm} mm."
            )


@dataclass(frozen=True)
class Rod:
    """The wire or stent in the duct as an elastic rod that is held at the duct's mouth and slides inside.

    `friction` is Coulomb's coefficient; `grip_n_mm` is friction per length where the duct hugs the rod.
    """

    bending_stiffness_n_mm2: float
    axial_stiffness_n: float = 100.0
    friction: float = 0.0
    grip_n_mm: float = 0.0

    def __post_init__(self) -> None:
        stiff = 0.0 <= self.bending_stiffness_n_mm2 < np.inf and 0.0 < self.axial_stiffness_n < np.inf
        if not (stiff and 0.0 <= self.friction < 10.0 and 0.0 <= self.grip_n_mm < np.inf):
            raise BadInput(
                "A rod needs a bending stiffness of at least 0, a positive axial stiffness, a friction of 0 to 10 and "
                f"a grip of at least 0, not {self.bending_stiffness_n_mm2} N·mm², {self.axial_stiffness_n} N, "
                f"{self.friction} and {self.grip_n_mm} N/mm."
            )


@dataclass(frozen=True, eq=False)
class Model:
    """What the scan says of the organ, in its scanned shape A.

    `materials` maps region numbers of the mesh to materials, `region_names` to names for people,
    `node_sets` names to node numbers (attachments such as "back"). `ligaments` maps node sets to the stiffness in
    kPa/mm with which they are drawn back to where they are in A; node sets that are held fast belong to the stages.
    `rod` gives the wire in the duct a stiffness of its own. `ties` names node sets that stay where they lie in another
    part of the mesh, with which they share no nodes.
    """

    mesh: TetMesh
    materials: Mapping[int, Material]
    region_names: Mapping[int, str]
    node_sets: Mapping[str, IntArray]
    structures: Structures = field(default_factory=Structures)
    capsule: Capsule | None = None
    ligaments: Mapping[str, float] = field(default_factory=dict)
    rod: Rod | None = None
    ties: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        present = {int(n) for n in np.unique(self.mesh.region_numbers)}
        missing = present - set(self.materials)
        if missing:
            raise BadInput(f"Mesh regions {sorted(missing)} have no material.")
        sets = {}
        for name, nodes in self.node_sets.items():
            sets[name] = frozen_ints(nodes, (None,), f"node set {name}")
            check_range(sets[name], len(self.mesh.nodes), f"Node set {name}")
        object.__setattr__(self, "materials", MappingProxyType(dict(self.materials)))
        object.__setattr__(self, "region_names", MappingProxyType(dict(self.region_names)))
        object.__setattr__(self, "node_sets", MappingProxyType(sets))
        for name, stiffness in self.ligaments.items():
            self.node_set(name)
            if not 0.0 < stiffness < np.inf:
                raise BadInput(f"Ligament {name!r} needs a positive stiffness, not {stiffness} kPa/mm.")
        object.__setattr__(self, "ligaments", MappingProxyType(dict(self.ligaments)))
        for name in self.ties:
            self.node_set(name)
        if self.rod is not None and self.structures.duct is None:
            raise BadInput("A rod needs a duct to lie in; label the duct or the wire.")

    def node_set(self, name: str) -> IntArray:
        """Node numbers of a named set.

        Raises:
            BadInput: there is no such set.
        """
        if name not in self.node_sets:
            raise BadInput(f"The model has no node set {name!r}; it has {sorted(self.node_sets)}.")
        return self.node_sets[name]
