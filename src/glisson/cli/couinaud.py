"""`glisson couinaud`: the liver's segments."""

import argparse
import time

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.options import add_case
from glisson.cli.progress import StageLines
from glisson.framework.case import LANDMARKS, SEGMENTS, SEGMENTS_PICTURE, open_case
from glisson.framework.dividing import BY_BRANCHES, BY_PLANES, divide_liver


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    add_case(parser)
    parser.add_argument(
        "--landmarks", metavar="FILE", help="a point list of 3D Slicer (.mrk.json), see docs/segments.md"
    )
    parser.add_argument(
        "--technique",
        metavar="NAME",
        help=f"a segment divider, see glisson techniques; by default {BY_BRANCHES} where the portal vein is known, "
        f"else {BY_PLANES}",
    )
    parser.add_argument(
        "--right-of-middle-vein-mm",
        metavar="VALUE",
        help="how far right of the middle hepatic vein's axis the left and right liver part",
    )


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    started = time.perf_counter()
    beside = arguments.right_of_middle_vein_mm
    parameters = {} if beside is None else {"right_of_middle_vein_mm": beside}
    progress = lines.begun("couinaud", "it was asked for")
    case = open_case(arguments.case)
    found = divide_liver(case, arguments.landmarks, arguments.technique, parameters, progress)
    seconds = time.perf_counter() - started
    lines.ended("couinaud", seconds)
    values = {
        "technique": found.technique, "landmarks_proposed": found.proposed, "volumes_ml": dict(found.volumes_ml),
        "seconds": seconds,
    }  # fmt: skip
    text = [f"{name} {volume:.0f} ml" for name, volume in found.volumes_ml.items()]
    text += [
        f"technique {found.technique}",
        f"written   {case.path(SEGMENTS)}",
        f"picture   {case.path(SEGMENTS_PICTURE)}",
    ]
    if found.proposed:
        text.append(f"look at   the landmarks were only proposed; move them in {case.path(LANDMARKS)} and run again")
    return Answer(values, "\n".join(text))


COMMAND = Command(
    "couinaud",
    "  glisson couinaud liver --landmarks landmarks.mrk.json\n  glisson couinaud liver --technique planes --json",
    _add_arguments,
    _run,
    ("technique", "landmarks_proposed", "volumes_ml", "seconds"),
)
