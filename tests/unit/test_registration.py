"""Registration against closed forms, finite differences, invariants, and what must be refused."""

from dataclasses import replace

import numpy as np
import pytest
from blocks import bent
from lumps import lump_model, registered, seen_surface
from scipy.spatial.transform import Rotation

from glisson.core import BadInput
from glisson.core.arrays import FloatArray
from glisson.core.model import Model
from glisson.core.observations import Observation, Observations
from glisson.core.status import Status
from glisson.geometry.location import PointLocator
from glisson.geometry.spreading import evenly_spread
from glisson.mechanics.registration.basis import boundary_responses
from glisson.mechanics.registration.fitting import _at
from glisson.mechanics.registration.full_fit import FullFit
from glisson.mechanics.registration.kelvinlets import kelvinlets
from glisson.mechanics.registration.motion import BasisMotion, MotionState
from glisson.mechanics.registration.places import Places
from glisson.mechanics.registration.seen import ModelError, Seen
from glisson.phantom.sparse_data.closed_form import Bend, Frame

TECHNIQUES = ("rigid", "kelvinlets", "linear-basis", "tractions", "free")


@pytest.fixture(scope="module")
def model() -> Model:
    return lump_model()


def pose(seed: int) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    return Rotation.random(random_state=seed).as_matrix(), rng.normal(size=3) * 200.0


def test_derivatives_of_the_cost_are_those_of_differences(model: Model) -> None:
    """The gradient, points matched anew at each place: an error of second order, for every way of moving."""
    rng = np.random.default_rng(3)
    modes = boundary_responses(model, 12)
    motion = BasisMotion(model.mesh.nodes, modes.basis, np.diag(modes.energies_uj))
    duct = model.structures.duct
    assert duct is not None
    items = (
        replace(seen_surface(model, bent(model.mesh.nodes, 300.0), rng, 2.0), frame="patient"),
        Observation("landmark", "tip", model.mesh.nodes[model.node_set("tip")].mean(axis=0)[None] + 3.0, 1.0),
        Observation("curve", "wire", duct.points_mm[2:9] + [0.0, 2.0, 1.0], 1.0),
    )
    seen = Seen(Places(model), Observations(items), ModelError(0.5, 1e-6))
    state = motion.moved(motion.at_rest(), 0.8 * rng.normal(size=motion.size))
    full = FullFit(model, seen, 50.0)
    cut = np.full(len(seen.item), 9.0)
    drawn = rng.normal(size=(1, 3))
    here, step = _at(motion, seen, state, drawn, cut), rng.normal(size=motion.size + 3)
    everywhere, push = full._at(motion.positions(state), drawn, cut), rng.normal(size=(len(model.mesh.nodes) + 1, 3))
    slopes = float(here.gradient @ step), float((full._gradient(everywhere) * push).sum())
    errors = []
    for size in (2e-3, 1e-3):
        moved, shifts = motion.moved(state, size * step[:-3]), drawn + size * step[-3:]
        reduced = _at(motion, seen, moved, shifts, cut).cost - here.cost
        whole = full._at(everywhere.positions + size * push[:-1], drawn + size * push[-1], cut).cost - everywhere.cost
        errors.append([abs(reduced - size * slopes[0]), abs(whole - size * slopes[1])])
    orders = np.log2(np.array(errors[0]) / errors[1])
    assert orders == pytest.approx([2.0, 2.0], abs=0.15)


@pytest.mark.parametrize("technique", TECHNIQUES)
def test_a_body_that_only_moved_is_found_from_anywhere(model: Model, technique: str) -> None:
    for seed in range(3):
        rng = np.random.default_rng(seed)
        turn, shift = pose(seed)
        there = model.mesh.nodes @ turn.T + shift
        found = registered(technique, model, Observations((seen_surface(model, there, rng, 0.0),)))
        assert found.status == Status.CONVERGED, found.deformation.message
        assert np.linalg.norm(found.positions_mm - there, axis=1).max() < 0.3


