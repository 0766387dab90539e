"""The sensitivity study with a solver that is a formula: points, rows, effects, charts, the command."""

import csv
import json
from collections.abc import Callable
from dataclasses import replace
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread

from glisson.cli import study as command
from glisson.core.deformation import Deformation, Event, StageResult
from glisson.core.errors import StageFailed
from glisson.core.mesh import TetMesh, TriangleSurface
from glisson.core.model import Model
from glisson.core.status import Status
from glisson.core.structures import Tumour
from glisson.preoperative.meshing.mmg import Mmg, MmgParameters
from glisson.studies import meshing
from glisson.studies.lifts import inside, rigidly_moved
from glisson.studies.point import Outcome
from glisson.studies.sensitivity import tasks
from glisson.studies.sensitivity.choices import LEVELS, SIZES, SOFT, STIFF, Choice, Tissue, all_together, one_at_a_time
from glisson.studies.sensitivity.rows import Truth, compared, effects
from glisson.studies.sensitivity.study import Sensitivity
from studies_in_process import InThisProcess

Glisson = Callable[..., tuple[int, dict[str, Any]]]


def lifted(phantom: str, model: Model, element: str, friction: float, cohesion_kpa: float) -> Deformation:
    """In the solver's place: the whole liver rises by 10 mm, and goes left by what the parameters say."""
    modulus = float(np.median([m.young_modulus_kpa for m in model.materials.values()]))
    liver = next(iter(model.materials.values()))
    if liver.law == "linear-elastic" and modulus < 100.0:
        return Deformation(model.mesh, (), Status.STAGNATED, "It did not reach equilibrium.")
    left = 3.0 * (liver.law == "linear-elastic") + friction + 0.1 * cohesion_kpa
    shift = np.tile([left, -10.0, 0.0], (len(model.mesh.nodes), 1))
    events = (Event("lost_contact", "lever", 20.0),) if friction == 0.5 else ()
    return Deformation(
        model.mesh, (StageResult("stage 1", shift, Status.CONVERGED),), Status.CONVERGED, "", events=events
    )


def coarsely_meshed(surface: TriangleSurface, elements: int) -> tuple[TetMesh, float]:
    """A mesh without a search for its size."""
    return Mmg(MmgParameters(edge_length_mm=40.0, envelope_mm=3.0)).mesh(surface), 40.0


