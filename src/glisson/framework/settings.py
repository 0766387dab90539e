"""What a person decides about a case: techniques with their parameters, materials, attachments, target, plane.

There is no field for free text, so nothing here can identify a patient.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from types import MappingProxyType
from typing import Any

from glisson.core.errors import BadInput
from glisson.core.model import Capsule, Material, Rod
from glisson.core.parameters import build_parameters, parameter
from glisson.core.registry import technique_class
from glisson.preoperative.model.attachments import DEFAULT_ATTACHMENTS, Attachment
from glisson.preoperative.model.material_presets import HUMAN_LIVER
from glisson.preoperative.model.refinements import Refinement
from glisson.preoperative.model.regions import ORGAN
from glisson.preoperative.scenario.lever_placement import LeverLiftParameters

SCHEMA = 1
"""Version of the case folder that this Glisson writes, and the newest that it reads."""

KINDS = {
    "segment": "segmenter",
    "surface": "surface-extractor",
    "mesh": "mesher",
    "simulate": "solver",
    "vessels": "vessel-segmenter",
}
"""Section of `case.toml` → kind of the technique that is chosen there."""

TO_REPORT = ("segment", "surface", "mesh", "simulate")
"""Sections whose techniques the report needs."""

GIVEN_LABELS = "labels"
"""The segmenter that takes a label map that was given."""

Point = tuple[float, float, float]


@dataclass(frozen=True)
class TechniqueChoice:
    """A technique of a section by name, and those of its parameters that were set."""

    section: str
    technique: str
    parameters: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", MappingProxyType(dict(self.parameters)))

    @property
    def kind(self) -> str:
        """Kind of technique that the section takes."""
        return KINDS[self.section]

    def all_parameters(self, where: str, seed: int) -> Any:
        """The parameters with the technique's defaults, an instance of its `Parameters`.

        A technique that has a parameter named `seed` gets the case's, unless one was set for it.

        Raises:
            BadInput: the technique cannot be used, or a parameter does not fit it.
        """
        kind = self._class(where).Parameters
        seeded = {"seed": seed} if "seed" in {field.name for field in fields(kind)} else {}
        return build_parameters(kind, seeded | dict(self.parameters), f"{where}: {self.section} ({self.technique})")

    def make(self, where: str, seed: int) -> Any:
        """The technique, ready for work; raises as `all_parameters`."""
        return self._class(where)(self.all_parameters(where, seed))

    def _class(self, where: str) -> Any:
        try:
            return technique_class(self.kind, self.technique)
        except BadInput as error:
            raise BadInput(f"{where}: {self.section}.technique: {error}") from error


@dataclass(frozen=True)
class SegmentSettings:
    """What the segmentation starts from."""

    seed_points_mm: tuple[Point, ...] = parameter((), "Clicks inside the liver, a list of [x, y, z] in LPS mm.")


@dataclass(frozen=True)
class VesselSettings:
    """Where the vessel systems start."""

    portal_mm: tuple[Point, ...] = parameter(
        (), "Where portal veins enter the liver, a list of [x, y, z] in LPS mm; none: where they likely do."
    )
    hepatic_mm: tuple[Point, ...] = parameter(
        (), "Where hepatic veins leave the liver, a list of [x, y, z] in LPS mm; none: where they likely do."
    )


@dataclass(frozen=True)
class PlaneSettings:
    """Where the resection plane lies."""

    distance_mm: float = parameter(
        5.0, "Distance along the wire, inward, from the target's surface to the plane (mm).", 0.0, 100.0
    )
    points_mm: tuple[Point, Point, Point] | None = parameter(
        None, "Three points [x, y, z] (LPS mm) of the plane; needed where no wire lies in the duct."
    )


@dataclass(frozen=True)
class CapsuleSettings:
    """The organ's skin."""

    young_modulus_kpa: float | None = parameter(
        None, "Young's modulus of the capsule, an elastic membrane on the surface (kPa); none: no capsule.", 0.0, 1e6
    )
    thickness_mm: float = parameter(0.1, "Thickness of the capsule (mm).", 1e-3, 9.0)

    def made(self) -> Capsule | None:
        """The capsule; None where there is none."""
        return None if self.young_modulus_kpa is None else Capsule(self.young_modulus_kpa, self.thickness_mm)


