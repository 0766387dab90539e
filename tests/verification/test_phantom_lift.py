"""The demo's manoeuvre on the phantom, coarsely meshed: it converges from stiff to soft tissue."""

from dataclasses import replace

import pytest

from glisson.core import Model, Scenario, Status
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters
from glisson.phantom.demo import demo_phantom
from glisson.preoperative.meshing.mmg import Mmg, MmgParameters
from glisson.preoperative.meshing.surface import MarchingCubes, MarchingCubesParameters
from glisson.preoperative.model.material_presets import HUMAN_LIVER
from glisson.preoperative.model.model_building import ModelSettings, build_model


@pytest.fixture(scope="module")
def phantom() -> tuple[Model, Scenario]:
    """Model, in about 2,000 quadratic elements, and manoeuvre of the demo's phantom."""
    made = demo_phantom((3.0, 3.0, 3.0))
    extractor = MarchingCubes(MarchingCubesParameters(edge_length_mm=6.0))
    mesher = Mmg(MmgParameters(edge_length_mm=40.0, envelope_mm=3.0))
    model, _ = build_model(made.organ, made.tumours, made.structures, extractor, mesher, ModelSettings())
    return model, made.scenario


@pytest.mark.parametrize("young_modulus_kpa", [700.0, 70.0, 12.0, 6.0, 3.0])
def test_the_lift_converges_from_stiff_to_soft(phantom: tuple[Model, Scenario], young_modulus_kpa: float) -> None:
    model, scenario = phantom
    settings = ModelSettings({"liver": replace(HUMAN_LIVER, young_modulus_kpa=young_modulus_kpa)})
    materials = {number: settings.material_of(name) for number, name in model.region_names.items()}
    answer = QuasiStatic(QuasiStaticParameters()).solve(replace(model, materials=materials), scenario)
    assert answer.status is Status.CONVERGED, answer.message
    assert [stage.name for stage in answer.stages] == ["stage 1", "stage 2"]
    for stage in answer.stages:
        assert all(report.least_gap_mm > 0.0 for report in stage.contacts if report.least_gap_mm is not None)