@pytest.fixture
def tiny(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small meshes of a coarse scan, the formula for a solver, all in this process."""
    monkeypatch.setattr(tasks, "_lifted", lifted)
    monkeypatch.setattr(tasks, "_SCAN_MM", (6.0, 6.0, 6.0))
    monkeypatch.setattr(tasks, "mesh_of_size", coarsely_meshed)
    monkeypatch.setattr(command, "LocalPool", InThisProcess)
    made = Sensitivity({"coarse": 1500}, 2500, combined=False)
    monkeypatch.setattr(
        Sensitivity, "of", classmethod(lambda cls, quick, long, element: replace(made, element=element))
    )


def test_all_the_designs_combinations_are_there_once():
    choices = list(all_together(SIZES))
    assert len(choices) == len(set(choices)) == 3 * 2 * 2 * 3 * 2 * 2
    charted = {choice for tissue in (STIFF, SOFT) for choice in one_at_a_time(tissue, SIZES)}
    assert charted < set(choices)
    study = Sensitivity()
    prepared = {point.key: Outcome() for point in study.preparations()}
    points = study.points(prepared)
    assert len({point.key for point in points}) == len(points) == 144
    assert [point.inputs["choice"]["mesh"] for point in points[:14:7]] == ["coarse", "normal"]
    assert len(Sensitivity.of(False, True, "T10").points({p.key: Outcome() for p in _long().preparations()})) == 192


def _long() -> Sensitivity:
    return Sensitivity.of(False, True, "T10")


def test_a_row_is_the_distance_to_the_truth():
    base = STIFF.choice("coarse")
    lifts = [
        (base, 4500, Outcome({"centroid_mm": [3.0, 4.0, 0.0], "events": []}, seconds=2.0)),
        (replace(base, friction=0.5), 4500, Outcome({"centroid_mm": [0.0, 0.0, 2.0]})),
        (replace(base, friction=0.5, model="linear-elastic"), 4500, Outcome(status=Status.STAGNATED, message="No.")),
    ]
    truths = [
        Truth("calculix", SOFT, Outcome({"centroid_mm": [0.0, 0.0, 0.0]})),
        Truth("fine-t10", STIFF, Outcome(status=Status.SINGULAR, message="Nothing holds it.")),
    ]
    rows = compared(lifts, truths, "T10")
    assert [row["tumour_mm"] for row in rows] == [5.0, None, 2.0, None, None, None]
    assert [row["status"] for row in rows[::2]] == ["converged", "converged", "stagnated"]
    names = {"elements", "model", "truth", "tumour_mm", "status", "seconds", "element", *LEVELS}
    assert names <= set(rows[0])


def test_levels_are_compared_on_the_same_models():
    """Of an error that is a sum of contributions, each parameter's own is found, however uneven the design."""
    base = STIFF.choice("coarse")
    choices = [
        base,
        replace(base, friction=0.5),
        replace(base, model="linear-elastic"),
        replace(base, model="linear-elastic", young_modulus_kpa=7.0),
        *(replace(base, young_modulus_kpa=7.0, poisson_ratio=ratio) for ratio in (0.3, 0.45)),
    ]

    def outcome(choice: Choice) -> Outcome:
        if choice.poisson_ratio == 0.3:
            return Outcome(status=Status.STAGNATED, message="No.")
        error = 1.0 + (choice.friction == 0.5) + 2.0 * (choice.model != "neo-hookean")
        return Outcome({"centroid_mm": [error + 7.0 * (choice.young_modulus_kpa == 7.0), 0.0, 0.0]})

    truth = Truth("fine-t10", STIFF, Outcome({"centroid_mm": [0.0, 0.0, 0.0]}))
    rows = compared([(choice, 4500, outcome(choice)) for choice in choices], [truth], "T10")
    found = {(e["parameter"], e["level"]): (e["own_mm"], e["matched_mm"], e["matched"]) for e in effects(rows, [truth])}
    # Linear and neo-Hookean are matched at both moduli: 1 and 8 against 3 and 10.
    assert found["model", "neo-hookean"] == (1.0, 4.5, 2)
    assert found["model", "linear-elastic"] == (3.0, 6.5, 2)
    assert found["young_modulus_kpa", 700.0] == (1.0, 2.0, 2)
    assert found["young_modulus_kpa", 7.0] == (8.0, 9.0, 2)
    assert found["friction", 0.5] == (2.0, 2.0, 1)
    assert ("poisson_ratio", 0.3) not in found


def test_the_rigid_answer_is_exact_for_a_rigid_motion():
    mesh = TetMesh(np.vstack([np.zeros(3), 10.0 * np.eye(3)]), [[0, 1, 2, 3]])
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    moved = mesh.nodes @ turn.T + [1.0, 2.0, 3.0]
    stage = StageResult("stage 1", moved - mesh.nodes, Status.CONVERGED)
    deformation = Deformation(mesh, (stage,), Status.CONVERGED, "")
    np.testing.assert_allclose(rigidly_moved(deformation, np.array([1.0, 2.0, 3.0])), [-1.0, 3.0, 6.0], atol=1e-9)


@pytest.mark.parametrize("elements", [700, 4000])
def test_a_mesh_has_about_the_elements_that_are_wanted(elements):
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=4, radius=60.0)
    surface = TriangleSurface(ball.vertices, ball.faces)
    mesh, edge_mm = meshing.mesh_of_size(surface, elements)
    assert len(mesh.tetrahedra) == pytest.approx(elements, rel=0.06)
    assert 2.0 < edge_mm < 60.0
    assert mesh.volume_mm3 == pytest.approx(surface.volume_mm3, rel=0.01)


def test_a_tumour_contains_what_lies_inside_it():
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=4, radius=10.0)
    contains = inside(Tumour("t", TriangleSurface(ball.vertices, ball.faces)))
    points = np.random.default_rng(0).uniform(-12.0, 12.0, (40, 25, 3))
    radii = np.linalg.norm(points, axis=-1)
    clear = np.abs(radii - 10.0) > 0.1
    np.testing.assert_array_equal(contains(points)[clear], radii[clear] < 10.0)


