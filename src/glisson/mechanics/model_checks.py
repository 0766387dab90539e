"""What a model and a scenario must be for the mechanics to mean anything, beyond what their types check."""

import numpy as np

from glisson.core.arrays import IntArray
from glisson.core.errors import BadInput
from glisson.core.mesh import TET_EDGES, TetMesh
from glisson.core.model import Model
from glisson.core.scenario import Scenario, Stage
from glisson.core.units import place_text
from glisson.mechanics.elements import quadrature
from glisson.mechanics.loads import fixed_unknowns

_PRIMES = np.array([1, 1_000_003, 998_244_353, 2_147_483_647])


def check_model(model: Model, scenario: Scenario) -> None:
    """Raise BadInput where the mesh has loose nodes, twin or folded elements, or a stage holds nodes in two ways."""
    _check_mesh(model.mesh)
    for stage in scenario.stages:
        _check_holds(model, stage)


def _check_mesh(mesh: TetMesh) -> None:
    used = np.zeros(len(mesh.nodes), dtype=bool)
    used[mesh.tetrahedra] = True
    loose = np.flatnonzero(~used)
    if len(loose):
        where = place_text(mesh.nodes[loose[0]])
        raise BadInput(
            f"{len(loose)} nodes of the mesh belong to no tetrahedron, the first at {where}; leave them out."
        )
    twins = _twins(mesh.corners)
    if len(twins):
        where = place_text(mesh.nodes[mesh.corners[twins[0]]].mean(axis=0))
        raise BadInput(f"{len(twins)} tetrahedra are there twice, the first at {where}; leave the copies out.")
    if mesh.is_quadratic:
        bad = _folded(mesh)
        if len(bad):
            where = place_text(mesh.nodes[mesh.corners[bad[0]]].mean(axis=0))
            raise BadInput(
                f"{len(bad)} quadratic tetrahedra are folded, the first at {where}: their middle nodes lie off their "
                "edges or are in another order than 01, 12, 02, 03, 13, 23."
            )


def _twins(corners: IntArray) -> IntArray:
    """Numbers of elements that have the corners of an earlier one."""
    ordered = np.sort(corners, axis=1)
    # Keys of 64 bits that wrap around are quick to sort; only those that coincide are looked at closely.
    keys = ordered @ _PRIMES
    _, first, counts = np.unique(keys, return_index=True, return_counts=True)
    if (counts == 1).all():
        return np.zeros(0, dtype=np.int64)
    alike = np.setdiff1d(np.arange(len(keys)), first[counts == 1])
    _, firsts = np.unique(ordered[alike], axis=0, return_index=True)
    return np.delete(alike, firsts)


def _folded(mesh: TetMesh) -> IntArray:
    ends = mesh.nodes[mesh.corners[:, TET_EDGES]]
    away = np.linalg.norm(mesh.nodes[mesh.tetrahedra[:, 4:]] - ends.mean(axis=2), axis=2)
    off = (away >= 0.5 * np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2)).any(axis=1)
    return np.flatnonzero(off | (quadrature(mesh.nodes, mesh).weights <= 0.0).any(axis=1))


def _check_holds(model: Model, stage: Stage) -> None:
    held = fixed_unknowns(model, stage.fixed)
    if held.all():
        raise BadInput(f"Stage {stage.name!r} fixes all nodes of the mesh, so there is nothing to compute.")
    goals = np.full(model.mesh.nodes.shape, np.nan)
    for move in stage.moves:
        nodes = model.node_set(move.node_set)
        if len(nodes) == 0:
            raise BadInput(f"Stage {stage.name!r} moves node set {move.node_set!r}, which is empty.")
        known = goals[nodes]
        clash = (held[nodes, 0] & any(move.displacement_mm)) | (~np.isnan(known) & (known != move.displacement_mm)).any(
            axis=1
        )
        if clash.any():
            where = place_text(model.mesh.nodes[nodes[int(np.argmax(clash))]])
            raise BadInput(
                f"Stage {stage.name!r} moves node set {move.node_set!r}, but holds its node at {where} in another way; "
                "give each node one goal."
            )
        goals[nodes] = move.displacement_mm
