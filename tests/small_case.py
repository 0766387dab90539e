"""A small case that is made in a second: an ellipsoid for a liver with one tumour, a duct and a wire.

It serves the tests of the framework and the commands; anatomy and accuracy are tested elsewhere.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib import metadata
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from glisson.core import registry
from glisson.core.deformation import Deformation, StageResult
from glisson.core.image import Grid, LabelMap, Volume
from glisson.core.model import Model
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, silent
from glisson.core.scenario import Scenario
from glisson.core.status import Status
from glisson.framework.case import Case, new_case, open_case
from glisson.framework.importing import write_images
from glisson.framework.settings import Settings

GRID = Grid((64, 36, 44), [3.0, 3.0, 3.0], [-96.0, -54.0, -66.0])
RADII_MM = np.array([75.0, 36.0, 48.0])
TUMOUR_MM = np.array([30.0, 0.0, 6.0])


def images() -> tuple[Volume, dict[str, LabelMap]]:
    """The scan and its label groups."""
    indices = np.moveaxis(np.indices(GRID.shape), 0, -1).reshape(-1, 3)
    points = GRID.points_from_indices(indices)
    liver = (((points / RADII_MM) ** 2).sum(axis=1) < 1.0).reshape(GRID.shape)
    tumour = (np.linalg.norm(points - TUMOUR_MM, axis=1) < 12.0).reshape(GRID.shape)
    duct = ((np.abs(points[:, 1:] - [0.0, 6.0]) < 4.0).all(axis=1) & (np.abs(points[:, 0]) < 15.0)).reshape(GRID.shape)
    voxels = np.where(liver, 110.0, -60.0) - 50.0 * tumour
    voxels += np.random.default_rng(0).normal(0.0, 8.0, GRID.shape)
    organ = LabelMap(liver.astype(np.uint8), GRID, {1: "liver"})
    tumours = LabelMap(tumour.astype(np.uint8), GRID, {1: "tumour1"})
    structures = LabelMap(duct.astype(np.uint8), GRID, {1: "duct"})
    return Volume(voxels.astype(np.int16), GRID), {"organ": organ, "tumours": tumours, "structures": structures}


def small_settings() -> Settings:
    """Given labels, a coarse mesh, and the solver that the tests offer."""
    settings = Settings().choosing("segment", "labels", {}).choosing("surface", None, {"edge_length_mm": 10.0})
    return settings.choosing("mesh", None, {"edge_length_mm": 40.0, "envelope_mm": 0.8}).choosing(
        "simulate", "bending", {}
    )


def make_small_case(folder: Path, settings: Settings | None = None) -> Case:
    """The case at `folder`, with images and labels and nothing computed."""
    volume, groups = images()
    with new_case(folder, small_settings() if settings is None else settings) as making:
        write_images(making, volume, groups)
    return open_case(folder)


@dataclass(frozen=True)
class BendingParameters:
    lift_mm: float = parameter(20.0, "How far the left end moves.", 0.0, 100.0)
    outcome: str = parameter("converged", "How it ends.", choices=("converged", "singular", "interrupted", "crash"))


class Bending:
    """In the place of a solver: a shear that lifts the left end and lowers the right one; nothing is solved."""

    name: ClassVar[str] = "bending"
    summary: ClassVar[str] = "Lifts the left end; for tests."
    Parameters: ClassVar[type[Any]] = BendingParameters

    def __init__(self, parameters: BendingParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        return ()

    def solve(self, model: Model, scenario: Scenario, progress: Progress = silent) -> Deformation:
        progress(0.5, "bending")
        print("a library writes to stdout")
        if self._parameters.outcome == "interrupted":
            raise KeyboardInterrupt
        if self._parameters.outcome == "crash":
            raise RuntimeError("a slip of the programmer")
        nodes = model.mesh.nodes
        displacement = np.zeros_like(nodes)
        displacement[:, 1] = -self._parameters.lift_mm * nodes[:, 0] / RADII_MM[0]
        if self._parameters.outcome == "singular":
            return Deformation(model.mesh, (), Status.SINGULAR, "Nothing holds the liver along (1, 0, 0).")
        stages = tuple(
            StageResult(stage.name, displacement * (n + 1) / len(scenario.stages), Status.CONVERGED)
            for n, stage in enumerate(scenario.stages)
        )
        return Deformation(model.mesh, stages, Status.CONVERGED, "It bent.")


def offer_bending(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make the solver "bending" known in this process, as an installed package would."""
    point = EntryPoint("bending", f"{__name__}:Bending", "glisson.solvers")

    def offered(group: str) -> list[EntryPoint]:
        more = [point] if group == point.group else []
        return [*metadata.entry_points(group=group), *more]

    monkeypatch.setattr(registry, "entry_points", offered)


def with_parameters(settings: Settings, section: str, parameters: Mapping[str, Any]) -> Settings:
    """The settings with some parameters of a section's technique set."""
    return replace(settings).choosing(section, None, parameters)


def contents(folder: Path) -> dict[str, bytes]:
    """Every file of a folder with its bytes."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}
