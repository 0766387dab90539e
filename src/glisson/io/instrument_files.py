"""Libraries of instruments (`instruments.toml`), for people to read and change, and trocars (`trocar.toml`)."""

from pathlib import Path
from typing import Any

import tomli_w

from glisson.core.camera import Camera
from glisson.core.instruments import Instrument, InstrumentLibrary
from glisson.core.trocar import Trocar
from glisson.io.atomic import atomic_path
from glisson.io.records import Record, read_record

EXAMPLE_LIBRARY = Path(__file__).with_name("data") / "instruments.toml"
"""Ten instruments that come with Glisson."""

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
    _write(path, {"instruments": [_instrument_table(instrument) for instrument in library.instruments]})


def read_trocar(path: str | Path) -> Trocar:
    """Read a trocar: its camera, its pivot and its channel's axis.

    Raises:
        BadInput: absent, damaged, or with an impossible value, named by its key path.
    """
    with read_record(Path(path), "a trocar", _SCHEMA) as record, record.building():
        camera = record.record("camera")
        return Trocar(
            _camera(camera),
            record.floats("pivot_mm", 3),
            record.floats("axis", 3),
            record.number("play_mm", Trocar.play_mm),
        )


def write_trocar(path: str | Path, trocar: Trocar) -> None:
    """Write a trocar; atomic.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    camera = trocar.camera
    table: dict[str, Any] = {
        "width": camera.width,
        "height": camera.height,
        "focal_px": camera.focal_px.tolist(),
        "centre_px": camera.centre_px.tolist(),
        "distortion": camera.distortion.tolist(),
    }
    if camera.covariance is not None:
        table["covariance"] = camera.covariance.tolist()
    values = {"pivot_mm": trocar.pivot_mm.tolist(), "axis": trocar.axis.tolist(), "play_mm": float(trocar.play_mm)}
    _write(path, values | {"camera": table})


def _write(path: str | Path, values: dict[str, Any]) -> None:
    with atomic_path(path) as temporary:
        temporary.write_text(tomli_w.dumps({"schema": _SCHEMA} | values), encoding="utf-8")


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


def _camera(record: Record) -> Camera:
    with record.building():
        return Camera(
            record.whole("width"),
            record.whole("height"),
            record.floats("focal_px", 2),
            record.floats("centre_px", 2),
            record.floats("distortion", 5),
            record.floats("covariance", 9, 9) if record.has("covariance") else None,
        )