def test_the_command_gives_rows_table_and_charts(tiny: None, glisson: Glisson, tmp_path: Path) -> None:
    code, said = glisson("study", "sensitivity", "--quick", "--out", tmp_path / "s")
    assert code == 0
    assert said["cases"] == 12
    assert said["unfinished"] == 0
    # The linear law is made to fail for soft tissue.
    assert said["converged"] == pytest.approx(11 / 12)
    assert len(said["rows"]) == 12 * 3
    assert {row["truth"] for row in said["rows"]} == {"calculix", "fine-t10"}
    truths = {(truth["truth"], truth["young_modulus_kpa"]): truth for truth in said["truths"]}
    assert truths["calculix", 7.0]["uncorrected_mm"] == pytest.approx(21.46, abs=0.05)
    # The twins move as a whole by (1.1, −10, 0): a rigid motion knows all of it.
    twin = truths["fine-t10", 700.0]
    assert twin["uncorrected_mm"] == pytest.approx(np.hypot(1.1, 10.0), abs=1e-6)
    assert twin["rigid_mm"] == pytest.approx(0.0, abs=1e-6)
    for row in said["rows"]:
        if row["truth"] == "fine-t10" and row["status"] == "converged":
            law = 3.0 * (row["model"] == "linear-elastic")
            expected = abs(law + row["friction"] + 0.1 * row["cohesion_kpa"] - 1.1)
            assert row["tumour_mm"] == pytest.approx(expected, abs=1e-6)
        if row["friction"] == 0.5:
            assert row["events"] == [{"kind": "lost_contact", "tool": "lever", "at_deg": 20.0}]
    table = list(csv.DictReader(StringIO((tmp_path / "s/rows.csv").read_text())))
    assert len(table) == len(said["rows"])
    charts = sorted((tmp_path / "s").glob("figure-*.png"))
    assert [chart.name[7:12] for chart in charts] == ["II-20", "II-21", "II-22", "II-23"]
    assert all(imread(BytesIO(chart.read_bytes())).shape[0] == 430 for chart in charts)
    stored = json.loads((tmp_path / "s/results.json").read_text())
    assert stored["rows"] == said["rows"]
    code, again = glisson("study", "sensitivity", "--quick", "--out", tmp_path / "s")
    assert again["rows"] == said["rows"]
    assert again["seconds"] == {"set-up": 0.0, "points": 0.0}


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["sensitivity", "--quick", "--long"], "not both"),
        (["sensitivity", "--workers", "0"], "--workers"),
        (["sensitivity", "--workers", "2", "--scheduler", "tcp://127.0.0.1:9"], "--workers"),
        (["lift-robustness", "--seed", "-1"], "--seed"),
        (["astrology"], "astrology"),
    ],
)
def test_wrong_usage_is_a_sentence(glisson: Glisson, tmp_path: Path, words: list[str], says: str) -> None:
    code, said = glisson("study", *words, "--out", tmp_path / "s")
    assert code == 2
    assert says in said["message"]
    assert said["rows"] is None


def test_a_mesh_that_fails_ends_the_study(tiny: None, glisson: Glisson, tmp_path: Path, monkeypatch) -> None:
    def fails(surface: TriangleSurface, elements: int) -> tuple[TetMesh, float]:
        raise StageFailed("Mmg crashed.", Status.STAGNATED)

    monkeypatch.setattr(tasks, "mesh_of_size", fails)
    code, said = glisson("study", "sensitivity", "--quick", "--out", tmp_path / "s")
    assert code == 1
    assert "coarse mesh could not be made" in said["message"]


def test_an_interrupted_study_says_what_is_kept(tiny: None, glisson: Glisson, tmp_path: Path, monkeypatch) -> None:
    done: list[int] = []

    def breaks(*given: Any) -> Deformation:
        done.append(1)
        if len(done) > 6:
            raise KeyboardInterrupt
        return lifted(*given)

    monkeypatch.setattr(tasks, "_lifted", breaks)
    code, said = glisson("study", "sensitivity", "--quick", "--out", tmp_path / "s")
    assert code == 130
    assert "4 of 12 points are done and kept" in said["message"]
    assert said["stage"] == "points"
    assert not list((tmp_path / "s").rglob(".*"))
    assert not (tmp_path / "s/results.json").exists()


def test_a_truth_has_parameters_of_its_own():
    assert Tissue(7.0).choice("fine") == Choice("fine", "neo-hookean", 7.0, 0.45, 0.1, 10.0)
