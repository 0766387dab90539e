"""`glisson report`: the report of a case."""

import argparse

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.progress import StageLines
from glisson.cli.running import add_run_arguments, report_text, run_to
from glisson.framework.case import REPORT


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    add_run_arguments(parser, (), ())


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    result = run_to("report", arguments, lines)
    values = {"report": f"{arguments.case}/{REPORT}", "seconds": result.seconds}
    return Answer(values, report_text(arguments.case))


COMMAND = Command(
    "report",
    "  glisson report liver",
    _add_arguments,
    _run,
    ("report", "seconds"),
)
