"""The posterior of a registration and where to touch next, against linear Gaussian models in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from blocks import block
from scipy.stats import chi2

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Deformation, StageResult
from glisson.core.errors import BadInput
from glisson.core.mesh import TetMesh
from glisson.core.model import Material, Model
from glisson.core.observations import Observation, Observations
from glisson.core.registered import Registered
from glisson.core.status import Status
from glisson.geometry.quadratic import straight_boundary
from glisson.mechanics.registration.drawing import DRAWN_MM
from glisson.mechanics.registration.fitting import Fit, fit
from glisson.mechanics.registration.motion import BasisMotion, MotionState
from glisson.mechanics.registration.next_touch import touches, viewer
from glisson.mechanics.registration.places import Places
from glisson.mechanics.registration.posterior import model_error_spread, posterior_spread, spread_by
from glisson.mechanics.registration.seen import ModelError, Seen


@pytest.fixture(scope="module")
def mesh() -> TetMesh:
    return block((4, 3, 2), (80.0, 60.0, 40.0))


def answer(mesh: TetMesh, spread_mm: FloatArray) -> Registered:
    """A registration that found nothing moved, with that spread."""
    stage = StageResult("registration", np.zeros(mesh.nodes.shape), Status.CONVERGED)
    return Registered(Deformation(mesh, (stage,), Status.CONVERGED, ""), "room", spread_mm)


def test_what_a_touch_takes_away_is_what_a_fit_with_it_has_less(mesh: TetMesh) -> None:
    """The whole normal equations again, with one more row: the drop of the tumour's trace, for every candidate."""
    rng = np.random.default_rng(4)
    moves = rng.normal(size=(*mesh.nodes.shape, 9))
    data = rng.normal(size=(20, 9))
    precision = data.T @ data + np.eye(9)
    found = answer(mesh, moves @ np.linalg.cholesky(np.linalg.inv(precision)))
    nodes, weights, sigma = np.array([3, 17, 30]), np.array([0.5, 0.2, 0.3]), 0.7
    offered = touches(found, nodes, weights, np.array([0.0, 0.0, 1.0]), sigma)
    assert (offered.normals[:, 2] > 0.1).all()
    tumour = np.einsum("a,aik->ik", weights, moves[nodes])
    before = np.trace(tumour @ np.linalg.inv(precision) @ tumour.T)
    assert offered.trace_mm2 == pytest.approx(before)
    triangles, _ = straight_boundary(mesh)
    middles = mesh.nodes[triangles].mean(axis=1)
    for number in range(0, len(offered.points_mm), 5):
        triangle = triangles[np.linalg.norm(middles - offered.points_mm[number], axis=1).argmin()]
        row = offered.normals[number] @ moves[triangle].mean(axis=0) / sigma
        after = np.trace(tumour @ np.linalg.inv(precision + np.outer(row, row)) @ tumour.T)
        assert offered.drops_mm2[number] == pytest.approx(before - after, rel=1e-9)
    assert offered.drops_mm2[offered.best] == offered.drops_mm2.max()
    assert offered.areas_mm2.sum() == pytest.approx(80.0 * 60.0)


def test_the_viewer_is_on_the_side_that_was_seen(mesh: TetMesh) -> None:
    top = mesh.nodes[mesh.nodes[:, 2] == mesh.nodes[:, 2].max()] + [0.0, 0.0, 0.3]
    inner = top[(np.abs(top[:, :2] - top[:, :2].mean(axis=0)) < [39.0, 29.0]).all(axis=1)]
    found = answer(mesh, np.zeros((*mesh.nodes.shape, 1)))
    seen = Observation("surface", "swab", inner, 1.0, "room")
    assert viewer(found, Observations((seen,))) == pytest.approx([0.0, 0.0, 1.0])
    assert viewer(found, Observations((replace(seen, kind="landmark"),))) is None


