"""`glisson run`: all stages that are out of date."""

import argparse

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.options import add_seed_points
from glisson.cli.progress import StageLines
from glisson.cli.running import RESULT_KEYS, add_run_arguments, report_text, results_answer, run_to, seconds_text
from glisson.framework.settings import TO_REPORT


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    add_run_arguments(parser, TO_REPORT, ("scenario", "plane"))
    add_seed_points(parser)


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    result = run_to("report", arguments, lines)
    answer = results_answer(result, arguments.case)
    text = "\n".join([answer.text, seconds_text(result.seconds), report_text(arguments.case)])
    return Answer(answer.values, text)


COMMAND = Command(
    "run",
    "  glisson run liver\n  glisson run liver --seed-point -60,10,120 --mesh.edge-length-mm 6 --json",
    _add_arguments,
    _run,
    RESULT_KEYS,
)
