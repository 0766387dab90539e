"""Technique "tractions": the organ is free in space, and unknown smooth forces act all over its surface."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.model import Model
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, silent
from glisson.core.scenario import Scenario
from glisson.geometry.quadratic import straight_boundary
from glisson.mechanics.registration.elastic_parameters import ERROR_HELP, LENGTH_HELP
from glisson.mechanics.registration.floating import FloatingBody
from glisson.mechanics.registration.prepared import MovedBody, Prepared
from glisson.mechanics.registration.second_order import SecondOrderMotion, second_derivatives
from glisson.mechanics.registration.seen import ModelError
from glisson.mechanics.registration.smooth_forces import smooth_forces

_MODES, _BENT = 100, 10
"""Ways of deforming that are kept, and how many of them, the widest, are followed to second order."""

_USUAL_SHARE = 0.5
"""Of the mean square of `motion_mm`, as in livers 600 to 619 of the sparse-data twin."""


@dataclass(frozen=True)
class TractionsParameters:
    """Parameters of the organ under tractions."""

    motion_mm: float = parameter(9.0, "how far tissue is typically moved by what deforms the organ, mm", 1e-3, 100.0)
    patch_mm: float = parameter(35.0, "over which length forces act alike, mm", 5.0, 100.0)
    fields: int = parameter(80, "how many ways to spread forces over their place", 10, 500)
    model_error_mm: float = parameter(0.7, ERROR_HELP, minimum=1e-3)
    model_error_length_mm: float = parameter(12.0, LENGTH_HELP, minimum=1e-3)


class Tractions:
    """Random smooth forces on the whole surface say what is likely; the body follows them to second order.

    An organ is pushed, pulled and laid on its side by forces that nobody has measured. Taken as a random field they
    make displacements likely that are wide and smooth, more so than the strain energy alone does.
    """

    name: ClassVar[str] = "tractions"
    summary: ClassVar[str] = "hyperelastic to second order, under unknown smooth forces all over the surface"
    Parameters: ClassVar[type[TractionsParameters]] = TractionsParameters

    def __init__(self, parameters: TractionsParameters) -> None:
        self._chosen = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """Nothing beyond the core."""
        return ()

    def prepare(self, model: Model, scenario: Scenario | None = None, progress: Progress = silent) -> Prepared:
        """See `Registration`."""
        chosen = self._chosen
        progress(None, "preparing the organ")
        body = FloatingBody(model)
        try:
            basis = likely_modes(model, body, chosen)
            second = second_derivatives(body, basis[:, :, :_BENT])
        finally:
            body.close()
        motion = SecondOrderMotion(model.mesh.nodes, basis, np.eye(basis.shape[2]), second)
        return Prepared(
            model, ModelError(chosen.model_error_mm, chosen.model_error_length_mm), MovedBody(motion, _USUAL_SHARE)
        )


def likely_modes(model: Model, body: FloatingBody, chosen: TractionsParameters) -> FloatArray:
    """Displacements (n, 3, k), of which random amounts of unit variance make what is expected; the widest first."""
    mesh = model.mesh
    surface = np.unique(straight_boundary(mesh)[0])
    columns = []
    for share in smooth_forces(mesh, surface, chosen.patch_mm, chosen.fields).T:
        for axis in range(3):
            forces = np.zeros(mesh.nodes.shape)
            forces[surface, axis] = share
            columns.append(body.response(forces).ravel())
    vectors, sizes, _ = np.linalg.svd(np.stack(columns, axis=1), full_matrices=False)
    sizes *= chosen.motion_mm / np.sqrt((sizes**2).sum() / len(mesh.nodes))
    basis: FloatArray = (vectors * sizes)[:, :_MODES].reshape(*mesh.nodes.shape, -1)
    return basis