@dataclass(frozen=True)
class RodSettings:
    """The wire or stent in the duct as a body with a stiffness of its own."""

    bending_stiffness_n_mm2: float | None = parameter(
        None, "Bending stiffness E I of the wire or stent (N·mm²); none: it follows the duct without resistance.", 0.0
    )
    axial_stiffness_n: float = parameter(100.0, "Axial stiffness E A (N).", 1e-6, 1e9)
    friction: float = parameter(0.0, "Coefficient of friction between rod and duct.", 0.0, 9.0)
    grip_n_mm: float = parameter(0.0, "Friction per length of a duct that hugs the rod (N/mm).", 0.0, 1e3)

    def made(self) -> Rod | None:
        """The rod; None where there is none."""
        if self.bending_stiffness_n_mm2 is None:
            return None
        return Rod(self.bending_stiffness_n_mm2, self.axial_stiffness_n, self.friction, self.grip_n_mm)


SECTIONS: Mapping[str, type[Any]] = MappingProxyType(
    {
        "segment": SegmentSettings,
        "capsule": CapsuleSettings,
        "rod": RodSettings,
        "plane": PlaneSettings,
        "scenario": LeverLiftParameters,
        "vessels": VesselSettings,
    }
)
"""Section of `case.toml` → dataclass of the keys that are ours there, beside those of a technique."""

DEFAULT_TECHNIQUES = MappingProxyType(
    {
        "segment": "seeded-contour",
        "surface": "marching-cubes",
        "mesh": "mmg",
        "simulate": "quasi-static",
        "vessels": "tubeness",
    }
)
"""Section of `case.toml` → technique that is used where none was chosen."""


@dataclass(frozen=True)
class Settings:
    """Everything that `case.toml` holds.

    `choices` has one technique for each section of `KINDS`; `materials` is by the name of the region
    ("liver", one tumour's name, or "tumours" for all others); `attachments` hold the organ; in
    `refinements` the mesh is finer; `target` is the tumour to remove (None: the largest one); `seed` is
    that of every random number.
    """

    choices: Mapping[str, TechniqueChoice] = field(default_factory=dict)
    materials: Mapping[str, Material] = field(default_factory=lambda: {ORGAN: HUMAN_LIVER})
    attachments: tuple[Attachment, ...] = DEFAULT_ATTACHMENTS
    refinements: tuple[Refinement, ...] = ()
    segment: SegmentSettings = field(default_factory=SegmentSettings)
    capsule: CapsuleSettings = field(default_factory=CapsuleSettings)
    rod: RodSettings = field(default_factory=RodSettings)
    plane: PlaneSettings = field(default_factory=PlaneSettings)
    scenario: LeverLiftParameters = field(default_factory=LeverLiftParameters)
    vessels: VesselSettings = field(default_factory=VesselSettings)
    target: str | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        unknown = sorted(set(self.choices) - set(KINDS))
        if unknown:
            raise BadInput(f"A case has no techniques for {unknown}; it has them for {sorted(KINDS)}.")
        choices = {name: self.choices.get(name, TechniqueChoice(name, DEFAULT_TECHNIQUES[name])) for name in KINDS}
        object.__setattr__(self, "choices", MappingProxyType(choices))
        object.__setattr__(self, "materials", MappingProxyType(dict(self.materials)))

    def choosing(self, section: str, technique: str | None, parameters: Mapping[str, Any]) -> "Settings":
        """These settings with another technique in a section, or with some of its parameters set anew.

        Parameters that were set for one technique are not carried over to another.
        """
        old = self.choices[section]
        name = old.technique if technique is None else technique
        kept = old.parameters if name == old.technique else {}
        choice = TechniqueChoice(section, name, {**kept, **parameters})
        return replace(self, choices={**self.choices, section: choice})
