"""The lever lift on a small slab of liver: convergence over stiffness and mesh, drives, misses, cuts."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from lifts import BOARD, DOWN, WIDE, lift, slab, slab_lever

from glisson.core import BadInput, ContactLaw, Lever, LeverDrive, Scenario, Stage, Status
from glisson.mechanics import loaded_body
from glisson.mechanics.bend import Bend
from glisson.mechanics.body import LoadState
from glisson.mechanics.contact_law import Cushion
from glisson.mechanics.load_path import LoadPath
from glisson.mechanics.newton import NewtonEnd
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters


@pytest.mark.parametrize("young_modulus_kpa", [700.0, 70.0, 12.0, 6.0, 3.0])
def test_the_lift_converges_from_stiff_to_soft(young_modulus_kpa: float) -> None:
    answer = lift(slab(young_modulus_kpa), LeverDrive("lever", angle_deg=20.0), WIDE)
    assert answer.status is Status.CONVERGED, answer.message
    assert all(step.residual <= 1e-6 for step in answer.record if step.status is Status.CONVERGED)
    for stage in answer.stages:
        for report in stage.contacts:
            assert report.least_gap_mm > 0.0
    # The slab above the middle of the lever rises by about the lever's own rise there.
    over = np.linalg.norm(answer.mesh.nodes - [100.0, 25.0, 0.0], axis=1).argmin()
    rise = answer.stages[0].displacement[over, 2]
    assert rise > 0.8 * 45.0 * np.tan(np.radians(20.0))


def test_force_and_angle_drives_agree() -> None:
    """The hinge moment at an angle, applied as a force on the lever's end, finds the angle again."""
    model = slab(7.0, (6, 2, 2))
    by_angle = lift(model, LeverDrive("lever", angle_deg=8.0), cohesion_kpa=0.0)
    report = next(r for r in by_angle.stages[0].contacts if r.tool == "lever")
    assert report.hinge_moment_nm is not None
    force = report.hinge_moment_nm / 0.070
    by_force = lift(model, LeverDrive("lever", force_n=force), cohesion_kpa=0.0)
    assert by_force.status is Status.CONVERGED
    found = next(r for r in by_force.stages[0].contacts if r.tool == "lever")
    assert found.hinge_moment_nm == pytest.approx(report.hinge_moment_nm, rel=2e-3)
    assert found.angle_deg == pytest.approx(8.0, abs=0.3)


def test_a_force_is_balanced_after_the_cushion_was_stiffened(monkeypatch: pytest.MonkeyPatch) -> None:
    """A cushion into which the lever would sink is stiffened on the way, which pushes more: the force still holds."""
    stiffened = []

    def stiffer(cushion: Cushion, factor: float) -> Cushion:
        stiffened.append(factor)
        return replace(cushion, stiffness_kpa_mm=cushion.stiffness_kpa_mm * factor)

    monkeypatch.setattr(loaded_body, "_CUSHION_STIFFNESS_KPA", 2.0)
    monkeypatch.setattr(loaded_body, "_CUSHION_STIFFNESS_MODULI", 0.1)
    monkeypatch.setattr(Cushion, "stiffened", stiffer)
    answer = lift(slab(7.0, (6, 2, 2)), LeverDrive("lever", force_n=0.47), cohesion_kpa=0.0)
    assert answer.status is Status.CONVERGED, answer.message
    assert stiffened
    _loads, *shares = [step.fraction for step in answer.record if step.stage == "stage 1"]
    assert shares == sorted(shares)
    lever = next(r for r in answer.stages[0].contacts if r.tool == "lever")
    assert lever.hinge_moment_nm == pytest.approx(0.47 * 0.070, rel=2e-3)
    assert lever.least_gap_mm > 0.0


def test_refinement_converges() -> None:
    """Three meshes: a material point's lift settles, each refinement changing it less."""
    lifts = []
    for counts in ((4, 2, 1), (8, 4, 2), (16, 6, 4)):
        answer = lift(slab(7.0, counts), LeverDrive("lever", angle_deg=10.0), WIDE, cohesion_kpa=0.0)
        assert answer.status is Status.CONVERGED
        point = np.linalg.norm(answer.mesh.nodes - [90.0, 25.0, 25.0], axis=1).argmin()
        lifts.append(answer.stages[-1].displacement[point])
    first, second = (np.linalg.norm(b - a) for a, b in pairwise(lifts))
    assert second < 0.5 * first
    assert second < 0.05


