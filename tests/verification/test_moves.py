"""Node sets that a stage carries."""

import numpy as np
import pytest

from glisson.core import ContactLaw, Material, Move, Scenario, Stage, Status
from glisson.geometry.boxes import box_mesh
from glisson.mechanics import linear_solvers
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters
from glisson.verification.bodies import box_model

MATERIAL = Material("neo-hookean", 7.0, 0.0)
FREE = ContactLaw()


def _model():
    mesh = box_mesh((20.0, 10.0, 10.0), (4, 2, 2))
    x = mesh.nodes[:, 0]
    return box_model(mesh, MATERIAL, left=np.flatnonzero(x == 0.0), right=np.flatnonzero(x == 20.0))


def _solved(*stages, element="T10"):
    scenario = Scenario((), stages, rest_shape="as-scanned")
    return QuasiStatic(QuasiStaticParameters(element=element, tolerance=1e-9)).solve(_model(), scenario)


@pytest.mark.parametrize("element", ["T4", "T10"])
def test_a_body_goes_along_with_the_parts_that_hold_it(element: str) -> None:
    """Both ends carried alike are a rigid translation, which needs no force."""
    moves = (Move("left", (3.0, -8.0, 5.0)), Move("right", (3.0, -8.0, 5.0)))
    answer = _solved(Stage("carry", FREE, gravity=False, fixed=(), moves=moves), element=element)
    assert answer.status is Status.CONVERGED
    np.testing.assert_allclose(answer.displacement, np.tile([3.0, -8.0, 5.0], (len(answer.mesh.nodes), 1)), atol=1e-9)


def test_stretched_by_moves_in_two_stages_and_let_go() -> None:
    """The middle of a symmetric bar stays in the middle; let go, the bar is as it was, and the last stage's end stays.

    A stretch in two stages ends where one of the sum ends: moves count from the stage's start.
    """
    held = {"gravity": False, "fixed": ("left",)}
    twice = _solved(
        Stage("half", FREE, moves=(Move("right", (3.0, 0.0, 0.0)),), **held),
        Stage("whole", FREE, moves=(Move("right", (3.0, 0.0, 0.0)),), **held),
        Stage("let go", FREE, **held),
    )
    once = _solved(Stage("whole", FREE, moves=(Move("right", (6.0, 0.0, 0.0)),), **held))
    assert twice.status is once.status is Status.CONVERGED
    np.testing.assert_allclose(twice.stages[1].displacement, once.displacement, atol=1e-7)
    middle = np.flatnonzero(once.mesh.nodes[:, 0] == 10.0)
    assert once.displacement[middle, 0].mean() == pytest.approx(3.0, abs=1e-2)
    np.testing.assert_allclose(twice.displacement, 0.0, atol=1e-7)


def test_a_move_that_turns_the_body_inside_out_is_told() -> None:
    answer = _solved(Stage("crush", FREE, gravity=False, fixed=("left",), moves=(Move("right", (-25.0, 0.0, 0.0)),)))
    assert answer.status is not Status.CONVERGED
    assert "crush" in answer.message


def test_nothing_but_contact_needs_a_direct_solver(monkeypatch: pytest.MonkeyPatch) -> None:
    """So MKL, which may not be installed, makes no difference to loads and moves without tools."""

    def refuse(*_args: object) -> None:
        raise AssertionError("A direct solver was asked for.")

    for name in ("pardiso_library", "SuperLU", "SuperLUCondensation"):
        monkeypatch.setattr(linear_solvers, name, refuse)
    pull = Stage("pull", FREE, gravity=False, fixed=("left",), moves=(Move("right", (6.0, 0.0, 4.0)),))
    assert _solved(pull).status is Status.CONVERGED
