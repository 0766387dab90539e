import numpy as np
import pytest

from glisson.core import Board, ContactLaw, Material, Scenario, Stage, Status
from glisson.geometry.boxes import box_mesh
from glisson.mechanics.body import Body
from glisson.mechanics.elasticity import Elasticity
from glisson.mechanics.elements import surface_quadrature
from glisson.mechanics.linear_solvers import make_direct_solver
from glisson.mechanics.loads import fixed_unknowns, gravity_forces
from glisson.mechanics.newton import Newton, NewtonSettings
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters
from glisson.mechanics.rest_shape import find_rest_shape
from glisson.verification.bodies import box_model

DOWN = np.array([0.0, 0.0, -1.0])


def _slab(young_modulus_kpa: float):
    """An 80 mm high slab of liver on its base."""
    mesh = box_mesh((120.0, 100.0, 80.0), (6, 5, 4), quadratic=True)
    base = np.flatnonzero(mesh.nodes[:, 2] < 1e-9)
    return box_model(mesh, Material("neo-hookean", young_modulus_kpa, 0.45), base=base)


@pytest.mark.parametrize("young_modulus_kpa", [3.0, 7.0, 700.0])
def test_the_same_loads_give_the_scanned_shape_back(young_modulus_kpa: float) -> None:
    """Unloaded shape → gravity in load steps from there → A within 0.05 mm."""
    model = _slab(young_modulus_kpa)
    mesh = model.mesh
    weights, fixed = gravity_forces(model, DOWN), fixed_unknowns(model, ("base",))
    surface = surface_quadrature(mesh.nodes, mesh)
    rest = find_rest_shape(mesh, model.materials, weights, [], surface, fixed, 2.0, 1e-8)
    body = Body(Elasticity(mesh, model.materials, rest.positions), surface, [], fixed)
    newton = Newton(body, make_direct_solver(), NewtonSettings())
    positions = rest.positions
    for share in (0.25, 0.5, 0.75, 1.0):
        body.external = share * weights
        end = newton.solve(positions)
        assert end.status is Status.CONVERGED
        positions = end.positions
    assert np.abs(positions - mesh.nodes).max() < 0.05


def test_gravity_squashes_a_soft_slab_by_several_millimetres() -> None:
    """The reason for the rest shape: at 7 kPa an 80 mm slab is some 3 to 7 mm lower under its own weight."""
    model = _slab(7.0)
    mesh = model.mesh
    surface = surface_quadrature(mesh.nodes, mesh)
    weights, fixed = gravity_forces(model, DOWN), fixed_unknowns(model, ("base",))
    rest = find_rest_shape(mesh, model.materials, weights, [], surface, fixed, 2.0, 1e-8)
    assert 3.0 < float((rest.positions - mesh.nodes)[:, 2].max()) < 7.0


def test_an_organ_on_a_board_starts_in_equilibrium() -> None:
    """Resting on a board, held at one end: without a tool's motion nothing moves."""
    mesh = box_mesh((120.0, 60.0, 30.0), (8, 4, 2))
    back = np.flatnonzero(mesh.nodes[:, 0] < 1e-9)
    model = box_model(mesh, Material("neo-hookean", 7.0, 0.45), back=back)
    board = Board("board", np.zeros(3), -DOWN)
    stages = (Stage("rest", ContactLaw(0.1)),)
    scenario = Scenario((board,), stages, DOWN, DOWN, ("board",))
    answer = QuasiStatic(QuasiStaticParameters()).solve(model, scenario)
    assert answer.status is Status.CONVERGED
    assert np.abs(answer.displacement).max() < 0.05
    # The board carries most of the weight, the held end the rest.
    weight = 1150e-9 * 120 * 60 * 30 * 9806.65e-3
    assert 0.7 * weight < answer.stages[0].contacts[0].force_n[2] < weight
