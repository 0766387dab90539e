"""A reduced model as named arrays and back, for one file."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glisson.core.errors import BadInput
from glisson.core.model import Material
from glisson.mechanics.contact_law import Cushion
from glisson.mechanics.reduced.contact import ReducedSurface
from glisson.mechanics.reduced.estimate import ErrorEstimate
from glisson.mechanics.reduced.local import LocalCompliance
from glisson.mechanics.reduced.model import ReducedModel
from glisson.mechanics.reduced.points import ElasticPoints

KIND = "reduced model"
SCHEMA = 1


def pack(model: ReducedModel) -> dict[str, NDArray[Any]]:
    """Everything, as arrays of numbers and text."""
    materials = model.points.materials
    numbers = sorted(materials)
    constants = [
        (m.young_modulus_kpa, m.poisson_ratio, m.density_kg_m3, *m.constants) for m in (materials[n] for n in numbers)
    ]
    longest = max(len(row) for row in constants)
    rows = [[*row, *[np.nan] * (longest - len(row))] for row in constants]
    estimate, surface, local, cushion = model.estimate, model.surface, model.local, model.cushion
    return {
        "rest": model.rest,
        "basis": model.basis,
        "weights": model.weights,
        "cushion": np.array([cushion.range_mm, cushion.stiffness_kpa_mm, cushion.hardening]),
        "regions": np.array(numbers),
        "laws": np.array([materials[n].law for n in numbers]),
        "constants": np.array(rows),
        "stiffness": estimate.stiffness,
        "sentinels": estimate.sentinels,
        "factor": np.array(estimate.factor),
        "surface rest": surface.rest,
        "surface basis": surface.basis,
        "faces": surface.faces,
        "shapes": surface.shapes,
        "areas": surface.areas,
        "local numbers": surface.local,
        "local nodes": local.nodes,
        "local fields": local.fields,
        "local compliance": local.compliance,
        **_packed_points("solution", model.points),
        **_packed_points("estimate", estimate.points),
    }


def unpack(arrays: Mapping[str, NDArray[Any]]) -> ReducedModel:
    """The model that was packed.

    Raises:
        BadInput: an array is missing.
    """
    try:
        materials = {
            int(number): _material(str(law), row[np.isfinite(row)].tolist())
            for number, law, row in zip(arrays["regions"], arrays["laws"], arrays["constants"], strict=True)
        }
        points = _unpacked_points("solution", arrays, materials)
        names = ("surface rest", "surface basis", "faces", "shapes", "areas", "local numbers")
        return ReducedModel(
            arrays["rest"],
            arrays["basis"],
            points,
            ReducedSurface(*(arrays[name] for name in names)),
            LocalCompliance(*(arrays[f"local {name}"] for name in ("nodes", "fields", "compliance"))),
            arrays["weights"],
            Cushion(*arrays["cushion"].tolist()),
            ErrorEstimate(
                _unpacked_points("estimate", arrays, materials),
                arrays["stiffness"],
                arrays["sentinels"],
                float(arrays["factor"]),
            ),
        )
    except KeyError as error:
        raise BadInput(f"The reduced model lacks the array {error}.") from error


def _material(law: str, numbers: list[float]) -> Material:
    young_modulus, poisson_ratio, density, *constants = numbers
    return Material(law, young_modulus, poisson_ratio, density, tuple(constants))


def _packed_points(name: str, points: ElasticPoints) -> dict[str, NDArray[Any]]:
    parts = {"strains": points.strains, "weights": points.weights, "regions": points.regions}
    return {f"{name} {part}": values for part, values in parts.items()}


def _unpacked_points(name: str, arrays: Mapping[str, NDArray[Any]], materials: Mapping[int, Material]) -> ElasticPoints:
    strains, weights, regions = (arrays[f"{name} {part}"] for part in ("strains", "weights", "regions"))
    return ElasticPoints(strains, weights, regions, materials)
