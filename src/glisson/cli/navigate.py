"""`glisson navigate`: tumours, planes and volumes in the deformed liver."""

import argparse

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.options import add_seed_points
from glisson.cli.progress import StageLines
from glisson.cli.running import RESULT_KEYS, add_run_arguments, results_answer, run_to
from glisson.framework.settings import TO_REPORT


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    add_run_arguments(parser, TO_REPORT, ("scenario", "plane"))
    add_seed_points(parser)


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    return results_answer(run_to("navigate", arguments, lines), arguments.case)


COMMAND = Command(
    "navigate",
    "  glisson navigate liver\n  glisson navigate liver --plane.distance-mm 10 --json",
    _add_arguments,
    _run,
    RESULT_KEYS,
)
