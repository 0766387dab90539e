"""What holds the organ: named sets of surface nodes, chosen by a box, by a direction or as one of the ligaments.

The liver is held at its back, by the coronary and triangular ligaments around the bare area and by the
inferior vena cava (dissertation, section 1.2 and stage 1 of section 4.3: "the back side of the liver");
the left lobe is free.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.errors import BadInput
from glisson.core.mesh import TetMesh
from glisson.core.parameters import parameter
from glisson.geometry.normals import vertex_normals
from glisson.preoperative.model.ligaments import LIGAMENTS

DIRECTIONS = {
    "left": (1.0, 0.0, 0.0),
    "right": (-1.0, 0.0, 0.0),
    "posterior": (0.0, 1.0, 0.0),
    "anterior": (0.0, -1.0, 0.0),
    "superior": (0.0, 0.0, 1.0),
    "inferior": (0.0, 0.0, -1.0),
}
"""Anatomical directions in LPS."""


def _stiffness() -> float | None:
    """The field of an attachment that says how much it gives way."""
    help_text = "Pull per area and displacement of a ligament that gives way (kPa/mm); none: held fast."
    stiffness: float | None = parameter(None, help_text, 1e-6, 1e6)
    return stiffness


@dataclass(frozen=True)
class BoxAttachment:
    """All surface nodes inside a box that is aligned with the patient's axes (LPS mm)."""

    low_mm: tuple[float, float, float]
    high_mm: tuple[float, float, float]
    name: str = parameter("back", "Name of the node set.")
    stiffness_kpa_mm: float | None = _stiffness()

    def __post_init__(self) -> None:
        if not all(low < high for low, high in zip(self.low_mm, self.high_mm, strict=True)):
            raise BadInput(
                f"The box of attachment {self.name!r} needs low_mm below high_mm in x, y and z, "
                f"not {list(self.low_mm)} and {list(self.high_mm)}."
            )

    def chosen(self, points_mm: FloatArray, normals: FloatArray) -> NDArray[np.bool_]:
        """Which surface points (n, 3) belong to the attachment, (n,); normals (n, 3) point outward."""
        inside: NDArray[np.bool_] = np.all((points_mm >= self.low_mm) & (points_mm <= self.high_mm), axis=1)
        return inside


@dataclass(frozen=True)
class DirectionAttachment:
    """The surface nodes that lie furthest along one anatomical direction or a mixture of some.

    Along each direction a point's place is measured as a fraction of the organ's extent; a mixture takes
    the mean of these fractions. `reach` of the range of that mean, from its far end, is taken.
    """

    name: str = parameter("back", "Name of the node set.")
    directions: tuple[str, ...] = parameter(
        ("posterior", "superior"), f"Where it lies: one or more of {', '.join(DIRECTIONS)}."
    )
    reach: float = parameter(0.3, "Fraction of the organ's extent along these directions that is held.", 0.001, 1.0)
    left_limit: float = parameter(
        0.55, "Only nodes up to this fraction of the organ's width, from its right side (1: all).", 0.0, 1.0
    )
    stiffness_kpa_mm: float | None = _stiffness()

    def __post_init__(self) -> None:
        unknown = [direction for direction in self.directions if direction not in DIRECTIONS]
        if unknown or not self.directions:
            raise BadInput(
                f"Attachment {self.name!r} needs directions among {list(DIRECTIONS)}, not {list(self.directions)}."
            )

    def chosen(self, points_mm: FloatArray, normals: FloatArray) -> NDArray[np.bool_]:
        """Which surface points (n, 3) belong to the attachment, (n,); normals (n, 3) point outward."""
        low, extent = points_mm.min(axis=0), np.maximum(np.ptp(points_mm, axis=0), 1e-9)
        fractions = (points_mm - low) / extent
        score = np.mean([_along(fractions, direction) for direction in self.directions], axis=0)
        far = score >= score.max() - self.reach * np.ptp(score)
        result: NDArray[np.bool_] = far & (fractions[:, 0] <= self.left_limit)
        return result


@dataclass(frozen=True)
class LigamentAttachment:
    """A ligament or great vessel where the organ's shape suggests it (`ligaments`)."""

    name: str = parameter("coronary", "Which one; also the name of the node set.", choices=tuple(LIGAMENTS))
    stiffness_kpa_mm: float | None = _stiffness()

    def chosen(self, points_mm: FloatArray, normals: FloatArray) -> NDArray[np.bool_]:
        """Which surface points (n, 3) belong to the attachment, (n,); normals (n, 3) point outward."""
        return LIGAMENTS[self.name].chosen(points_mm, normals)


Attachment = BoxAttachment | DirectionAttachment | LigamentAttachment

DEFAULT_ATTACHMENTS: tuple[Attachment, ...] = (DirectionAttachment(),)
"""The superior dorsal part of the surface, right and middle, as "back"."""

ATTACHMENT_KINDS: Mapping[str, type[Attachment]] = MappingProxyType(
    {"box": BoxAttachment, "direction": DirectionAttachment, "ligament": LigamentAttachment}
)
"""Value of `kind` → class."""


def node_sets(mesh: TetMesh, attachments: Sequence[Attachment]) -> dict[str, IntArray]:
    """Surface nodes of each attachment by its name; attachments of the same name are joined.

    Raises:
        BadInput: an attachment holds no node; the sentence says where the organ is.
    """
    triangles, _ = mesh.boundary()
    surface = np.unique(triangles)
    points = mesh.nodes[surface]
    normals = vertex_normals(points, np.searchsorted(surface, triangles))
    sets: dict[str, IntArray] = {}
    for attachment in attachments:
        nodes = surface[attachment.chosen(points, normals)]
        if len(nodes) < 3:
            raise BadInput(f"Attachment {attachment.name!r} holds {_count(len(nodes))}; the organ {_box(points)}.")
        sets[attachment.name] = np.union1d(sets.get(attachment.name, nodes), nodes)
    return sets


def ligaments(attachments: Sequence[Attachment]) -> dict[str, float]:
    """Stiffness in kPa/mm of each attachment that gives way, by its name.

    Raises:
        BadInput: attachments of one name differ in it.
    """
    stiffness = {attachment.name: attachment.stiffness_kpa_mm for attachment in attachments}
    for attachment in attachments:
        if attachment.stiffness_kpa_mm != stiffness[attachment.name]:
            raise BadInput(
                f"Attachments named {attachment.name!r} are one node set and need the same stiffness_kpa_mm; "
                "give them different names."
            )
    return {name: value for name, value in stiffness.items() if value is not None}


def _along(fractions: FloatArray, direction: str) -> FloatArray:
    unit = np.array(DIRECTIONS[direction])
    along: FloatArray = fractions @ unit
    return along if unit.sum() > 0.0 else along + 1.0


def _count(nodes: int) -> str:
    return "no node of the surface" if nodes == 0 else f"only {nodes} nodes of the surface, fewer than three"


def _box(points: FloatArray) -> str:
    ranges = zip("xyz", points.min(axis=0), points.max(axis=0), strict=True)
    return "lies in " + ", ".join(f"{axis} {low:.0f} to {high:.0f}" for axis, low, high in ranges) + " mm (LPS)"
