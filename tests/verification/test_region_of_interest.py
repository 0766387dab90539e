"""The region of interest against the whole organ: a part feels what the whole does, and lifts end where they would."""

from dataclasses import replace

import numpy as np
import pytest
from lifts import BOARD, DOWN, WIDE, slab

from glisson.core import BadInput, Capsule, ContactLaw, Cylinder, Deformation, LeverDrive, Material, Scenario, Stage
from glisson.core.model import Model
from glisson.core.scenario import Move, ToolMotion
from glisson.core.status import Status
from glisson.geometry.boxes import box_mesh
from glisson.mechanics.cut_region import cut_out
from glisson.mechanics.loaded_body import loaded_body
from glisson.mechanics.quadratic_model import quadratic_model
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters
from glisson.mechanics.region_of_interest import RegionOfInterest, RegionOfInterestParameters
from glisson.verification.bodies import box_model

TWO_STAGES = (
    Stage("stage 1", ContactLaw(0.1, 10.0), (LeverDrive("lever", angle_deg=15.0),)),
    Stage("stage 2", ContactLaw(0.1)),
)
LIFT = Scenario((BOARD, WIDE), TWO_STAGES, DOWN, DOWN, ("board",))


def by_region(model: Model, scenario: Scenario, still_mm: float) -> Deformation:
    return RegionOfInterest(RegionOfInterestParameters(still_mm=still_mm)).solve(model, scenario)


def test_a_part_feels_the_forces_that_the_whole_does() -> None:
    """Inside, where the cut is not near, the forces of elements, tools, capsule, ligaments and gas are the same."""
    model = quadratic_model(slab(7.0))
    model = replace(model, capsule=Capsule(500.0, 0.1), ligaments={"back": 3.0})
    stage = Stage("stage 1", ContactLaw(0.3, 5.0), fixed=(), gas_pressure_kpa=1.2)
    scenario = Scenario((BOARD, WIDE), (stage,), DOWN, DOWN, ("board",))
    whole = loaded_body(model, scenario, QuasiStaticParameters(), 1e-8)
    whole.law, whole.gas.pressure_kpa, whole.contacts[1].angle = stage.contact, 1.2, 0.02
    rng = np.random.default_rng(3)
    positions = model.mesh.nodes + 0.05 * rng.normal(size=model.mesh.nodes.shape)
    whole.renew_cohesion(positions)
    whole.touches(positions)
    moved = positions + 0.05 * rng.normal(size=positions.shape)
    moving = model.mesh.nodes[model.mesh.corners][:, :, 0].mean(axis=1) > 50.0
    region = cut_out(whole, moving, moved)
    assert 0 < len(region.nodes) < len(positions)
    expected = whole.balance(moved, whole.touches(moved)).unbalanced[region.nodes]
    found = region.body.balance(moved[region.nodes], region.body.touches(moved[region.nodes])).unbalanced
    free = ~region.body.fixed
    assert free.any()
    np.testing.assert_allclose(found[free], expected[free], atol=1e-9 * np.abs(expected).max())
    assert region.cut.any()
    assert region.body.fixed[region.cut].all()


@pytest.mark.parametrize("still_mm", [3.0, 8.0])
def test_a_lift_ends_where_the_whole_organ_does(still_mm: float) -> None:
    """Places and the forces of the tools are those of the whole organ, and the estimate has the size of the error."""
    model = slab(7.0, (10, 4, 3))
    whole = QuasiStatic(QuasiStaticParameters()).solve(model, LIFT)
    found = by_region(model, LIFT, still_mm)
    assert (whole.status, found.status) == (Status.CONVERGED, Status.CONVERGED)
    farthest = np.linalg.norm(whole.displacement, axis=1).max()
    assert farthest > 15.0
    for stage, other in zip(whole.stages, found.stages, strict=True):
        apart = np.linalg.norm(stage.displacement - other.displacement, axis=1)
        assert np.median(apart) < 0.1
        assert apart.max() < 0.05 * farthest
        for contact, beside in zip(stage.contacts, other.contacts, strict=True):
            np.testing.assert_allclose(beside.force_n, contact.force_n, atol=0.05)
            assert beside.least_gap_mm > 0.0
    # The last of the record is the whole organ with the region in exact equilibrium.
    assert found.record[-1].residual <= QuasiStaticParameters().tolerance
    assert found.record[-1].energy_uj == pytest.approx(whole.record[-1].energy_uj, rel=0.01)
    true = np.linalg.norm(whole.displacement - found.displacement, axis=1)
    moved = np.linalg.norm(whole.displacement, axis=1) > still_mm
    assert 0.1 < found.estimated_error[moved].mean() / true[moved].mean() < 10.0


def test_where_all_moves_the_whole_organ_is_solved() -> None:
    model = slab(7.0, (6, 2, 2))
    whole = QuasiStatic(QuasiStaticParameters()).solve(model, LIFT)
    found = by_region(model, LIFT, 0.0)
    assert found.status is Status.CONVERGED
    # The unloaded shape is only a thousandth of the weight off.
    assert np.linalg.norm(found.displacement - whole.displacement, axis=1).max() < 0.05
    assert not found.estimated_error.any()


def test_a_stage_without_equilibrium_keeps_its_status() -> None:
    """Nothing holds the slab along x: the survey finds none, and the whole organ says what is free."""
    stages = tuple(replace(stage, fixed=()) for stage in TWO_STAGES)
    answers = [
        solver.solve(slab(7.0, (4, 2, 1)), replace(LIFT, stages=stages))
        for solver in (
            QuasiStatic(QuasiStaticParameters()),
            RegionOfInterest(RegionOfInterestParameters()),
        )
    ]
    assert answers[0].status is answers[1].status
    assert answers[0].message == answers[1].message


def test_bad_input_is_told_as_by_the_whole_organ() -> None:
    model = replace(slab(7.0, (4, 2, 1)), node_sets={})
    with pytest.raises(BadInput, match="no node set 'back'"):
        by_region(model, LIFT, 5.0)


def test_what_is_carried_takes_its_place_at_a_tool_that_moves_along() -> None:
    """A block is carried together with the jaw that lies against it: it only shifts, without any strain."""
    mesh = box_mesh(np.array([40.0, 30.0, 20.0]), (4, 3, 2))
    lower = np.flatnonzero(mesh.nodes[:, 2] < 11.0)
    model = box_model(mesh, Material("neo-hookean", 7.0, 0.45), lower=lower)
    jaw = Cylinder("jaw", np.array([20.0, -10.0, 25.05]), np.array([20.0, 40.0, 25.05]), 5.0)
    shift = (3.0, 0.0, 7.0)
    stage = Stage(
        "carry", ContactLaw(0.3), fixed=(), moves=(Move("lower", shift),), motions=(ToolMotion("jaw", shift),)
    )
    scenario = Scenario((jaw,), (stage,), rest_shape="as-scanned")
    for element in ("T4", "T10"):
        found = QuasiStatic(QuasiStaticParameters(element=element)).solve(model, scenario)
        assert found.status is Status.CONVERGED
        np.testing.assert_allclose(found.displacement, np.broadcast_to(shift, found.displacement.shape), atol=0.01)
        # First-order answers are exact here, so that no step needs more than a correction.
        assert max(step.iterations for step in found.record) <= 3
