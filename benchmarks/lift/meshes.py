"""Meshes of the benchmark: `python meshes.py ELEMENTS ELEMENT OUT`, with about so many elements.

With each goes its unloaded shape as Glisson finds it, from which CalculiX starts and with which answers are judged.
"""

import sys
from pathlib import Path

import numpy as np
from problem import MEMBER, model_of, scenario

from glisson.core.mesh import TetMesh
from glisson.io.atomic import atomic_path
from glisson.mechanics.faces import face_nodes
from glisson.mechanics.loaded_body import loaded_body
from glisson.mechanics.numbering import numbering
from glisson.mechanics.quadratic_model import quadratic_model
from glisson.mechanics.quasi_static import REST_ACCURACY, QuasiStaticParameters
from glisson.phantom.family import build_anatomy, scanned_structures
from glisson.phantom.proportions import draw_proportions
from glisson.studies.meshing import member_surface, mesh_of_size

_WATCHED_MM = 15.0


def lift_mesh(elements: int) -> TetMesh:
    """A T4 mesh of about so many elements."""
    return mesh_of_size(member_surface(draw_proportions(MEMBER)), elements)[0]


def main(elements: int, element: str, target: Path) -> None:
    """Make one mesh, unload it, and write both."""
    model = model_of(lift_mesh(elements))
    held = model.node_sets["back"]
    if element == "T10":
        model = quadratic_model(model)
    mesh, order = model.mesh, numbering(model.mesh.nodes)
    body = loaded_body(order.model(model), scenario(), QuasiStaticParameters(element=element), REST_ACCURACY)
    outside = np.union1d(face_nodes(mesh), model.node_sets["back"])
    tumour = scanned_structures(build_anatomy(MEMBER).interior, None).tumours[0]
    near = np.linalg.norm(mesh.nodes - tumour.centroid_mm, axis=1) <= _WATCHED_MM
    with atomic_path(target) as path:
        np.savez(
            path,
            scanned=mesh.nodes,
            unloaded=body.elasticity.rest[order.new],
            tetrahedra=mesh.tetrahedra,
            held=held,
            inside=np.setdiff1d(np.arange(len(mesh.nodes)), outside),
            watched=np.flatnonzero(near),
        )


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2], Path(sys.argv[3]))
