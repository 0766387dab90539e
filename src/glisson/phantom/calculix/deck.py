"""Input decks for CalculiX (`ccx`), the engine that makes truths independent of our own solver.

Units as everywhere inside: mm, kPa, mN, kg (so gravity is 9806.65 mm/s²). Numbers in a deck start at 1;
arrays given to this module start at 0, as all of ours do.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TetMesh
from glisson.core.model import Material
from glisson.core.units import STANDARD_GRAVITY_MM_S2, density_from_kg_m3

FACE_OPPOSITE_CORNER = np.array([3, 4, 2, 1])
"""CalculiX's number (S1 to S4) of the face of a tetrahedron that lies opposite corner 0 to 3."""


@dataclass(frozen=True)
class PenaltyContact:
    """CalculiX's face-to-face penalty contact: normal and tangential stiffness in kPa per mm."""

    normal_kpa_mm: float
    tangent_kpa_mm: float
    friction: float


@dataclass(frozen=True)
class Increments:
    """Automatic incrementation of a static step, as fractions of the step: first, smallest and largest."""

    first: float = 0.25
    smallest: float = 1e-4
    largest: float = 1.0
    limit: int = 200


class Deck:
    """A deck being written: first the model, then the steps, in CalculiX's own order of keywords."""

    def __init__(self, title: str) -> None:
        self._lines: list[str] = [f"** {line}" for line in title.splitlines()]
        self._nodes = 0
        self._elements = 0

    @property
    def text(self) -> str:
        """The deck so far."""
        return "\n".join(self._lines) + "\n"

    def add_nodes(self, places: FloatArray, name: str) -> IntArray:
        """Append nodes (n, 3) in mm as a node set; returns their numbers (n,) from 0."""
        numbers = self._nodes + np.arange(len(places))
        self._keyword("NODE", NSET=name)
        self._lines += [f"{n + 1},{x:.9g},{y:.9g},{z:.9g}" for n, (x, y, z) in zip(numbers, places, strict=True)]
        self._nodes += len(places)
        return numbers

    def add_elements(self, kind: str, nodes: IntArray, name: str) -> IntArray:
        """Append elements (m, k) of a kind such as "C3D10" as an element set; returns their numbers from 0."""
        numbers = self._elements + np.arange(len(nodes))
        self._keyword("ELEMENT", TYPE=kind, ELSET=name)
        self._lines += [",".join(map(str, [n + 1, *(row + 1)])) for n, row in zip(numbers, nodes, strict=True)]
        self._elements += len(nodes)
        return numbers

    def add_mesh(self, mesh: TetMesh, name: str) -> tuple[IntArray, IntArray]:
        """Append a mesh as C3D4 or C3D10; returns its node and element numbers in the deck."""
        nodes = self.add_nodes(mesh.nodes, f"N{name}")
        kind = "C3D10" if mesh.is_quadratic else "C3D4"
        return nodes, self.add_elements(kind, nodes[mesh.tetrahedra], f"E{name}")

    def node_set(self, name: str, nodes: Iterable[int]) -> None:
        """Name nodes."""
        self._keyword("NSET", NSET=name)
        self._numbers(nodes)

    def element_set(self, name: str, elements: Iterable[int]) -> None:
        """Name elements."""
        self._keyword("ELSET", ELSET=name)
        self._numbers(elements)

    def surface(self, name: str, elements: IntArray, faces: IntArray) -> None:
        """Name a surface of element faces; `faces` are CalculiX's own numbers from 1."""
        self._keyword("SURFACE", NAME=name, TYPE="ELEMENT")
        self._lines += [f"{element + 1},S{face}" for element, face in zip(elements, faces, strict=True)]

    def neo_hooke(self, name: str, elements: str, material: Material) -> None:
        """Give an element set the law C10 (Ī1 − 3) + (J − 1)² / D1, with C10 = µ/2 and D1 = 2/κ."""
        self._keyword("MATERIAL", NAME=name)
        self._keyword("HYPERELASTIC", "NEO HOOKE")
        self._lines.append(f"{material.shear_modulus_kpa / 2.0:.9g},{2.0 / material.bulk_modulus_kpa:.9g}")
        self._density_and_section(name, elements, material)

    def elastic(self, name: str, elements: str, material: Material) -> None:
        """Give an element set CalculiX's linear law."""
        self._keyword("MATERIAL", NAME=name)
        self._keyword("ELASTIC")
        self._lines.append(f"{material.young_modulus_kpa:.9g},{material.poisson_ratio:.9g}")
        self._density_and_section(name, elements, material)

    def contact(self, name: str, law: PenaltyContact, pairs: Sequence[tuple[str, str]]) -> None:
        """A contact law and the (slave, master) surfaces it holds between."""
        self._keyword("SURFACE INTERACTION", NAME=name)
        self._keyword("SURFACE BEHAVIOR", **{"PRESSURE-OVERCLOSURE": "LINEAR"})
        self._lines.append(f"{law.normal_kpa_mm:.9g}")
        self._keyword("FRICTION")
        self._lines.append(f"{law.friction:.9g},{law.tangent_kpa_mm:.9g}")
        for slave, master in pairs:
            self._keyword("CONTACT PAIR", INTERACTION=name, TYPE="SURFACE TO SURFACE")
            self._lines.append(f"{slave},{master}")

    def fix(self, node_set: str) -> None:
        """Hold a node set in place, before the first step."""
        self._keyword("BOUNDARY")
        self._lines.append(f"{node_set},1,3")

    def begin_step(self, increments: Increments) -> None:
        """Begin a static step with large deformations; it lasts one unit of time."""
        self._keyword("STEP", "NLGEOM", INC=increments.limit)
        self._keyword("STATIC")
        self._lines.append(f"{increments.first:.9g},1.,{increments.smallest:.9g},{increments.largest:.9g}")

    def residual(self, largest: float) -> None:
        """In a step: the largest residual force allowed, relative to the mean force (CalculiX takes 0.005)."""
        self._keyword("CONTROLS", PARAMETERS="FIELD")
        self._lines.append(f"{largest:.3g},{max(0.01, largest):.3g}")

    def gravity(self, elements: str, direction: FloatArray) -> None:
        """In a step: standard gravity along a unit direction (3,)."""
        self._keyword("DLOAD")
        x, y, z = direction
        self._lines.append(f"{elements},GRAV,{STANDARD_GRAVITY_MM_S2:.9g},{x:.9g},{y:.9g},{z:.9g}")

    def change_friction(self, name: str, law: PenaltyContact) -> None:
        """In a step: another coefficient of friction for a contact law."""
        self._keyword("CHANGE FRICTION", INTERACTION=name)
        self._keyword("FRICTION")
        self._lines.append(f"{law.friction:.9g},{law.tangent_kpa_mm:.9g}")

    def displace(self, nodes: IntArray, displacement: FloatArray) -> None:
        """In a step: take nodes (n,) to their total displacement (n, 3) in mm."""
        self._keyword("BOUNDARY")
        for node, vector in zip(nodes, displacement, strict=True):
            self._lines += [f"{node + 1},{axis},{axis},{value:.9g}" for axis, value in enumerate(vector, start=1)]

    def end_step(self, results: Sequence[str] = (), contact_results: bool = False) -> None:
        """End a step; `results` (such as "U", "RF") are written for all nodes at its end."""
        if results:
            self._keyword("NODE FILE", FREQUENCY=100000)
            self._lines.append(",".join(results))
        if contact_results:
            self._keyword("CONTACT FILE", FREQUENCY=100000)
            self._lines.append("CDIS,CSTR")
        self._keyword("END STEP")

    def raw(self, *lines: str) -> None:
        """Append lines as they are."""
        self._lines += lines

    def _density_and_section(self, name: str, elements: str, material: Material) -> None:
        self._keyword("DENSITY")
        self._lines.append(f"{density_from_kg_m3(material.density_kg_m3):.9g}")
        self._keyword("SOLID SECTION", ELSET=elements, MATERIAL=name)

    def _keyword(self, word: str, *flags: str, **options: object) -> None:
        self._lines.append(",".join([f"*{word}", *flags, *(f"{key}={value}" for key, value in options.items())]))

    def _numbers(self, numbers: Iterable[int]) -> None:
        listed = [str(int(n) + 1) for n in numbers]
        self._lines += [",".join(listed[start : start + 12]) for start in range(0, len(listed), 12)]
