"""`glisson localize`: where a trocar is, from an image of its camera."""

import argparse
import time
from typing import Any

import numpy as np

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.progress import StageLines
from glisson.core.localisation import Localisation
from glisson.core.status import Status
from glisson.core.transform import RigidTransform
from glisson.framework.localising import GLOBAL, localise_trocar

_KEYS = (
    "status", "message", "position_mm", "rotation", "covariance", "position_bound_mm", "angle_bound_deg", "second",
    "crosses", "corners", "noise_px", "notes", "picture", "seconds",
)  # fmt: skip


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("image", metavar="IMAGE", help="a picture of the trocar's camera, PNG or JPEG")
    parser.add_argument("--camera", metavar="FILE", required=True, help="camera.toml of the camera that took it")
    parser.add_argument("--layout", metavar="FILE", required=True, help="layout.toml of the crosses in the room")
    parser.add_argument(
        "--technique", metavar="NAME", default=GLOBAL,
        help=f"global or guess-database, see glisson techniques; by default {GLOBAL}",
    )  # fmt: skip
    parser.add_argument("--out", metavar="PICTURE", help="what was seen, as PNG; by default beside the image")


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    started = time.perf_counter()
    lines.begun("localize", "it was asked for")
    done = localise_trocar(arguments.image, arguments.camera, arguments.layout, arguments.technique, out=arguments.out)
    found = done.found
    seconds = time.perf_counter() - started
    lines.ended("localize", seconds)
    values = _values(found) | {"picture": str(done.picture), "seconds": seconds}
    exit_code = 0 if found.status.is_good else 2 if found.status is Status.BAD_INPUT else 1
    return Answer(values, "\n".join([*_lines(found), f"picture   {done.picture}"]), exit_code, exit_code != 0)


def _values(found: Localisation) -> dict[str, Any]:
    return {
        "status": found.status,
        "message": found.message,
        **_pose(found.room_from_trocar),
        "position_bound_mm": found.position_bound_mm,
        "angle_bound_deg": None if found.angle_bound_rad is None else float(np.rad2deg(found.angle_bound_rad)),
        "second": None if found.second is None else _pose(found.second),
        "crosses": list(found.crosses),
        "corners": 0 if found.corners_px is None else len(found.corners_px),
        "noise_px": found.noise_px,
        "notes": list(found.notes),
    }


def _pose(pose: RigidTransform | None) -> dict[str, Any]:
    """`room_from_trocar`: place, rotation by rows, covariance over turn (rad) and shift (mm)."""
    if pose is None:
        return {"position_mm": None, "rotation": None, "covariance": None}
    return {
        "position_mm": pose.translation_mm.tolist(),
        "rotation": pose.rotation.tolist(),
        "covariance": None if pose.covariance is None else pose.covariance.tolist(),
    }


def _lines(found: Localisation) -> list[str]:
    lines = [f"status    {found.status}: {found.message}"]
    if found.crosses:
        corners = 0 if found.corners_px is None else len(found.corners_px)
        lines.append(f"crosses   {', '.join(found.crosses)} ({corners} corners)")
    pose = found.room_from_trocar
    if pose is not None and found.position_bound_mm is not None and found.angle_bound_rad is not None:
        x, y, z = pose.translation_mm
        a, b, c = pose.rotation[:, 2]
        lines += [
            f"position  {x:.2f}, {y:.2f}, {z:.2f} mm in the room; off by more than {found.position_bound_mm:.2f} mm "
            "in one of 10,000 cases",
            f"axis      {a:.5f}, {b:.5f}, {c:.5f} out of the patient; orientation off by more than "
            f"{np.rad2deg(found.angle_bound_rad):.3f}° in one of 10,000 cases",
        ]
    if found.second is not None:
        x, y, z = found.second.translation_mm
        lines.append(f"second    {x:.1f}, {y:.1f}, {z:.1f} mm explains the image as well")
    return lines + [f"look at   {note}" for note in found.notes]


COMMAND = Command(
    "localize",
    "  glisson localize view.png --camera camera.toml --layout layout.toml\n"
    "  glisson localize view.png --camera camera.toml --layout layout.toml --out seen.png --json",
    _add_arguments,
    _run,
    _KEYS,
)