def test_regions_hold_what_they_should_where_the_model_is_true() -> None:
    """Linear and normal: regions of a level hold that share of the nodes."""
    rng = np.random.default_rng(2)
    modes, rows = 120, 90
    motion = BasisMotion(rng.normal(size=(40, 3)) * 50.0, rng.normal(size=(40, 3, modes)), np.eye(modes))
    prior = np.diag([0.0] * 6 + [1.0] * modes)
    squares = []
    for _ in range(80):
        truth = np.concatenate([np.zeros(6), rng.normal(size=modes)])
        design = rng.normal(size=(rows, 6 + modes))
        hessian = design.T @ design + prior
        solution = np.linalg.solve(hessian, design.T @ (design @ truth + rng.normal(size=rows)))
        state = MotionState(np.eye(3), np.zeros(3), solution[6:])
        found = Fit(state, np.zeros((0, 3)), None, np.ones(0), hessian, np.zeros(0), 0.0)  # no row is looked at
        spread = posterior_spread(motion, found, 1.0)
        off = motion.derivative(state, np.arange(40)) @ (solution - truth)
        covariance = spread @ spread.transpose(0, 2, 1)
        squares.append(np.einsum("ni,nij,nj->n", off, np.linalg.inv(covariance), off))
    for level in (0.5, 0.9, 0.95):
        assert (np.array(squares) < chi2.ppf(level, 3)).mean() == pytest.approx(level, abs=0.03)


@pytest.mark.parametrize("count", [20, 2000])
def test_a_curve_tells_how_it_runs_but_where_it_is_no_better_than_it_was_drawn(mesh: TetMesh, count: int) -> None:
    """However densely seen, a body on it is known across it to the curve's own shift; but it cannot turn."""
    model = Model(mesh, {0: Material("neo-hookean", 5.0, 0.45)}, {0: "liver"}, {"edge": np.flatnonzero(
        (mesh.nodes[:, 1] == mesh.nodes[:, 1].min()) & (mesh.nodes[:, 2] == mesh.nodes[:, 2].min()))})  # fmt: skip
    line = mesh.nodes[model.node_set("edge")]
    points = np.linspace(line[0], line[-1], count)
    seen = Seen(Places(model), Observations((Observation("curve", "edge", points, 0.1, "room"),)), ModelError(0.1, 1.0))
    motion = BasisMotion(mesh.nodes)
    found = fit(motion, seen, motion.at_rest())
    spread = spread_by(found.hessian, motion, found)
    ends = spread[[int(np.linalg.norm(mesh.nodes - end, axis=1).argmin()) for end in (line[0], line[-1])]]
    assert np.linalg.norm(ends[:, 1:], axis=2) == pytest.approx(DRAWN_MM, rel=0.05)
    assert np.linalg.norm((ends[1] - ends[0])[1:], axis=1).max() < 0.3


def test_what_is_no_covariance_is_refused() -> None:
    for wrong in (-np.eye(3), np.array([[1.0, 5.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])):
        with pytest.raises(BadInput, match="covariance"):
            Observation("surface", "front", np.zeros((1, 3)), 1.0, covariance_mm2=wrong[None])


def test_the_models_error_is_as_large_everywhere_and_alike_nearby(mesh: TetMesh) -> None:
    spread = model_error_spread(mesh, ModelError(2.0, 20.0))
    covariance = np.einsum("aik,bjk->abij", spread, spread)
    middle, near, far = (
        int(np.linalg.norm(mesh.nodes - place, axis=1).argmin()) for place in ([0, 0, 0], [0, 0, 20], [80, 60, 40])
    )
    np.testing.assert_allclose(
        covariance[np.arange(60), np.arange(60)], np.broadcast_to(4.0 * np.eye(3), (60, 3, 3)), atol=1e-9
    )
    assert covariance[middle, near, 0, 0] > 2.0
    assert covariance[middle, far, 0, 0] < 0.2
