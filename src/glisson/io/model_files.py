"""A model on disk: `model.vtu` (mesh and regions) and `model.json` (materials, node sets, structures)."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

from glisson.core import BadInput, Capsule, Curve, Material, Model, Rod, Structures, TriangleSurface, Tumour
from glisson.io.mesh_pairs import read_pair, write_pair
from glisson.io.records import Record
from glisson.io.vessel_files import tree_of_table, tree_table

SCHEMA = 1
"""Version of the layout that is written; older ones are read."""

_NAME = "model"


def write_model(folder: str | Path, model: Model) -> None:
    """Write `model.vtu` and `model.json` into `folder` with all digits; atomic, other files there stay.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    values: dict[str, Any] = {
        "schema": SCHEMA,
        "materials": {number: _material_table(material) for number, material in model.materials.items()},
        "region_names": dict(model.region_names),
        "node_sets": dict(model.node_sets),
        "structures": _structures_table(model.structures),
        "ligaments": dict(model.ligaments),
        "ties": list(model.ties),
    }
    if model.capsule is not None:
        values["capsule"] = asdict(model.capsule)
    if model.rod is not None:
        values["rod"] = asdict(model.rod)
    write_pair(Path(folder), _NAME, model.mesh, {}, values)


def read_model(folder: str | Path) -> Model:
    """Read what `write_model` wrote.

    Raises:
        BadInput: a file is absent, damaged or of a newer Glisson, or the two do not belong together.
    """
    with read_pair(Path(folder), _NAME, "a model", SCHEMA) as (mesh, _, record):
        names = record.record("region_names")
        sets = record.record("node_sets")
        return Model(
            mesh=mesh,
            materials={_region(key): _material(entry) for key, entry in record.named_records("materials").items()},
            region_names={_region(key): names.text(key) for key in names.keys()},  # noqa: SIM118  # no dict
            node_sets={key: sets.wholes(key, -1) for key in sets.keys()},  # noqa: SIM118
            structures=_structures(record.record("structures")),
            capsule=_capsule(record.record("capsule")) if record.has("capsule") else None,
            ties=record.texts("ties", ()),
            rod=_rod(record.record("rod")) if record.has("rod") else None,
            ligaments=_ligaments(record.record("ligaments")) if record.has("ligaments") else {},
        )


def _region(key: str) -> int:
    if not key.lstrip("-").isdecimal():
        raise BadInput(f"a region must be a whole number, not {key!r}.")
    return int(key)


def _material_table(material: Material) -> dict[str, Any]:
    return {
        "law": material.law,
        "young_modulus_kpa": material.young_modulus_kpa,
        "poisson_ratio": material.poisson_ratio,
        "density_kg_m3": material.density_kg_m3,
        "constants": list(material.constants),
    }


def _material(record: Record) -> Material:
    with record.building():
        return Material(
            record.text("law"),
            record.number("young_modulus_kpa"),
            record.number("poisson_ratio"),
            record.number("density_kg_m3"),
            tuple(record.floats("constants", -1).tolist()) if record.has("constants") else (),
        )


def _capsule(record: Record) -> Capsule:
    with record.building():
        return Capsule(record.number("young_modulus_kpa"), record.number("thickness_mm"))


def _rod(record: Record) -> Rod:
    with record.building():
        names = ("bending_stiffness_n_mm2", "axial_stiffness_n", "friction", "grip_n_mm")
        return Rod(*(record.number(name) for name in names))


def _ligaments(record: Record) -> dict[str, float]:
    return {key: record.number(key) for key in record.keys()}  # noqa: SIM118  # no dict


def _structures_table(structures: Structures) -> dict[str, Any]:
    return {
        "tumours": [
            {"name": t.name, "vertices_mm": t.surface.vertices, "triangles": t.surface.triangles}
            for t in structures.tumours
        ],
        "trees": [tree_table(tree) for tree in structures.trees],
        "duct_mm": structures.duct.points_mm if structures.duct else None,
        "wire_length_mm": structures.wire_length_mm,
        "curves_mm": {name: curve.points_mm for name, curve in structures.curves.items()},
    }


def _structures(record: Record) -> Structures:
    with record.building():
        return Structures(
            tumours=tuple(_tumour(entry) for entry in record.records("tumours")),
            trees=tuple(tree_of_table(entry) for entry in record.records("trees")),
            duct=Curve(record.floats("duct_mm", -1, 3)) if record.has("duct_mm") else None,
            wire_length_mm=record.number_or_none("wire_length_mm"),
            curves=_curves(record.record("curves_mm")) if record.has("curves_mm") else {},
        )


def _curves(record: Record) -> dict[str, Curve]:
    return {key: Curve(record.floats(key, -1, 3)) for key in record.keys()}  # noqa: SIM118  # no dict


def _tumour(record: Record) -> Tumour:
    with record.building():
        surface = TriangleSurface(record.floats("vertices_mm", -1, 3), record.wholes("triangles", -1, 3))
        return Tumour(record.text("name"), surface)
