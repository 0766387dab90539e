"""Points, curves and planes as 3D Slicer keeps them (`.mrk.json`); written in LPS mm, read in LPS or RAS.

Reference: Slicer's markups schema 1.0.3. A file that does not say which of the two systems it uses is
refused, since taking one for the other swaps left and right.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from glisson.core import BadInput, Curve, Plane
from glisson.core.arrays import FloatArray, frozen_floats
from glisson.io.decoding import check_file_size, decoding
from glisson.io.records import Record, load_json, write_json

_SCHEMA = (
    "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/"
    "markups-schema-v1.0.3.json#"
)
_SIGNS = {"LPS": (1.0, 1.0, 1.0), "RAS": (-1.0, -1.0, 1.0)}
_OLD_CODES = {0: "RAS", 1: "LPS"}
_MM_PER_UNIT = {"mm": 1.0, "um": 0.001}
# Slicer flips the first two rows of each matrix of an LPS file, this one included.
_IDENTITY_IN_LPS = np.diag([-1.0, -1.0, 1.0, 1.0])


@dataclass(frozen=True, eq=False)
class NamedPoints:
    """Points (n, 3) in LPS mm with a label each."""

    labels: tuple[str, ...]
    points_mm: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "points_mm", frozen_floats(self.points_mm, (len(self.labels), 3), "points"))


def read_points(path: str | Path) -> NamedPoints:
    """All points of the first point list ("Fiducial") of a file; points not yet placed are left out.

    Raises:
        BadInput: absent, damaged, no point list, or no stated coordinate system.
    """
    with decoding(path, "Slicer markups"):
        return _control_points(_first(Path(path), ("Fiducial",)))


def read_curve(path: str | Path) -> Curve:
    """The polyline through the control points of the first open curve or line of a file.

    Raises:
        BadInput: absent, damaged, no curve, fewer than two points, or no stated coordinate system.
    """
    with decoding(path, "Slicer markups"):
        return Curve(_control_points(_first(Path(path), ("Curve", "Line"))).points_mm)


def read_plane(path: str | Path) -> Plane:
    """The first plane of a file, from its centre and normal or from three control points.

    Raises:
        BadInput: absent, damaged, no plane, points on a line, or no stated coordinate system.
    """
    with decoding(path, "Slicer markups"):
        record = _first(Path(path), ("Plane",))
        signs, scale = _system(record)
        if record.has("normal") and record.has("center"):
            return Plane(record.floats("center", 3) * signs * scale, record.floats("normal", 3) * signs)
        points = _control_points(record).points_mm
        if len(points) != 3:
            raise BadInput(f"a plane without centre and normal needs three points, not {len(points)}.")
        normal = np.cross(points[1] - points[0], points[2] - points[0])
        if np.linalg.norm(normal) == 0.0:
            raise BadInput("the three points of its plane lie on a line.")
        return Plane(points[0], normal)


def write_points(path: str | Path, points: NamedPoints, name: str = "points") -> None:
    """Write a point list; atomic.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    _write(path, "Fiducial", name, points.points_mm, points.labels, {})


def write_curve(path: str | Path, curve: Curve, name: str = "curve") -> None:
    """Write a curve whose control points are joined by straight lines; atomic.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    labels = [f"{name}-{number}" for number in range(1, len(curve.points_mm) + 1)]
    _write(path, "Curve", name, curve.points_mm, labels, {"curveType": "linear"})


def write_plane(path: str | Path, plane: Plane, name: str = "plane", size_mm: float = 100.0) -> None:
    """Write a plane, shown as a square of the given size; atomic.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    axes = _axes(plane.normal)
    base = np.eye(4)
    base[:3, :3] = axes
    base[:3, 3] = plane.point_mm
    half = size_mm / 2.0
    extra = {
        "planeType": "pointNormal",
        "sizeMode": "absolute",
        "center": plane.point_mm,
        "normal": plane.normal,
        "objectToBase": _IDENTITY_IN_LPS.ravel(),
        "baseToNode": base.ravel(),
        "orientation": axes.ravel(),
        "size": [size_mm, size_mm, 0.0],
        "planeBounds": [-half, half, -half, half],
    }
    _write(path, "Plane", name, plane.point_mm[None, :], [name], extra)


def _write(
    path: str | Path, kind: str, name: str, points: FloatArray, labels: Sequence[str], extra: dict[str, Any]
) -> None:
    target = Path(path)
    if not target.name.endswith(".mrk.json"):
        raise BadInput(f"{target}: Slicer knows markups by the ending .mrk.json.")
    markup = {
        "type": kind,
        "name": name,
        "coordinateSystem": "LPS",
        "coordinateUnits": "mm",
        "labelFormat": "%N-%d",
        **extra,
        "controlPoints": [
            {"id": str(number), "label": label, "position": point, "positionStatus": "defined"}
            for number, (label, point) in enumerate(zip(labels, points, strict=True), start=1)
        ],
    }
    write_json(target, {"@schema": _SCHEMA, "markups": [markup]})


def _first(path: Path, kinds: tuple[str, ...]) -> Record:
    check_file_size(path)
    markups = Record(load_json(path)).records("markups")
    for markup in markups:
        if markup.text("type") in kinds:
            return markup
    found = [markup.text("type") for markup in markups]
    raise BadInput(f"it holds no {' or '.join(kinds)}, only {found}.")


def _system(record: Record) -> tuple[FloatArray, float]:
    """Signs that take its axes to LPS, and mm per unit."""
    if not record.has("coordinateSystem"):
        raise BadInput('it does not state its coordinate system; add "coordinateSystem": "LPS" or "RAS" to the markup.')
    stated = record.value("coordinateSystem")
    # Slicer before 4.11 wrote the number of its enumeration.
    code = int(stated) if str(stated) in ("0", "1") else None
    system = _OLD_CODES[code] if code is not None else str(stated)
    if system not in _SIGNS:
        raise BadInput(f"its coordinate system {stated!r} is neither LPS nor RAS.")
    unit = record.value("coordinateUnits") if record.has("coordinateUnits") else "mm"
    unit = unit[0] if isinstance(unit, list) and unit else unit
    if not isinstance(unit, str) or unit not in _MM_PER_UNIT:
        raise BadInput(f"its unit of length {unit!r} is neither mm nor um.")
    return np.array(_SIGNS[system]), _MM_PER_UNIT[unit]


def _control_points(record: Record) -> NamedPoints:
    signs, scale = _system(record)
    placed = [
        point for point in record.records("controlPoints") if point.text("positionStatus", "defined") == "defined"
    ]
    points = [point.floats("position", 3) * signs * scale for point in placed]
    labels = tuple(point.text("label", "") for point in placed)
    return NamedPoints(labels, np.reshape(points, (-1, 3)))


def _axes(normal: FloatArray) -> FloatArray:
    """Right-handed axes as columns, the third along the normal."""
    away = np.eye(3)[int(np.abs(normal).argmin())]
    first = np.cross(away, normal)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first), normal], axis=1)
