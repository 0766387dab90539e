"""Libraries of instruments (`instruments.toml`), for people to read and change, and trocars (`trocar.toml`)."""

from pathlib import Path
from typing import Any

from glisson.core.instruments import Instrument, InstrumentLibrary
from glisson.core.trocar import Trocar
from glisson.io.camera_files import read_camera
from glisson.io.records import Record, read_record, write_toml

EXAMPLE_LIBRARY = Path(__file__).with_name("data") / "instruments.toml"
"""Ten instruments that come with Glisson."""

EXAMPLE_TROCAR = Path(__file__).with_name("data") / "trocar" / "trocar.toml"
"""A trocar with a wide-angle camera."""

_SCHEMA = 1


def read_instruments(path: str | Path) -> InstrumentLibrary:
    """Read a library; whether its codes can be told apart is not asked here.

    Raises:
        BadInput: absent, damaged, of a newer Glisson; an unknown key, a wrong type or an impossible value, named by its
            key path ("instruments[1].colours"); a name is there twice.
    """
    with read_record(Path(path), "a library of instruments", _SCHEMA) as record:
        return InstrumentLibrary(tuple(_instrument(entry) for entry in record.records("instruments")))


def write_instruments(path: str | Path, library: InstrumentLibrary) -> None:
    """Write a library; atomic.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    table = {"schema": _SCHEMA, "instruments": [_instrument_table(entry) for entry in library.instruments]}
    write_toml(path, table)


def read_trocar(path: str | Path) -> Trocar:
    """Read a trocar: its pivot and its channel's axis, and the camera from the file that it names, beside it.

    Raises:
        BadInput: absent, damaged, or with an impossible value, named by its key path; the same of the camera.
    """
    with read_record(Path(path), "a trocar", _SCHEMA) as record, record.building():
        camera = read_camera(Path(path).parent / record.text("camera"))
        play = record.number("play_mm", Trocar.play_mm)
        return Trocar(camera, record.floats("pivot_mm", 3), record.floats("axis", 3), play)


def _instrument(record: Record) -> Instrument:
    with record.building():
        return Instrument(
            record.text("name"),
            record.number("length_mm"),
            record.texts("colours"),
            record.number("wheel_mm", Instrument.wheel_mm),
        )


def _instrument_table(instrument: Instrument) -> dict[str, Any]:
    return {
        "name": instrument.name,
        "length_mm": float(instrument.length_mm),
        "wheel_mm": float(instrument.wheel_mm),
        "colours": list(instrument.colours),
    }
