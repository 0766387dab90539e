"""The nouns of Glisson: plain, frozen, validated types that the components exchange."""

from glisson.core.deformation import ContactReport, Deformation, Event, LoadStep, RodReport, StageResult
from glisson.core.errors import BadInput, GlissonError, StageFailed
from glisson.core.guidance import (
    CrossedVessel,
    Guidance,
    PlaneGuidance,
    TumourGuidance,
    VolumeGuidance,
    WireGuidance,
)
from glisson.core.image import Grid, LabelMap, Volume
from glisson.core.mesh import TetMesh, TriangleSurface
from glisson.core.model import Capsule, Material, Model, Rod
from glisson.core.observations import Observation, Observations
from glisson.core.scenario import ContactLaw, LeverDrive, Move, Scenario, Stage, ToolMotion
from glisson.core.status import Status
from glisson.core.structures import Curve, Plane, Structures, Tumour, VesselTree
from glisson.core.tools import Board, Cylinder, Lever, MeshTool, Slot
from glisson.core.transform import RigidTransform

__all__ = [
    "BadInput",
    "Board",
    "Capsule",
    "ContactLaw",
    "ContactReport",
    "CrossedVessel",
    "Curve",
    "Cylinder",
    "Deformation",
    "Event",
    "GlissonError",
    "Grid",
    "Guidance",
    "LabelMap",
    "Lever",
    "LeverDrive",
    "LoadStep",
    "Material",
    "MeshTool",
    "Model",
    "Move",
    "Observation",
    "Observations",
    "Plane",
    "PlaneGuidance",
    "RigidTransform",
    "Rod",
    "RodReport",
    "Scenario",
    "Slot",
    "Stage",
    "StageFailed",
    "StageResult",
    "Status",
    "Structures",
    "TetMesh",
    "ToolMotion",
    "TriangleSurface",
    "Tumour",
    "TumourGuidance",
    "VesselTree",
    "Volume",
    "VolumeGuidance",
    "WireGuidance",
]
