import numpy as np

from glisson.core import ContactLaw, Material, Scenario, Stage, Status
from glisson.core.mesh import TetMesh
from glisson.geometry.boxes import box_mesh
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters
from glisson.verification.bodies import box_model

SOLVER = QuasiStatic(QuasiStaticParameters(element="T4"))


def test_a_part_of_the_mesh_that_nothing_holds_is_named() -> None:
    """Of two blocks one is held; the other falls, and where it is, is told."""
    block = box_mesh(np.full(3, 20.0), (1, 1, 1))
    nodes = np.vstack([block.nodes, block.nodes + np.array([50.0, 0.0, 0.0])])
    mesh = TetMesh(nodes, np.vstack([block.tetrahedra, block.tetrahedra + len(block.nodes)]))
    held = np.flatnonzero((nodes[:, 2] < 1e-9) & (nodes[:, 0] < 30.0))
    model = box_model(mesh, Material("neo-hookean", 7.0, 0.45), back=held)
    stage = Stage("weight", ContactLaw(0.3))
    weight = Scenario((), (stage,), surgery_gravity=np.array([0.0, 0.0, -1.0]), rest_shape="as-scanned")
    answer = SOLVER.solve(model, weight)
    assert answer.status is Status.SINGULAR
    assert "the part of the mesh around (60, 10, 10) mm" in answer.message
    assert "-1.00) towards the feet (−z)" in answer.message
