"""`glisson simulate`: the manoeuvre's deformation."""

import argparse

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.progress import StageLines
from glisson.cli.running import add_run_arguments, run_to, seconds_text


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    add_run_arguments(parser, ("surface", "mesh", "simulate"), ("scenario",))


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    result = run_to("simulate", arguments, lines)
    facts = result.facts["simulate"]
    text = f"{facts['message']}\n{seconds_text(result.seconds)}"
    return Answer(dict(facts) | {"seconds": result.seconds}, text)


COMMAND = Command(
    "simulate",
    "  glisson simulate liver\n  glisson simulate liver --scenario.angle-deg 30 --simulate.element T4",
    _add_arguments,
    _run,
    ("status", "message", "load_steps", "iterations", "events", "estimated_error_mm", "seconds"),
)