@pytest.mark.parametrize("technique", TECHNIQUES)
def test_a_fifth_of_the_points_may_lie(model: Model, technique: str) -> None:
    rng = np.random.default_rng(5)
    turn, shift = pose(5)
    there = model.mesh.nodes @ turn.T + shift
    good = seen_surface(model, there, rng, 0.5)
    points = good.points_mm.copy()
    liars = rng.choice(len(points), len(points) // 5, replace=False)
    points[liars] += rng.uniform(10.0, 40.0, (len(liars), 1)) * rng.normal(size=(len(liars), 3)) / np.sqrt(3.0)
    found = registered(technique, model, Observations((replace(good, points_mm=points),)))
    assert found.status == Status.CONVERGED, found.deformation.message
    assert np.linalg.norm(found.positions_mm - there, axis=1).mean() < 1.0


def test_the_world_may_be_turned(model: Model) -> None:
    rng = np.random.default_rng(8)
    bend = seen_surface(model, bent(model.mesh.nodes, 400.0), rng, 0.3)
    turn, shift = pose(8)
    for technique in TECHNIQUES:
        one, other = (
            registered(technique, model, Observations((replace(bend, points_mm=points),)))
            for points in (bend.points_mm, bend.points_mm @ turn.T + shift)
        )
        assert np.linalg.norm(one.positions_mm @ turn.T + shift - other.positions_mm, axis=1).max() < 0.1


def test_what_nothing_holds_is_named(model: Model) -> None:
    duct = model.structures.duct
    assert duct is not None
    straight = Observations((Observation("curve", "wire", duct.points_mm, 0.5, "room"),))
    found = registered("rigid", model, straight)
    assert found.status == Status.UNOBSERVABLE
    assert any("rotation about an axis" in sentence for sentence in found.unobserved), found.unobserved
    assert any("motion along" in sentence for sentence in found.unobserved), found.unobserved


def test_a_kelvinlet_is_kelvin_s_solution_far_away_and_keeps_the_volume() -> None:
    """Kelvin 1848: u = ((3 − 4ν) f + r r·f / r²) / (16 π µ (1 − ν) r); at ν = ½ the divergence vanishes."""
    shear, ratio = 2.0, 0.4
    away = np.array([[300.0, -200.0, 500.0]])
    reach = float(np.linalg.norm(away))
    direction = away[0] / reach
    kelvin = ((3.0 - 4.0 * ratio) * np.eye(3) + np.outer(direction, direction)) / (
        16.0 * np.pi * shear * (1.0 - ratio) * reach
    )
    assert kelvinlets(away, np.zeros((1, 3)), 1.0, shear, ratio)[0, 0] == pytest.approx(kelvin, rel=1e-4)
    place, step = np.array([[3.0, -2.0, 4.0]]), 1e-4
    slopes = [
        (
            kelvinlets(place + step * axis, np.zeros((1, 3)), 5.0, shear, 0.5)
            - kelvinlets(place - step * axis, np.zeros((1, 3)), 5.0, shear, 0.5)
        )[0, 0, k]
        for k, axis in enumerate(np.eye(3))
    ]
    assert sum(slopes) / (2.0 * step) == pytest.approx(np.zeros(3), abs=1e-9)


def test_a_deformation_of_the_basis_is_found(model: Model) -> None:
    """A manufactured motion, seen everywhere without noise."""
    rng = np.random.default_rng(1)
    modes = boundary_responses(model, 20)
    motion = BasisMotion(model.mesh.nodes, modes.basis)
    turn, shift = pose(1)
    amounts = np.zeros(motion.size - 6)
    amounts[:6] = 3.0 * rng.normal(size=6)
    there = motion.positions(MotionState(turn, shift, amounts))
    whole = replace(model, node_sets={"upper": np.unique(model.mesh.boundary()[0])})
    items = tuple(replace(seen_surface(whole, there, rng, 0.0, count=3000), sigma_mm=0.05) for _ in range(1))
    values = {"controls": 20, "strain": 10.0, "model_error_mm": 0.01}
    found = registered("linear-basis", whole, Observations(items), **values)
    rigid = registered("rigid", whole, Observations(items))
    off, stiff = (np.linalg.norm(one.positions_mm - there, axis=1).mean() for one in (found, rigid))
    assert off < 0.1 * stiff


def test_an_incompressible_bend_is_followed_into_the_inside(model: Model) -> None:
    """A closed form that no basis of ours holds, seen all over the surface and at 120 marks of it."""
    rng = np.random.default_rng(2)
    whole = replace(model, node_sets={"upper": np.unique(model.mesh.boundary()[0])})
    there = Bend(Frame(np.zeros(3), np.eye(3)[:, [2, 0, 1]]), 220.0).forward(model.mesh.nodes)
    surface = np.unique(model.mesh.boundary()[0])
    corners = {f"corner {number}": [number] for number in surface[evenly_spread(model.mesh.nodes[surface], 120)]}
    whole = replace(whole, node_sets={**whole.node_sets, **corners})
    marks = [Observation("landmark", name, there[nodes], 0.2, "room") for name, nodes in corners.items()]
    seen = Observations((seen_surface(whole, there, rng, 0.2, count=1500), *marks))
    inside = PointLocator(model.mesh)
    targets = inside.locate(0.6 * (model.mesh.nodes - model.mesh.nodes.mean(axis=0)) + model.mesh.nodes.mean(axis=0))
    errors = {}
    for technique in TECHNIQUES:
        found = registered(technique, whole, seen, model_error_mm=0.05)
        errors[technique] = np.linalg.norm(inside.interpolate(targets, found.positions_mm - there), axis=1).mean()
    assert errors["rigid"] > 2.0
    assert max(errors["free"], errors["linear-basis"], errors["tractions"]) < errors["rigid"] / 3.0


def test_what_cannot_be_used_is_refused(model: Model) -> None:
    rng = np.random.default_rng(0)
    good = seen_surface(model, model.mesh.nodes, rng, 0.5)
    for sentence, points, frame in (
        ("no observations", np.zeros((0, 3)), "room"),
        ("look like metres", 1e-3 * good.points_mm, "room"),
        ("check the units", 1e3 * good.points_mm, "room"),
        ("mm from the organ", good.points_mm + 2000.0, "patient"),
        ("different observed points", np.repeat(good.points_mm[:2], 50, axis=0), "room"),
    ):
        with pytest.raises(BadInput, match=sentence):
            registered("rigid", model, Observations((replace(good, points_mm=points, frame=frame),)))
    with pytest.raises(BadInput, match="no node set"):
        registered("rigid", model, Observations((Observation("landmark", "navel", good.points_mm[:5], 1.0),)))
    nothing = replace(good, points_mm=np.zeros((0, 3)))
    assert registered("rigid", model, Observations((good, nothing))).status == Status.CONVERGED
    line = np.linspace([0.0, 0.0, 0.0], [60.0, 0.0, 0.0], 40)
    assert registered("rigid", model, Observations((replace(good, points_mm=line),))).status != Status.CONVERGED
