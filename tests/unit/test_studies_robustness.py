"""The robustness study: what is drawn, how outcomes are counted, and the command with a formula for a solver."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from glisson.cli import study as command
from glisson.core.deformation import Deformation, Event, StageResult
from glisson.core.mesh import TetMesh
from glisson.core.model import Model
from glisson.core.scenario import Scenario
from glisson.core.status import Status
from glisson.core.tools import Lever
from glisson.phantom.proportions import draw_proportions
from glisson.phantom.truth_checks import inverted_elements
from glisson.studies.lift_robustness import tasks
from glisson.studies.lift_robustness.cases import FIRST_MEMBER, draw_case
from glisson.studies.lift_robustness.study import LiftRobustness
from glisson.studies.point import Outcome
from studies_in_process import InThisProcess

Glisson = Callable[..., tuple[int, dict[str, Any]]]


def test_cases_are_seeded_and_cover_their_ranges():
    cases = [draw_case(5, n) for n in range(400)]
    assert cases == [draw_case(5, n) for n in range(400)]
    assert cases[0] != draw_case(6, 0)
    assert len({case.member for case in cases}) == 400
    assert min(case.member for case in cases) >= FIRST_MEMBER
    for name, low, high in (
        ("angle_deg", 10.0, 35.0),
        ("young_modulus_kpa", 3.0, 700.0),
        ("poisson_ratio", 0.3, 0.499),
        ("friction", 0.0, 0.5),
    ):
        values = np.array([getattr(case, name) for case in cases])
        assert values.min() == pytest.approx(low)
        assert values.max() == pytest.approx(high)
        assert len(np.unique(values)) > 200
        at_end = np.isclose(values, low) | np.isclose(values, high)
        assert 0.15 < at_end.mean() < 0.35
    assert {case.cohesion_kpa for case in cases} == {0.0, 10.0}


def test_the_lever_is_where_the_case_says():
    case = draw_case(5, 1)
    proportions = draw_proportions(case.member)
    scenario = tasks.scenario_of(case, proportions)
    lever = scenario.tools[1]
    assert isinstance(lever, Lever)
    np.testing.assert_allclose(lever.hinge_mm, proportions.place([case.hinge_x_mm, 0.0, case.hinge_z_mm]))
    np.testing.assert_allclose(lever.up, [0.0, -1.0, 0.0], atol=1e-12)
    assert np.rad2deg(np.arctan2(lever.arm[2], lever.arm[0])) == pytest.approx(case.turn_deg)
    lift, settle = scenario.stages
    assert lift.drives[0].angle_deg == case.angle_deg
    assert (lift.contact.friction, settle.contact.friction) == (case.friction, case.friction)
    assert (lift.contact.cohesion_kpa, settle.contact.cohesion_kpa) == (case.cohesion_kpa, 0.0)


def test_inverted_elements_are_counted():
    linear = TetMesh(np.vstack([np.zeros(3), np.eye(3), [1.0, 1.0, 1.0]]), [[0, 1, 2, 3], [1, 2, 3, 4]])
    mesh = linear.as_quadratic()
    assert inverted_elements(mesh, mesh.nodes) == 0
    mirrored = mesh.nodes * [1.0, 1.0, -1.0]
    assert inverted_elements(mesh, mirrored) == 2
    pushed = np.array(mesh.nodes)
    # Only the element that has the origin is turned inside out by taking it, with its edges' middles, across.
    own = np.setdiff1d(mesh.tetrahedra[0], mesh.tetrahedra[1])
    pushed[own] += 2.0 * (1.0 / 3.0 - 0.0) * (4.0 - 3.0 * pushed[own].sum(axis=1, keepdims=True)) / 4.0 + 0.2
    assert inverted_elements(mesh, pushed) == 1


def outcome(number: int) -> Outcome:
    """Of ten: one stagnated, one crashed, two slipped off, one with an inverted element, one that penetrates.

    The last two are bad input: one lever never touched the liver, which is a failure; one would cut what is held.
    """
    values: dict[str, Any] = {"events": [], "inverted": 0, "least_gap_mm": 0.01, "node_gap_mm": -0.01, "iterations": 9}
    if number == 0:
        return Outcome({"events": []}, {}, Status.STAGNATED, "It did not reach equilibrium.")
    if number == 1:
        return Outcome({}, {}, None, "Its process ended with signal 9, probably for want of memory.")
    if number == 8:
        return Outcome({"load_steps": 9}, {}, Status.BAD_INPUT, "The lever never touched the organ.")
    if number == 9:
        return Outcome({"load_steps": 0}, {}, Status.BAD_INPUT, "The lever would cut into a part that is held fast.")
    if number in (2, 3):
        values["events"] = [{"kind": "lost_contact", "tool": "lever", "at_deg": 31.0}]
    if number == 4:
        values["inverted"] = 3
    if number == 5:
        values["least_gap_mm"] = -0.2
    return Outcome(values)


def test_outcomes_are_counted_as_they_are():
    study = LiftRobustness(seed=5, count=11)
    done = {point.key: outcome(number) for number, point in enumerate(study.points({})[:10])}
    found = study.conclude({}, done)
    values = found.values
    assert values["cases"] == 9
    assert values["unfinished"] == 1
    assert values["converged"] == 6 / 9
    assert ["would cut into" in row["message"] for row in values["impossible"]] == [True]
    assert values["slipped_off"] == 2
    assert values["inverted"] == 1
    assert values["penetrated"] == 1
    assert [row["status"] for row in values["failed"]] == ["stagnated", None, "bad_input"]
    assert {"member", "young_modulus_kpa", "events", "seconds", "iterations", "least_gap_mm"} <= set(values["rows"][0])
    assert "66.7 %" in found.text
    assert "would cut into" in found.text
    assert "signal 9" in found.text
    assert set(found.files) == {"rows.csv", "report.html"}
    assert b"not for clinical use" in found.files["report.html"]


class Formula:
    """In the solver's place: the liver rises as a whole, over the lever."""

    def __init__(self, parameters: Any) -> None:
        pass

    def solve(self, model: Model, scenario: Scenario) -> Deformation:
        mesh = model.mesh.as_quadratic()
        up = np.tile([0.0, -150.0, 0.0], (len(mesh.nodes), 1))
        stages = tuple(StageResult(stage.name, up, Status.CONVERGED) for stage in scenario.stages)
        event = Event("lost_contact", "lever", 12.0)
        return Deformation(mesh, stages, Status.CONVERGED, Status.CONVERGED.sentence, events=(event,))


def test_the_command_counts(glisson: Glisson, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(tasks, "QuasiStatic", Formula)
    monkeypatch.setattr(command, "LocalPool", InThisProcess)
    monkeypatch.setattr("glisson.studies.lift_robustness.study.QUICK_CASES", 2)
    code, said = glisson("study", "lift-robustness", "--quick", "--seed", "5", "--out", tmp_path / "s")
    assert code == 0, said["message"]
    assert (said["cases"], said["converged"], said["slipped_off"], said["failed"]) == (2, 1.0, 2, [])
    assert said["inverted"] == 0
    # 150 mm up, the tip of a lever at 35° is 86 mm high.
    assert said["node_gap_mm"] > 50.0
    assert said["rows"][0]["member"] == draw_case(5, 0).member
    assert (tmp_path / "s/report.html").is_file()


def test_an_option_of_another_study_is_refused(glisson: Glisson, tmp_path) -> None:
    code, said = glisson("study", "region", "--seed", "5", "--out", tmp_path / "s")
    assert (code, said["status"]) == (2, "bad_input")
    assert said["message"].startswith(
        "region has no --seed; that is for the study lever-lift, lift-robustness, contact, "
    )
    assert not (tmp_path / "s").exists()
