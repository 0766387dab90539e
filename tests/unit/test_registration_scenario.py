"""The adjusted manoeuvre: a block on a lever that was turned further than planned, derivatives, and refusals."""

import re
from dataclasses import replace

import numpy as np
import pytest
from blocks import block

from glisson.core import BadInput, StageFailed
from glisson.core.deformation import Deformation
from glisson.core.model import Material, Model
from glisson.core.observations import Observation, Observations
from glisson.core.registry import make_technique
from glisson.core.scenario import ContactLaw, LeverDrive, Scenario, Stage
from glisson.core.status import Status
from glisson.core.tools import Lever
from glisson.geometry.mapping import PointMap
from glisson.mechanics.quadratic_model import quadratic_model
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters
from glisson.mechanics.registration.basis import boundary_responses
from glisson.mechanics.registration.fitting import _at
from glisson.mechanics.registration.places import Places
from glisson.mechanics.registration.scenario_forward import Manoeuvres
from glisson.mechanics.registration.scenario_motion import ScenarioMotion, Tangent
from glisson.mechanics.registration.scenario_unknowns import Doubt, ScenarioUnknowns
from glisson.mechanics.registration.seen import ModelError, Seen
from glisson.phantom.truth_checks import gap_to_lever

PLANNED_DEG, TRUE_DEG = 10.0, 14.0
HINGE = np.array([25.0, 10.0, 0.0])


def block_model(cells: tuple[int, int, int]) -> Model:
    """A bar that is held at one end."""
    mesh = block(cells, (70.0, 20.0, 12.0))
    return Model(
        mesh, {0: Material("neo-hookean", 8.0, 0.45)}, {0: "liver"}, {"back": np.flatnonzero(mesh.nodes[:, 0] < 1e-6)}
    )


def lift(angle_deg: float, hinge_mm: np.ndarray = HINGE) -> Scenario:
    lever = Lever.lifting("lever", hinge_mm, np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), length_mm=60.0)
    stage = Stage("lift", ContactLaw(0.2), (LeverDrive("lever", angle_deg=angle_deg),), gravity=False)
    return Scenario((lever,), (stage,))


@pytest.fixture(scope="module")
def truth() -> Deformation:
    """Another mesh, exacter than what the technique solves."""
    return QuasiStatic(QuasiStaticParameters()).solve(block_model((10, 3, 2)), lift(TRUE_DEG))


def seen_of(truth: Deformation, sigma: float = 0.1) -> Observations:
    rng = np.random.default_rng(0)
    nodes = truth.mesh.moved(truth.displacement)
    top = nodes[truth.mesh.nodes[:, 2] > 12.0 - 1e-6]
    lever = lift(TRUE_DEG).tools[0]
    assert isinstance(lever, Lever)
    # The lever is rigid, so where it touches is known in closed form: on its turned upper side.
    below = nodes[truth.mesh.nodes[:, 2] < 1e-6]
    touching = below[gap_to_lever(below, lever, np.radians(TRUE_DEG)) < 0.2]
    assert len(touching) >= 3
    found = (("surface", "top", top), ("contact", "lever", touching))
    return Observations(
        tuple(Observation(k, n, p + sigma * rng.normal(size=p.shape), sigma) for k, n, p in found)  # type: ignore[arg-type]
    )


def test_the_levers_angle_is_found_and_the_block_with_it(truth: Deformation) -> None:
    assert truth.status is Status.CONVERGED
    # The hinge is where it was planned to be: the angle alone is off.
    values = {"model_error_mm": 0.05, "controls": 8, "place_mm": 0.1}
    technique = make_technique("registration", "scenario", values, "register")
    prepared = technique.prepare(block_model((7, 2, 1)), lift(PLANNED_DEG))
    found = prepared.register(seen_of(truth))
    assert found.status is Status.CONVERGED
    angle, sigma = (float(n) for n in re.findall(r"angle of lever ([\d.]+) ± ([\d.]+)°", found.notes[0])[0])
    assert abs(angle - TRUE_DEG) < 0.3
    assert sigma < 0.3
    assert any("tells the friction" in note for note in found.notes)
    carried = PointMap(found.deformation.mesh, found.deformation.displacement).forward(truth.mesh.nodes)
    planned = PointMap(prepared._model.mesh, prepared.tangent.positions - prepared._model.mesh.nodes).forward(
        truth.mesh.nodes
    )
    true = truth.mesh.moved(truth.displacement)
    assert np.linalg.norm(planned - true, axis=1).max() > 2.0
    assert np.linalg.norm(carried - true, axis=1).max() < 0.4
    again = prepared.register(seen_of(truth))
    assert np.array_equal(again.positions_mm, found.positions_mm)
    lying = replace(
        seen_of(truth).items[0], name="sponge", points_mm=seen_of(truth).items[0].points_mm + [0.0, 0.0, 15.0]
    )
    doubted = prepared.register(Observations((*seen_of(truth).items, lying)))
    assert doubted.status is Status.AMBIGUOUS
    assert "'sponge' by" in doubted.deformation.message


