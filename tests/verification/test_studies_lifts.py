"""The studies' lifts with the real solver, small: linear elements converge to quadratic ones, a drawn lift is sound."""

from pathlib import Path

import numpy as np
import pytest

from glisson.framework.pipeline import Unheard
from glisson.studies.lift_robustness.study import LiftRobustness
from glisson.studies.local_pool import LocalPool
from glisson.studies.point import Point
from glisson.studies.runner import run_points
from glisson.studies.sensitivity.choices import STIFF
from glisson.studies.sensitivity.tasks import LIFT, MESH, choice_inputs
from glisson.studies.store import PointStore
from glisson.studies.study import run_study


@pytest.fixture
def pool():
    made = LocalPool()
    yield made
    made.close()


def test_finer_linear_elements_come_nearer_to_quadratic_ones(tmp_path: Path, pool: LocalPool) -> None:
    """T4 locks and T10 does not: on a finer mesh T4's tumour is nearer to that of T10 on a coarse one."""
    store = PointStore(tmp_path / "points")
    store.prepare()
    meshes = {name: Point(MESH, {"phantom": "demo", "elements": n}) for name, n in (("few", 2000), ("more", 6000))}
    made = run_points(list(meshes.values()), store, pool)
    assert [m.values["elements"] for m in made.values()] == pytest.approx([2000, 6000], rel=0.06)

    def lift(mesh: str, element: str) -> Point:
        return Point(LIFT, choice_inputs(STIFF.choice(mesh), "demo", element, meshes[mesh].key))

    lifts = [lift("few", "T10"), lift("few", "T4"), lift("more", "T4")]
    done = run_points(lifts, store, pool)
    assert [outcome.message for outcome in done.values()] == ["The computation converged."] * 3
    quadratic, *linear = (np.array(outcome.values["centroid_mm"]) for outcome in done.values())
    few, more = (float(np.linalg.norm(centroid - quadratic)) for centroid in linear)
    assert more < 0.75 * few
    assert few < 3.0
    assert all(outcome.values["least_gap_mm"] > 0.0 for outcome in done.values())


def test_a_drawn_lift_is_sound(tmp_path: Path, pool: LocalPool) -> None:
    study = LiftRobustness(seed=12345, count=1, edge_length_mm=40.0)
    conclusion, _ = run_study(study, tmp_path, pool, Unheard(), quick=False)
    values = conclusion.values
    assert (values["cases"], values["converged"]) == (1, 1.0), values["failed"]
    assert (values["inverted"], values["penetrated"]) == (0, 0)
    # Contact acts at points inside the facets, so that a corner may reach into a tool by a little.
    assert values["node_gap_mm"] > -0.15
