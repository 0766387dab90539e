"""Internal forces against public data: a liver pulled by a tool (Mestdagh and Cotin, MICCAI 2022)."""

from functools import partial

import numpy as np

from glisson.core.model import Material
from glisson.io.mestdagh import read_pulled_mesh, read_pulled_sequence
from glisson.mechanics.elasticity import Elasticity
from glisson.verification.check import Case, Check, relative, vanishing
from glisson.verification.shared_data import shared_folder

_MATERIAL = Material("neo-hookean-log", 4.5, 0.49)  # 4500 Pa
_FRAMES = (0, 10, 25, 40, 49)
_SOURCE = "Mestdagh and Cotin 2022, their own finite elements"


def _pulled(name: str, sequence: str) -> list[Check]:
    """Free nodes are in equilibrium at the given positions, and the tool pulls as strongly as was recorded."""
    folder = shared_folder("open", "mestdagh-liver-sequences")
    liver = read_pulled_mesh(folder, "default")
    pulled = read_pulled_sequence(folder / f"sequences-neohookean-{sequence}.tar.xz")
    tool = pulled.tool
    free = np.setdiff1d(np.arange(len(liver.mesh.nodes)), np.concatenate([liver.held, tool]))
    body = Elasticity(liver.mesh, {0: _MATERIAL}, liver.mesh.nodes)
    forces = np.stack([body.forces(pulled.positions[frame]) * 1e-3 for frame in _FRAMES])
    pulls, true = forces[:, tool].sum(axis=1), pulled.forces[list(_FRAMES)] * 1e-3
    apart = np.linalg.norm(pulls - true, axis=1).max()
    strongest = int(np.linalg.norm(true, axis=1).argmax())
    return [
        vanishing(f"{name}/free-nodes", np.abs(forces[:, free]).max(), 1e-6, "N", _SOURCE),
        vanishing(f"{name}/tool-difference", apart, 1e-3 * float(np.linalg.norm(true[strongest])), "N", _SOURCE),
        relative(
            f"{name}/tool-force",
            np.linalg.norm(pulls[strongest]),
            np.linalg.norm(true[strongest]),
            1e-3,
            "N",
            _SOURCE,
        ),
    ]


CASES = tuple(
    Case(name, f"forces at the nodes of sequence {sequence}, T4", partial(_pulled, name, sequence))
    for sequence in ("s1", "s2", "s3")
    for name in [f"mestdagh/{sequence}"]
)