def test_an_organ_that_flows_ends_where_it_would_have_gone_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without friction the way does not matter: the flow against a fading drag finds the same equilibrium."""
    stages = (
        Stage("stage 1", ContactLaw(0.0, 10.0), (LeverDrive("lever", angle_deg=12.0),)),
        Stage("stage 2", ContactLaw(0.0, 0.0)),
    )
    scenario = Scenario((BOARD, WIDE), stages, DOWN, DOWN, ("board",))
    solver = QuasiStatic(QuasiStaticParameters())
    at_once = solver.solve(slab(7.0, (6, 2, 2)), scenario)
    load_step, flowed = LoadPath.load_step, []

    def failing(path: LoadPath, goal: LoadState, bend: Bend | None = None) -> NewtonEnd:
        if goal.tools.law.cohesion_kpa == 0.0 < path.body.law.cohesion_kpa:
            flowed.append(goal)
            return NewtonEnd(path.positions, Status.ITERATION_LIMIT, 0, 1.0)
        return load_step(path, goal, bend)

    monkeypatch.setattr(LoadPath, "load_step", failing)
    slowly = solver.solve(slab(7.0, (6, 2, 2)), scenario)
    assert flowed
    assert slowly.status is Status.CONVERGED
    moved = np.linalg.norm(at_once.stages[1].displacement - at_once.stages[0].displacement, axis=1).max()
    assert moved > 0.5
    difference = np.linalg.norm(slowly.displacement - at_once.displacement, axis=1).max()
    assert difference < 1e-3 * moved


def test_both_readings_of_the_second_stage_run() -> None:
    """The dissertation does not say what changes when the organ settles: its friction, or its weight that sets in.

    Both settle on the lever, whose hinge then bears more of the weight in the second reading; the first moves only by
    slipping, so the lifted part does not rise again.
    """
    lift_to = LeverDrive("lever", angle_deg=10.0)
    sticky, plain = ContactLaw(0.1, 10.0), ContactLaw(0.1)
    readings = {
        "friction": (Stage("lift", sticky, (lift_to,)), Stage("settle", plain)),
        "gravity": (Stage("lift", sticky, (lift_to,), gravity=False), Stage("settle", sticky)),
    }
    moments, sinking = {}, {}
    for name, stages in readings.items():
        scenario = Scenario((BOARD, WIDE), stages, DOWN, DOWN, ("board",))
        answer = QuasiStatic(QuasiStaticParameters(element="T4")).solve(slab(7.0), scenario)
        assert answer.status is Status.CONVERGED, answer.message
        reports = [next(r for r in stage.contacts if r.tool == "lever") for stage in answer.stages]
        moments[name] = [report.hinge_moment_nm for report in reports]
        end = np.linalg.norm(answer.mesh.nodes - [120.0, 25.0, 25.0], axis=1).argmin()
        sinking[name] = answer.stages[0].displacement[end, 2] - answer.stages[1].displacement[end, 2]
    assert moments["gravity"][1] > 1.5 * moments["gravity"][0]
    assert moments["friction"][1] == pytest.approx(moments["friction"][0], rel=0.2)
    assert sinking["gravity"] > 0.5
    assert sinking["friction"] > -1e-3


def test_a_lever_that_misses_is_told() -> None:
    lever = Lever.lifting("lever", np.array([200.0, 20.0, 0.0]), np.array([1.0, 0, 0]), -DOWN)
    answer = lift(slab(7.0, (6, 2, 2)), LeverDrive("lever", angle_deg=10.0), lever)
    assert answer.status is Status.BAD_INPUT
    assert "never touched the organ" in answer.message


def test_a_lever_inside_the_organ_is_refused() -> None:
    with pytest.raises(BadInput, match=r"cuts .* mm into the organ"):
        lift(slab(7.0, (6, 2, 2)), LeverDrive("lever", angle_deg=10.0), slab_lever(height=10.0))


def test_an_unknown_attachment_is_refused() -> None:
    stages = (Stage("stage 1", ContactLaw(), fixed=("front",)),)
    with pytest.raises(BadInput, match=r"no node set 'front'"):
        QuasiStatic(QuasiStaticParameters()).solve(slab(7.0, (2, 1, 1)), Scenario((BOARD,), stages, DOWN, DOWN))
