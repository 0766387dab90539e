"""A deformation on disk: `deformation.vtu` (a displacement field for each stage) and `deformation.json`.

A technique's estimate of its error is a field of the former.

The JSON file holds status, message, convergence record, events and contacts. A number that is not finite
(the residual of a failed step) is null there and NaN when read; a least gap that is null is None.
"""

from pathlib import Path

from glisson.core import (
    BadInput,
    ContactReport,
    Deformation,
    Event,
    LoadStep,
    RodReport,
    StageResult,
    Status,
)
from glisson.io.mesh_pairs import read_pair, write_pair
from glisson.io.records import Record
from glisson.io.vtk_xml import VtkCells

SCHEMA = 1
"""Version of the layout that is written; older ones are read."""

_NAME = "deformation"
_ERROR = "estimated error"


def write_deformation(folder: str | Path, deformation: Deformation) -> None:
    """Write `deformation.vtu` and `deformation.json` into `folder`; atomic, other files there stay.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    fields = [f"displacement {number} {stage.name}" for number, stage in enumerate(deformation.stages, start=1)]
    values = {
        "schema": SCHEMA,
        "status": deformation.status.value,
        "message": deformation.message,
        "stages": [
            {
                "name": stage.name,
                "field": field,
                "status": stage.status.value,
                "contacts": [vars(contact) for contact in stage.contacts],
                "rod": vars(stage.rod) if stage.rod else None,
            }
            for stage, field in zip(deformation.stages, fields, strict=True)
        ],
        "record": [vars(step) | {"status": step.status.value} for step in deformation.record],
        "events": [vars(event) for event in deformation.events],
    }
    arrays = {field: stage.displacement for field, stage in zip(fields, deformation.stages, strict=True)}
    if deformation.estimated_error is not None:
        arrays[_ERROR] = deformation.estimated_error
    write_pair(Path(folder), _NAME, deformation.mesh, arrays, values)


def read_deformation(folder: str | Path) -> Deformation:
    """Read what `write_deformation` wrote.

    Raises:
        BadInput: a file is absent, damaged or of a newer Glisson, or the two do not belong together.
    """
    with read_pair(Path(folder), _NAME, "a deformation", SCHEMA) as (mesh, cells, record):
        return Deformation(
            mesh=mesh,
            stages=tuple(_stage(entry, cells) for entry in record.records("stages")),
            status=_status(record),
            message=record.text("message"),
            record=tuple(_step(entry) for entry in record.records("record")),
            events=tuple(_event(entry) for entry in record.records("events")),
            estimated_error=cells.point_data.get(_ERROR),
        )


def _status(record: Record) -> Status:
    name = record.text("status")
    if name not in {status.value for status in Status}:
        raise BadInput(f"{record.where('status')} {name!r} is no known status.")
    return Status(name)


def _stage(record: Record, cells: VtkCells) -> StageResult:
    with record.building():
        field = record.text("field")
        if field not in cells.point_data:
            raise BadInput(f"the field {field!r} is not in the mesh file.")
        contacts = tuple(_contact(entry) for entry in record.records("contacts"))
        rod = _rod(record.record("rod")) if record.has("rod") else None
        return StageResult(record.text("name"), cells.point_data[field], _status(record), contacts, rod)


def _contact(record: Record) -> ContactReport:
    with record.building():
        return ContactReport(
            tool=record.text("tool"),
            force_n=record.vector_or_nan("force_n"),
            area_mm2=record.number_or_nan("area_mm2"),
            largest_pressure_kpa=record.number_or_nan("largest_pressure_kpa"),
            least_gap_mm=record.number_or_none("least_gap_mm"),
            sticking=record.number_or_nan("sticking"),
            largest_slip_mm=record.number_or_nan("largest_slip_mm"),
            angle_deg=record.number_or_none("angle_deg"),
            hinge_moment_nm=record.number_or_none("hinge_moment_nm"),
        )


def _rod(record: Record) -> RodReport:
    with record.building():
        names = ("slide_mm", "largest_slide_mm", "tension_n")
        return RodReport(*(record.number_or_nan(name) for name in names))


def _step(record: Record) -> LoadStep:
    with record.building():
        return LoadStep(
            stage=record.text("stage"),
            fraction=record.number("fraction"),
            iterations=record.whole("iterations"),
            residual=record.number_or_nan("residual"),
            energy_uj=record.number_or_nan("energy_uj"),
            status=_status(record),
        )


def _event(record: Record) -> Event:
    with record.building():
        return Event(record.text("kind"), record.text("tool"), record.number_or_none("at_deg"))
