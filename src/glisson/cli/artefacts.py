"""`glisson artefacts`: streaks of metal and gas lessened."""

import argparse
import time

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.options import add_case
from glisson.cli.progress import StageLines
from glisson.framework.case import ARTEFACTS_PICTURE, open_case
from glisson.framework.cleaning import clean_case, restore_scan

_KEYS = ("metal_ml", "metal_change_hu", "streaked_ml", "lost_ml", "sentences", "seconds")


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    add_case(parser)
    parser.add_argument("--undo", action="store_true", help="put the scan back as it was")


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    case = open_case(arguments.case)
    if arguments.undo:
        restore_scan(case)
        return Answer(dict.fromkeys(_KEYS) | {"sentences": []}, "scan      as it was before")
    started = time.perf_counter()
    progress = lines.begun("artefacts", "it was asked for")
    cleaned = clean_case(case, progress)
    seconds = time.perf_counter() - started
    lines.ended("artefacts", seconds)
    values = {
        "metal_ml": cleaned.metal_ml,
        "metal_change_hu": cleaned.metal_change_hu,
        "streaked_ml": cleaned.streaked_ml,
        "lost_ml": float(cleaned.lost.sum()) * cleaned.volume.grid.voxel_volume_mm3 * 1e-3,
        "sentences": list(cleaned.sentences),
        "seconds": seconds,
    }
    if not cleaned.sentences:
        return Answer(values, "scan      has neither metal nor streaks of gas; it stays as it is")
    text = [f"look at   {sentence}" for sentence in cleaned.sentences]
    return Answer(values, "\n".join([*text, f"picture   {case.path(ARTEFACTS_PICTURE)}"]))


COMMAND = Command(
    "artefacts",
    "  glisson artefacts liver\n  glisson artefacts liver --undo",
    _add_arguments,
    _run,
    _KEYS,
)
