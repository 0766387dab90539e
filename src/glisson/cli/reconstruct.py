"""`glisson reconstruct`: surface points from two or more laparoscope views and one touched point."""

import argparse
import time
from dataclasses import fields
from pathlib import Path

import numpy as np

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.progress import StageLines
from glisson.framework.reconstructing import JOINT, Reconstructed, reconstruct_session
from glisson.intraoperative.views.parameters import ReconstructionParameters

_KEYS = (
    "status", "technique", "landmarks", "surface_points", "features", "parallax_deg", "tips_found", "notes",
    "observations", "picture", "seconds",
)  # fmt: skip


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "session", metavar="SESSION", help="the session file (TOML or JSON, see docs/reconstruction.md)"
    )
    parser.add_argument(
        "--technique", metavar="NAME", default=JOINT,
        help=f"bundle or construction, see glisson techniques; by default {JOINT}",
    )  # fmt: skip
    for field in fields(ReconstructionParameters):
        words = str(field.metadata["help"]).rstrip(".")
        flag = f"--{field.name.replace('_', '-')}"
        parser.add_argument(flag, dest=field.name, metavar="MM", help=f"{words}, default {field.default:g}")
    parser.add_argument(
        "--out", metavar="DIR", help="folder of observations.json and views.png (default: the session's)"
    )


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    started = time.perf_counter()
    progress = lines.begun("reconstruct", "it was asked for")
    given = {field.name: getattr(arguments, field.name) for field in fields(ReconstructionParameters)}
    parameters = {name: value for name, value in given.items() if value is not None}
    out = Path(arguments.out) if arguments.out else Path(arguments.session).parent
    made = reconstruct_session(arguments.session, out, arguments.technique, parameters, progress)
    seconds = time.perf_counter() - started
    lines.ended("reconstruct", seconds)
    values, text = _told(made, arguments.technique)
    return Answer(values | {"seconds": seconds}, "\n".join(text), 0 if made.found.status.is_good else 1)


def _told(made: Reconstructed, technique: str) -> tuple[dict[str, object], list[str]]:
    landmarks = [
        {
            "name": item.name,
            "point_mm": item.points_mm[0].tolist(),
            "sigma_mm": np.sqrt(np.linalg.eigvalsh(item.covariance_mm2[0])[::-1]).tolist(),
        }
        for item in made.found.observations.items
        if item.kind == "landmark" and item.covariance_mm2 is not None
    ]
    points = sum(len(item.points_mm) for item in made.found.observations.items if item.kind == "surface")
    angle = float(np.degrees(made.found.parallax_rad))
    values: dict[str, object] = {
        "status": made.found.status,
        "technique": technique,
        "landmarks": landmarks,
        "surface_points": points,
        "features": made.views.features.count,
        "parallax_deg": angle,
        "tips_found": list(made.tips_found),
        "notes": list(made.found.notes),
        "observations": str(made.observations),
        "picture": str(made.picture),
    }
    text = [
        f"views       {len(made.views.views)}, {angle:.2f}° apart at the surface",
        f"status      {made.found.status}",
    ]
    for mark in landmarks:
        x, y, z = mark["point_mm"]
        text.append(
            f"landmark    {mark['name']} at {x:.2f}, {y:.2f}, {z:.2f} mm, error bar {mark['sigma_mm'][0]:.2f} mm"
        )
    counted = "1 point" if points == 1 else f"{points} points"
    text.append(f"surface     {counted} of {made.views.features.count} features and the touched point")
    text += [f"look at     {note}" for note in made.found.notes]
    return values, [*text, f"written     {made.observations}", f"picture     {made.picture}"]


COMMAND = Command(
    "reconstruct",
    "  glisson reconstruct session.toml\n"
    "  glisson reconstruct session.toml --technique construction --json\n"
    "  glisson reconstruct session.toml --worst-mm 5 --out seen",
    _add_arguments,
    _run,
    _KEYS,
)
