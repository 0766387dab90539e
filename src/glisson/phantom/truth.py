"""Deformed truths as files: the displacement that another engine found, small enough to ship.

A file (`.npz`) holds `corners` (m, 4) and `rest_nodes` (n, 3) of a T4 mesh of the rest shape, and for the
nodes of the same mesh as T10 the displacements in mm `rest_to_a`, and `stages` (s, N, 3) from A with their
`names`; floats are single precision (some 1e-6 mm here). `note` says in a sentence where it comes from.
"""

from dataclasses import dataclass
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Deformation, StageResult
from glisson.core.errors import BadInput
from glisson.core.mesh import TetMesh
from glisson.core.status import Status
from glisson.phantom.loading import Loading


@dataclass(frozen=True, eq=False)
class Truth:
    """How the rest shape became A, and how A was deformed (both on T10 meshes with the same numbering)."""

    loading: Loading
    deformation: Deformation


def write_truth(path: Path, rest: TetMesh, rest_to_a: FloatArray, stages: dict[str, FloatArray], note: str) -> None:
    """Write a truth; `rest` is T10 as `TetMesh.as_quadratic` makes it, displacements are (N, 3) in mm.

    Raises:
        BadInput: the mesh's middle nodes are not where `as_quadratic` puts them.
    """
    count = int(rest.corners.max()) + 1
    linear = TetMesh(rest.nodes[:count], rest.corners)
    again = linear.as_quadratic()
    if not np.array_equal(again.tetrahedra, rest.tetrahedra) or not np.allclose(again.nodes, rest.nodes):
        raise BadInput("A truth needs the straight T10 mesh that as_quadratic makes of its corners.")
    np.savez_compressed(
        path,
        corners=rest.corners.astype(np.uint16 if count < 2**16 else np.uint32),
        rest_nodes=linear.nodes.astype(np.float32),
        rest_to_a=rest_to_a.astype(np.float32),
        stages=np.stack(list(stages.values())).astype(np.float32),
        names=np.array(list(stages)),
        note=np.array(note),
    )


def read_truth(path: Path) -> Truth:
    """Read a truth.

    Raises:
        BadInput: the file is not one.
    """
    try:
        with np.load(path, allow_pickle=False) as stored:
            rest = TetMesh(stored["rest_nodes"], stored["corners"]).as_quadratic()
            loading = Loading(rest, stored["rest_to_a"].astype(np.float64))
            scanned = TetMesh(rest.moved(loading.displacement), rest.tetrahedra)
            stages = tuple(
                StageResult(str(name), displacement, Status.CONVERGED)
                for name, displacement in zip(stored["names"], stored["stages"], strict=True)
            )
            note = str(stored["note"])
    except (OSError, KeyError, ValueError, BadZipFile) as error:
        raise BadInput(f"{path.name} is not a truth file ({error}); make it anew with its script.") from error
    return Truth(loading, Deformation(scanned, stages, Status.CONVERGED, note))
