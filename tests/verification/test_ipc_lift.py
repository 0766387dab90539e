"""The lift by the IPC Toolkit's contact: its derivatives, and our own contact beside it."""

from math import radians

import numpy as np
import pytest
from lifts import DOWN, slab, slab_lever

from glisson.core import Board, ContactLaw, LeverDrive, Scenario, Stage, Status
from glisson.mechanics.quadratic_model import quadratic_model
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters
from glisson.mechanics.tools import make_tool
from glisson.studies.contact.ipc_lift import lift_by_ipc
from glisson.studies.contact.ipc_tools import IpcTools
from glisson.studies.contact.tool_surfaces import board_surface, lever_surface

CLEARANCE_MM = 0.3
BOARD = Board("board", CLEARANCE_MM * DOWN, -DOWN)
LEVER = slab_lever(across=25.0, height=-CLEARANCE_MM, width_mm=60.0)
LAW = ContactLaw(0.3)
SETTLE = Stage("settle", LAW)


def test_forces_and_stiffness_are_derivatives() -> None:
    """Taylor: the energy's error falls with the second and third power of a step, friction being lagged."""
    model = quadratic_model(slab(7.0, (4, 2, 1)))
    tools = [make_tool(BOARD), make_tool(LEVER)]
    part = IpcTools(model.mesh, tools, [board_surface(BOARD), lever_surface(LEVER, 0.0)[0]], 7.0)
    part.friction = 0.3
    near = model.mesh.nodes + 0.92 * CLEARANCE_MM * DOWN
    part.renew(near)
    rng = np.random.default_rng(2)
    moved = near + 0.002 * rng.normal(size=near.shape)
    step = rng.normal(size=near.shape)
    energy, slope = part.energy(moved), -float(np.vdot(part.forces(moved), step))
    groups, local = part.stiffness(moved, project=False)
    curved = np.einsum("kai,kabij,kbj->", step[groups], local, step[groups])
    assert slope != 0.0
    first, second = [], []
    for share in (2e-4, 1e-4):
        reached = part.energy(moved + share * step)
        first.append(abs(reached - energy - share * slope))
        second.append(abs(reached - energy - share * slope - 0.5 * share**2 * curved))
    # What tools do to the organ, it does to them.
    on_tools = part.on_tool(0, moved) + part.on_tool(1, moved)
    np.testing.assert_allclose(on_tools, -part.forces(moved).sum(axis=0), atol=1e-9 * np.abs(part.forces(moved)).sum())
    assert np.log2(first[0] / first[1]) == pytest.approx(2.0, abs=0.1)
    assert np.log2(second[0] / second[1]) == pytest.approx(3.0, abs=0.3)


def test_both_contacts_lift_alike() -> None:
    """Two laws, surfaces and ways to the end; a tenth of a millimetre is what their cushions differ by."""
    model = slab(7.0, (6, 2, 2))
    stages = (SETTLE, Stage("lift", LAW, (LeverDrive("lever", angle_deg=8.0),)))
    scenario = Scenario((BOARD, LEVER), stages, None, DOWN, (), "as-scanned")
    ours = QuasiStatic(QuasiStaticParameters()).solve(model, scenario)
    other = lift_by_ipc(model, scenario)
    assert (ours.status, other.deformation.status) == (Status.CONVERGED, Status.CONVERGED)
    moved = np.linalg.norm(ours.displacement, axis=1).max()
    assert moved > 0.8 * 65.0 * np.sin(radians(8.0))
    apart = np.linalg.norm(ours.displacement - other.deformation.displacement, axis=1)
    assert np.median(apart) < 0.1
    assert apart.max() < 0.03 * moved
    # The toolkit's friction counts slip in a load step only, and is not fully mobilised in a small one.
    force = next(contact.force_n for contact in ours.stages[-1].contacts if contact.tool == "lever")
    assert other.forces_n[1] @ DOWN == pytest.approx(-np.array(force) @ DOWN, rel=0.05)
