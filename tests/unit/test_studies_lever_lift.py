"""The lever-lift twin: what is drawn and seen, how it is scored, and what the study says."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from blocks import sphere
from scipy.stats import chi2

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Deformation, StageResult
from glisson.core.model import Model
from glisson.core.registered import Registered
from glisson.core.status import Status
from glisson.geometry.distance import SurfaceTree
from glisson.geometry.quadratic import boundary_surface
from glisson.phantom.family import build_anatomy, scanned_structures
from glisson.phantom.lift_truths import LIFT_TRUTHS, UNSEEN_TRUTHS
from glisson.phantom.truth_checks import gap_to_lever
from glisson.studies.lever_lift.cases import FIRST_MEMBER, draw_case, lever_of, planned_scenario, true_scenario
from glisson.studies.lever_lift.observing import NOISE_MM, front, observe
from glisson.studies.lever_lift.planning import TISSUE
from glisson.studies.lever_lift.scoring import scores
from glisson.studies.lever_lift.study import LeverLift
from glisson.studies.lever_lift.truths import case_of
from glisson.studies.point import Outcome

TUNING_MEMBER = 600
KEYS = {
    "cases", "converged", "tumour_mm", "plane_deg", "removed_points", "surface_mm", "coverage90", "rigid_mm",
    "uncorrected_mm",
}  # fmt: skip


def test_plans_are_off_and_cases_are_the_same_again() -> None:
    case = draw_case(TUNING_MEMBER)
    assert case_of({"case": asdict(case)}) == case == draw_case(TUNING_MEMBER)
    assert 15.0 <= case.angle_deg <= 35.0
    true, planned = true_scenario(case), planned_scenario(case, 0.2)
    angles = [scenario.stages[0].drives[0].angle_deg for scenario in (true, planned)]
    assert angles[1] - angles[0] == pytest.approx(case.angle_off_deg)
    off = lever_of(planned).hinge_mm - lever_of(true).hinge_mm
    assert np.linalg.norm(off) == pytest.approx(np.linalg.norm(case.place_off_mm))


def test_truths_of_the_other_engine_are_of_unseen_livers_and_hard() -> None:
    assert len({truth.seed for truth in UNSEEN_TRUTHS}) == len(UNSEEN_TRUTHS) == 10
    for truth in UNSEEN_TRUTHS:
        assert truth.seed >= FIRST_MEMBER
        assert 15.0 <= truth.angle_deg <= 35.0


def test_only_what_faces_the_laparoscope_is_seen() -> None:
    middle, radius = np.array([10.0, -35.0, 5.0]), 30.0
    seen = front(sphere(middle, radius, 5))
    towards = np.array([15.0, -150.0, -90.0]) - seen
    outward = (seen - middle) / radius
    assert len(seen) > 50
    assert np.linalg.norm(seen - middle, axis=1) == pytest.approx(radius, abs=0.3)
    assert ((outward * towards).sum(axis=1) / np.linalg.norm(towards, axis=1)).min() > 0.2


@pytest.fixture(scope="module")
def lifted() -> tuple[Model, Deformation]:
    """A liver that CalculiX has lifted, and a model of it on the same mesh."""
    known = LIFT_TRUTHS[0]
    truth = known.read()
    structures = scanned_structures(build_anatomy(known.seed, truth.loading).interior, truth.loading)
    mesh = truth.deformation.mesh
    return Model(mesh, {0: TISSUE}, {0: "liver"}, {}, structures), truth.deformation


def told(truth: Deformation, off_mm: FloatArray, sigma_mm: float) -> Registered:
    """The truth, all of it off by the same, and how sure that is said to be."""
    places = StageResult("registration", truth.displacement + off_mm, Status.CONVERGED)
    spread = np.tile(sigma_mm * np.eye(3), (len(truth.mesh.nodes), 1, 1))
    return Registered(Deformation(truth.mesh, (places,), Status.CONVERGED, "As told."), "patient", spread)


def test_scores_of_what_is_off_by_as_much_as_is_known(lifted: tuple[Model, Deformation]) -> None:
    model, truth = lifted
    off = np.array([1.0, -2.0, 2.0])
    found = scores(told(truth, off, 1.0), model, truth)
    assert found["tumour_mm"] == pytest.approx(3.0, abs=1e-6)
    assert found["surface_errors_mm"] == pytest.approx([3.0] * len(found["surface_errors_mm"]), abs=1e-3)
    assert found["plane_deg"] == pytest.approx(0.0, abs=1e-4)
    assert found["removed_points"] == pytest.approx(0.0, abs=1e-3)
    assert found["radius90_mm"] == pytest.approx(np.sqrt(chi2.ppf(0.9, 3)))
    assert not found["covered90"]
    assert scores(told(truth, off, 1.3), model, truth)["covered90"]
    assert 15.0 < found["uncorrected_mm"] < 30.0
    assert 1.0 < found["rigid_mm"] < found["uncorrected_mm"]


def test_what_is_seen_lies_on_the_lifted_liver(lifted: tuple[Model, Deformation]) -> None:
    model, truth = lifted
    known = LIFT_TRUTHS[0]
    case = replace(draw_case(known.seed), angle_deg=known.angle_deg, placed_mm=(0.0, 0.0))
    items = {item.name: item for item in observe(case, truth, model.structures).items}
    assert set(items) == {"front", "wire", "lever"}
    surface = boundary_surface(truth.mesh, truth.mesh.moved(truth.displacement))
    far = SurfaceTree(surface.vertices, surface.triangles).nearest(items["front"].points_mm).distance_mm
    assert np.sqrt((far**2).mean()) == pytest.approx(NOISE_MM, abs=0.15)
    lever = lever_of(true_scenario(case))
    gaps = gap_to_lever(items["lever"].points_mm, lever, np.radians(known.angle_deg))
    assert len(gaps) >= 5
    assert np.abs(gaps).mean() < 2.0 * NOISE_MM


def test_the_study_says_all_that_it_has_to(lifted: tuple[Model, Deformation]) -> None:
    model, truth = lifted
    study = LeverLift(count=3, first_member=TUNING_MEMBER)
    prepared = {point.key: Outcome() for point in study.preparations()}
    points = study.points(prepared)
    values = scores(told(truth, np.array([0.0, 0.0, 0.5]), 1.0), model, truth)
    done = {points[0].key: Outcome(values), points[1].key: Outcome(status=Status.INVERTED, message="It turned over.")}
    conclusion = study.conclude(prepared, done)
    assert set(conclusion.values) >= KEYS
    assert conclusion.values["cases"] == 2
    assert conclusion.values["converged"] == 0.5
    assert conclusion.values["unfinished"] == 1
    assert conclusion.values["failed"] == [f"liver {TUNING_MEMBER + 1}: It turned over."]
    assert conclusion.values["surface_mm"]["p95"] == pytest.approx(0.5, abs=1e-3)
    assert conclusion.values["coverage90"] == 1.0
    assert "median 0.50" in conclusion.text
    assert set(conclusion.files) == {"rows.csv", "report.html"}
