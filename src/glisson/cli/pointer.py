"""`glisson pointer`: points, distances, strokes and a resection plane by the tip of an instrument."""

import argparse
from typing import Any

import numpy as np

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.options import point_from_text
from glisson.cli.progress import StageLines
from glisson.core.errors import BadInput
from glisson.core.status import Status
from glisson.framework.pointing import Pointed, Resection, Span, point_and_draw
from glisson.intraoperative.pointer.measuring import Length
from glisson.intraoperative.pointer.resection import DrawnPlane

_KEYS = ("status", "message", "frame", "points", "distances", "strokes", "plane", "files")


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("tips", metavar="TIPS", help="tips.json, as glisson instruments timeline writes it")
    parser.add_argument("--instrument", metavar="NAME", required=True, help="whose tip is the pointer")
    parser.add_argument(
        "--point", metavar="NAME,FROM,TO", action="append", default=[], type=_span,
        help="the tip rested on this point from one time (s) to another; may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--stroke", metavar="NAME,FROM,TO", action="append", default=[], type=_span,
        help="the tip drew this line on the organ; may be repeated",
    )  # fmt: skip
    parser.add_argument("--resection", metavar="NAME", help="the stroke that is a resection line")
    parser.add_argument(
        "--towards", metavar="X,Y,Z", type=point_from_text, help="direction to the side that is removed"
    )
    parser.add_argument("--into", metavar="X,Y,Z", type=point_from_text, help="direction of the cut, for a surface")
    parser.add_argument("--depth-mm", metavar="MM", default="100", help="depth of that surface, default 100")
    parser.add_argument("--out", metavar="DIR", default="pointer", help="folder for results (default: pointer)")


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    if not arguments.point and not arguments.stroke:
        raise BadInput("Give at least one --point or --stroke.")
    done = point_and_draw(
        arguments.tips, arguments.instrument, arguments.point, arguments.stroke, _resection(arguments), arguments.out
    )
    status, message = Status.CONVERGED, Status.CONVERGED.sentence
    if done.plane is not None and not done.plane.status.is_good:
        status, message = done.plane.status, _open_tilt(done.plane)
    values = {"status": status, "message": message} | _values(done)
    return Answer(values, _text(done), 0 if status.is_good else 1)


def _resection(arguments: argparse.Namespace) -> Resection | None:
    if arguments.resection is None:
        if arguments.towards is not None or arguments.into is not None:
            raise BadInput("--towards and --into say where a --resection goes; name its stroke.")
        return None
    if arguments.towards is None:
        raise BadInput("--resection needs --towards, a direction to the side that is removed.")
    into = None if arguments.into is None else np.array(arguments.into)
    try:
        depth = float(arguments.depth_mm)
    except ValueError:
        raise BadInput(f"--depth-mm must be a number, not {arguments.depth_mm!r}.") from None
    return Resection(arguments.resection, np.array(arguments.towards), into, depth)


def _values(done: Pointed) -> dict[str, Any]:
    plane = done.plane
    return {
        "frame": done.frame,
        "points": {
            name: {"point_mm": point.point_mm.tolist(), "covariance_mm2": point.covariance_mm2.tolist()}
            for name, point in done.points.items()
        },
        "distances": [{"from": a, "to": b, **_length(found)} for (a, b), found in done.distances.items()],
        "strokes": {name: _length(found) for name, found in done.strokes.items()},
        "plane": None
        if plane is None or not plane.status.is_good
        else {
            "point_mm": plane.plane.point_mm.tolist(),
            "normal": plane.plane.normal.tolist(),
            "covariance": plane.covariance.tolist(),
            "tilt_sigma_deg": float(np.degrees(plane.tilt_sigma_rad)),
            "rms_mm": plane.rms_mm,
            "misfit": plane.misfit,
        },
        "files": [str(file) for file in done.files],
    }


def _length(found: Length) -> dict[str, float]:
    return {"mm": found.mm, "sigma_mm": found.sigma_mm}


def _text(done: Pointed) -> str:
    lines = []
    for name, point in done.points.items():
        sigma = float(np.sqrt(np.linalg.eigvalsh(point.covariance_mm2)[-1]))
        x, y, z = point.point_mm
        lines.append(f"point     {name}: ({x:.2f}, {y:.2f}, {z:.2f}) ± {sigma:.2f} mm in the frame {done.frame}")
    lines += [f"distance  {a} to {b}: {one.mm:.2f} ± {one.sigma_mm:.2f} mm" for (a, b), one in done.distances.items()]
    lines += [f"stroke    {name}: {one.mm:.1f} ± {one.sigma_mm:.1f} mm long" for name, one in done.strokes.items()]
    plane = done.plane
    if plane is not None and not plane.status.is_good:
        lines.append(f"plane     {plane.status}: {_open_tilt(plane)}")
    elif plane is not None:
        x, y, z = plane.plane.normal
        lines.append(
            f"plane     normal ({x:.4f}, {y:.4f}, {z:.4f}) ± {np.degrees(plane.tilt_sigma_rad):.2f}°, the line "
            f"{plane.rms_mm:.2f} mm off it"
        )
    return "\n".join(lines + [f"written   {file}" for file in done.files])


def _open_tilt(plane: DrawnPlane) -> str:
    return (
        f"The line that was drawn is nearly straight and leaves the plane's tilt open "
        f"(± {np.degrees(plane.tilt_sigma_rad):.0f}°); draw it on round a curve of the organ."
    )


def _span(text: str) -> Span:
    name, *times = (part.strip() for part in text.rsplit(",", 2))
    try:
        begin, end = (float(time) for time in times)
    except ValueError:
        begin, end = 1.0, 0.0
    if not (name and -float("inf") < begin <= end < float("inf")):
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME,FROM,TO, such as edge,12.5,18")
    return Span(name, begin, end)


COMMAND = Command(
    "pointer",
    "  glisson pointer timeline/tips.json --instrument pointer --point a,3,4 --point b,6,7\n"
    "  glisson pointer timeline/tips.json --instrument pointer --stroke cut,10,18 --resection cut --towards 1,0,0 "
    "--into 0,1,0",
    _add_arguments,
    _run,
    _KEYS,
)
