"""`glisson correct`: the liver's mask corrected by clicks."""

import argparse
import time
from collections.abc import Callable

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.options import add_case, point_from_text
from glisson.cli.progress import StageLines
from glisson.core.errors import BadInput
from glisson.framework.case import open_case
from glisson.framework.correcting import correct_by_clicks
from glisson.preoperative.correction.clicked_mask import Click


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    add_case(parser)
    for flag, is_organ, words in (
        ("--add", True, "into liver that is missing"),
        ("--remove", False, "into what is not liver"),
    ):
        parser.add_argument(
            flag, metavar="X,Y,Z", action="append", dest="clicks", type=_click(is_organ),
            help=f"a click {words}, LPS mm; may be repeated, and all are applied in their order",
        )  # fmt: skip


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    if not arguments.clicks:
        raise BadInput("There is nothing to correct; give --add X,Y,Z or --remove X,Y,Z (LPS mm), see --help.")
    started = time.perf_counter()
    progress = lines.begun("correct", "clicks were given")
    before, after = correct_by_clicks(open_case(arguments.case), arguments.clicks, progress)
    seconds = time.perf_counter() - started
    lines.ended("correct", seconds)
    values = {"volume_ml": after, "volume_before_ml": before, "clicks": len(arguments.clicks), "seconds": seconds}
    return Answer(values, f"liver     {after:.0f} ml, {before:.0f} ml before")


def _click(is_organ: bool) -> Callable[[str], Click]:
    return lambda text: Click(point_from_text(text), is_organ)


COMMAND = Command(
    "correct",
    "  glisson correct liver --add -60,10,120\n  glisson correct liver --remove 20,-5,90 --remove 31,0,96 --json",
    _add_arguments,
    _run,
    ("volume_ml", "volume_before_ml", "clicks", "seconds"),
)