def test_derivatives_of_the_joint_cost_are_those_of_differences(truth: Deformation) -> None:
    rng = np.random.default_rng(1)
    model = quadratic_model(block_model((7, 2, 1)))
    unknowns = ScenarioUnknowns(model, lift(PLANNED_DEG), Doubt(5.0, 4.0, 2.0, 1.5, 3.0))
    count = len(unknowns.every)
    bent = model.mesh.nodes + [0.0, 0.0, 1.0] * (model.mesh.nodes[:, :1] / 20.0) ** 2
    tangent = Tangent(np.zeros(count), bent, rng.normal(size=(*bent.shape, count)))
    modes = boundary_responses(model, 6, ("back",))
    assert np.abs(modes.basis[model.node_set("back")]).max() == 0.0
    seen = seen_of(truth, 0.5)
    motion = ScenarioMotion(unknowns, tangent, modes.basis, modes.energies_uj, seen.items[1:])
    held = Seen(Places(model), seen, ModelError(0.5, 20.0))
    state, cut = motion.state(0.1 * rng.normal(size=motion.size)), np.full(len(held.item), 4.0)
    drawn = rng.normal(size=(held.curves, 3))
    here = _at(motion, held, state, drawn, cut)
    direction = rng.normal(size=motion.size)
    steps = np.array([1e-3, 5e-4])
    left = [
        _at(motion, held, motion.moved(state, step * direction), drawn, cut).cost
        - here.cost
        - step * here.gradient[: motion.size] @ direction
        for step in steps
    ]
    assert np.log(left[0] / left[1]) / np.log(2.0) == pytest.approx(2.0, abs=0.1)


def test_a_further_solution_is_explained_by_the_derivative() -> None:
    rng = np.random.default_rng(2)
    true = rng.normal(size=(5, 3, 2))
    tangent = Tangent(np.zeros(2), np.zeros((5, 3)), np.zeros((5, 3, 2)))
    for amounts in np.eye(2):
        tangent = tangent.moved_to(amounts, true @ amounts)
    assert np.allclose(tangent.predicted(np.array([1.0, 0.0])), true[:, :, 0])


def test_what_cannot_be_adjusted_is_refused(truth: Deformation) -> None:
    technique = make_technique("registration", "scenario", {}, "register")
    model = block_model((7, 2, 1))
    with pytest.raises(BadInput, match=r"scenario\.toml"):
        technique.prepare(model)
    still = replace(lift(PLANNED_DEG), stages=(Stage("nothing", ContactLaw()),))
    with pytest.raises(BadInput, match="turns no lever"):
        technique.prepare(model, still)
    nowhere = Tangent(
        np.zeros(5), quadratic_model(model).mesh.nodes, np.zeros((*quadratic_model(model).mesh.nodes.shape, 5))
    )
    prepared = technique.with_tangent(model, lift(PLANNED_DEG), nowhere)
    elsewhere = tuple(replace(item, frame="room") for item in seen_of(truth).items)
    with pytest.raises(BadInput, match="frame"):
        prepared.register(Observations(elsewhere))


def test_a_manoeuvre_without_a_solution_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def unsolved(self: QuasiStatic, model: Model, scenario: Scenario) -> Deformation:
        return Deformation(model.mesh, (), Status.INVERTED, "An element turned inside out.")

    monkeypatch.setattr(QuasiStatic, "solve", unsolved)
    technique = make_technique("registration", "scenario", {}, "register")
    with pytest.raises(StageFailed, match="inside out") as failure:
        technique.prepare(block_model((7, 2, 1)), lift(PLANNED_DEG))
    assert failure.value.status is Status.INVERTED


def test_stiffness_and_attachments_are_scaled_as_told() -> None:
    model = replace(block_model((7, 2, 1)), ligaments={"back": 2.0})
    unknowns = ScenarioUnknowns(model, lift(PLANNED_DEG), Doubt(5.0, 4.0, 2.0, 1.5, 3.0))
    changed, scenario = unknowns.at(np.array([1.0, 0.5, 0.0, 1.0, -1.0, 1.0]))
    assert changed.materials[0].young_modulus_kpa == pytest.approx(8.0 / 1.5)
    assert changed.ligaments["back"] == pytest.approx(6.0)
    assert scenario.stages[0].drives[0].angle_deg == pytest.approx(15.0)
    assert scenario.stages[0].contact.friction == pytest.approx(0.4)
    lever = scenario.tools[0]
    assert isinstance(lever, Lever)
    assert lever.hinge_mm == pytest.approx(HINGE + [2.0, 0.0, 0.0])
    tip = HINGE + [2.0, 0.0, 0.0] + 30.0 * np.array([np.cos(np.radians(15.0)), 0.0, np.sin(np.radians(15.0))])
    amounts = np.array([1.0, 0.5, 0.0, 0.0, 0.0, 0.0])
    assert unknowns.lever_gaps("lever", tip[None], amounts) == pytest.approx(0.0, abs=1e-9)


def test_what_is_solved_is_what_was_wanted_or_half_way(monkeypatch: pytest.MonkeyPatch) -> None:
    unknowns = ScenarioUnknowns(block_model((7, 2, 1)), lift(PLANNED_DEG), Doubt(5.0, 4.0, 2.0, 1.5, 3.0))
    rng = np.random.default_rng(3)
    start, wanted = rng.normal(size=(2, len(unknowns.every)))
    manoeuvres = Manoeuvres(unknowns)
    monkeypatch.setattr(manoeuvres, "_positions", lambda amounts: amounts)
    assert np.array_equal(manoeuvres.solved_towards(start, wanted)[0], wanted)

    def only_near(amounts: np.ndarray) -> np.ndarray:
        if np.array_equal(amounts, wanted):
            raise StageFailed("Too far.", Status.INVERTED)
        return amounts

    monkeypatch.setattr(manoeuvres, "_positions", only_near)
    assert manoeuvres.solved_towards(start, wanted)[0] == pytest.approx(0.5 * (start + wanted))
