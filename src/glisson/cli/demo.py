"""`glisson demo`: from the phantom's scan to the report, with the truth beside every number."""

import argparse
import time
from pathlib import Path

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.progress import StageLines
from glisson.cli.running import RESULT_KEYS, report_text, results_answer, seconds_text
from glisson.framework.case import SETTINGS
from glisson.framework.comparing import compare_with_reference
from glisson.framework.demo import REFERENCE, demo_case
from glisson.framework.stages import PIPELINE


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", metavar="DIR", default="demo", help="the case folder to make (default: ./demo)")


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    is_new = not (Path(arguments.out) / SETTINGS).exists()
    started = time.perf_counter()
    if is_new:
        lines.begun("phantom", "its scan must be made")
    case = demo_case(arguments.out)
    phantom_seconds = time.perf_counter() - started if is_new else 0.0
    if is_new:
        lines.ended("phantom", phantom_seconds)
    result = PIPELINE.run(case, "report", listener=lines)
    scores = compare_with_reference(case, case.path(REFERENCE))
    seconds = {"phantom": phantom_seconds, **result.seconds}
    answer = results_answer(result, case.folder)
    values = dict(answer.values) | {"seconds": seconds, "dice": scores.dice}
    agreement = f"liver     segmented from one click, Dice {scores.dice:.4f} against the phantom's own mask"
    text = [answer.text, agreement, seconds_text(seconds), report_text(case.folder)]
    return Answer(values, "\n".join(text))


COMMAND = Command(
    "demo",
    "  glisson demo\n  glisson demo --out /tmp/demo --json",
    _add_arguments,
    _run,
    RESULT_KEYS,
)
