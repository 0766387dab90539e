"""The study of the sparse-data twin: scores, tables, and a small design from end to end."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glisson.core import Deformation, Model, Observations, StageResult, Status
from glisson.core.registered import Registered
from glisson.framework.pipeline import Unheard
from glisson.geometry.location import PointLocator
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters
from glisson.phantom.proportions import draw_proportions
from glisson.phantom.sparse_data.case import SparseCase, bend_of, make_case
from glisson.phantom.sparse_data.design import FIRST_TUNING_MEMBER, Design
from glisson.phantom.sparse_data.liver import build_sparse_liver
from glisson.phantom.sparse_data.packing import draw_packing, packed
from glisson.studies.meshing import member_mesh
from glisson.studies.registration import scoring
from glisson.studies.registration.best_rigid import of_data, of_targets
from glisson.studies.registration.rows import Score, flat, scores, table_rows, totals
from glisson.studies.registration.scoring import BEST, BEST_OF_DATA, NOTHING, target_errors, timed_registration
from glisson.studies.registration.solving_model import make_model, model_point, read_model
from glisson.studies.registration.study import SparseDataTwin
from glisson.studies.registration.truths import with_its_skin
from glisson.studies.store import PointStore
from glisson.studies.study import run_study
from studies_in_process import InThisProcess

SMALL = Design(first_member=FIRST_TUNING_MEMBER, livers=1, packings=1, views=1, bends=1)


def bent_case(number: int = 0) -> SparseCase:
    designs = [case for case in Design(first_member=FIRST_TUNING_MEMBER).cases() if case.origin == "closed-form"]
    liver = build_sparse_liver(designs[number].member)
    return make_case(designs[number], liver, bend_of(designs[number], liver).forward)


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Model:
    folder = tmp_path_factory.mktemp("model")
    point = model_point(0, FIRST_TUNING_MEMBER)
    PointStore(folder).keep(point, make_model(point.inputs, folder))
    return read_model(folder, point.key)


@dataclass
class Knowing:
    """A registration that moves the nodes as it was told, whatever is seen."""

    carry: Any
    model: Any = None

    def prepare(self, model: Model) -> "Knowing":
        return Knowing(self.carry, model)

    def register(self, observations: Observations) -> Registered:
        mesh = self.model.mesh
        stage = StageResult("registration", self.carry(mesh.nodes) - mesh.nodes, Status.CONVERGED)
        found = Deformation(mesh, (stage,), Status.CONVERGED, "")
        return Registered(found, observations.frame, np.zeros((*mesh.nodes.shape, 1)))


def test_the_model_is_the_organ_with_a_contours_errors(model: Model) -> None:
    liver = build_sparse_liver(FIRST_TUNING_MEMBER)
    assert model.mesh.volume_mm3 == pytest.approx(liver.surface.volume_mm3, rel=0.02)
    assert (PointLocator(model.mesh).locate(liver.targets_mm).distance_mm == 0.0).all()
    assert set(model.structures.curves) == set(liver.features)
    for name, curve in model.structures.curves.items():
        off = np.linalg.norm(curve.points_mm - liver.features[name].points_mm, axis=1)
        assert 0.3 < np.median(off) < 6.0


def test_a_registration_that_knows_the_truth_is_off_by_its_mesh_only(model: Model) -> None:
    case = bent_case()
    bend = bend_of(case.design, build_sparse_liver(case.design.member))
    found, milliseconds = timed_registration(
        Knowing(lambda x: case.room_from_patient.apply(bend.forward(x))), model, case
    )
    assert target_errors(found, case).max() < 1.0
    assert milliseconds > 0.0


def test_a_registration_in_the_wrong_frame_is_not_taken_for_a_good_one(model: Model) -> None:
    case = bent_case()
    bend = bend_of(case.design, build_sparse_liver(case.design.member))
    found, _ = timed_registration(Knowing(bend.forward), model, case)
    assert target_errors(found, case).mean() > 50.0


def test_the_best_rigid_motions_bear_their_names() -> None:
    case = bent_case(2)
    liver = build_sparse_liver(case.design.member)
    best, by_data, nothing = (
        np.linalg.norm(motion.apply(case.targets_mm) - case.true_targets_mm, axis=1)
        for motion in (of_targets(case), of_data(case, liver), case.room_from_patient)
    )
    squares = [float((errors**2).mean()) for errors in (best, by_data, nothing)]
    assert squares[0] == min(squares)
    assert by_data.mean() < 8.0


def test_closest_points_find_an_organ_that_is_not_deformed() -> None:
    liver = build_sparse_liver(bent_case().design.member)
    for share, largest_mm in ((0.0, 0.1), (0.1, 0.5)):
        design = replace(bent_case().design, outlier_share=share)
        case = make_case(design, liver, lambda points: np.asarray(points))
        moved = of_data(case, liver).apply(case.targets_mm)
        assert np.linalg.norm(moved - case.true_targets_mm, axis=1).max() < largest_mm


def test_rows_pool_the_targets_of_their_cases() -> None:
    first, second, third = Design().cases()[0], Design().cases()[6], Design().cases()[1]
    assert (first.bin, first.noise_mm) == (second.bin, second.noise_mm)
    found = [
        Score("rigid", first, (1.0, 2.0, 3.0), 10.0, "converged"),
        Score("rigid", second, (4.0, 5.0, 9.0), 30.0, "ambiguous"),
        Score("rigid", third, (), None, None, "It failed."),
    ]
    one, two = table_rows(found)
    assert (one["technique"], one["set"], one["bin"], one["noise_mm"]) == ("rigid", "packed", "20-28", 0.0)
    assert one["tre_mm"] == {"mean": 4.0, "median": 3.5, "p95": pytest.approx(8.0)}
    assert one["milliseconds"] == {"median": 20.0, "p95": pytest.approx(29.0)}
    assert (one["cases"], one["failed"], one["flagged"], one["force_percent"]) == (2, 0, 1, None)
    assert (two["bin"], two["tre_mm"], two["milliseconds"], two["failed"]) == ("28-36", None, None, 1)
    assert flat([one])[0]["tre_p95_mm"] == pytest.approx(8.0)
    (whole,) = totals(found)
    assert whole["parts"]["all"] == {"mean": 4.0, "sd": pytest.approx(np.std([1, 2, 3, 4, 5, 9]))}
    assert whole["parts"]["closed-form"] is None


def test_packs_carry_the_underside_and_gravity_and_ligaments_the_rest() -> None:
    """By the answer's own nodes: each pack where it was put, tissue of the volume it had, the vena cava still."""
    member = FIRST_TUNING_MEMBER
    mesh, liver = member_mesh(draw_proportions(member), 30.0), build_sparse_liver(member)
    packing = draw_packing(0, member, 1)
    model, scenario = packed(packing, mesh, liver)
    assert len({material.young_modulus_kpa for material in model.materials.values()}) > 5
    found = QuasiStatic(QuasiStaticParameters()).solve(model, scenario)
    assert found.status is Status.CONVERGED
    for number, pack in enumerate(packing.packs):
        moved = found.displacement[model.node_set(f"pack {number}")]
        np.testing.assert_allclose(moved, np.broadcast_to(pack.displacement_mm, moved.shape), atol=1e-9)
    assert np.abs(found.displacement[model.node_set("vena cava")]).max() == 0.0
    carried = with_its_skin(found.mesh, found.displacement)(liver.surface.vertices)
    nodes = np.unique(found.mesh.boundary()[0])
    at_nodes = with_its_skin(found.mesh, found.displacement)(found.mesh.nodes[nodes])
    np.testing.assert_allclose(at_nodes, found.mesh.moved(found.displacement)[nodes], atol=1e-6)
    volume = replace(liver.surface, vertices=carried).volume_mm3
    assert volume == pytest.approx(liver.surface.volume_mm3, rel=0.03)
    assert draw_packing(0, member, 1) == packing
    assert draw_packing(1, member, 1) != packing


def test_a_small_design_from_end_to_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scoring, "make_technique", lambda *_: Knowing(lambda nodes: nodes))
    monkeypatch.setattr("glisson.studies.registration.truths.TRUTH_EDGE_MM", 30.0)
    study = SparseDataTwin(SMALL, ("blind",))
    conclusion, _ = run_study(study, tmp_path, InThisProcess(), Unheard(), False)
    values = conclusion.values
    assert (values["cases"], values["failed"], values["unfinished"]) == (2, [], 0)
    assert {row["technique"] for row in values["rows"]} == {NOTHING, BEST, BEST_OF_DATA, "blind"}
    means = {row["technique"]: row["tre_mm"]["mean"] for row in values["totals"]}
    assert means[BEST] < means[NOTHING] < means["blind"]
    assert "20-28" in conclusion.text
    for name in ("report.html", "rows.csv", "case-0.png", "case-1.png"):
        assert (tmp_path / name).stat().st_size > 100
    again, seconds = run_study(study, tmp_path, InThisProcess(), Unheard(), False)
    assert seconds == {"set-up": 0.0, "points": 0.0}
    assert again.values == values
    assert scores([]) == []
