"""`glisson correct`: the liver's mask corrected by clicks, or by slices that were drawn."""

import argparse
import time
from collections.abc import Callable

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.options import add_case, point_from_text
from glisson.cli.progress import StageLines
from glisson.core.errors import BadInput
from glisson.framework.case import open_case
from glisson.framework.correcting import correct_by_clicks, correct_by_slices, suggest_slices
from glisson.preoperative.correction.clicked_mask import Click

_KEYS = ("volume_ml", "volume_before_ml", "clicks", "suggested_slices", "seconds")


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
    parser.add_argument(
        "--slices", metavar="MASK", help="a mask that is right in some axial slices, which the others then follow"
    )
    parser.add_argument(
        "--numbers", metavar="K,K", type=_numbers,
        help="which slices of MASK are right, counted from 0; default: all in which it has a voxel",
    )  # fmt: skip
    parser.add_argument(
        "--suggest", metavar="N", type=_count, help="change nothing, but say which N slices to draw (next)"
    )


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    if arguments.clicks and (arguments.slices or arguments.suggest):
        raise BadInput("Clicks and drawn slices are corrections of their own; give one after the other.")
    if arguments.numbers is not None and arguments.slices is None:
        raise BadInput("--numbers says which slices of a drawn mask are right; give that mask with --slices MASK.")
    if arguments.suggest is not None:
        return _suggestions(arguments)
    if not arguments.clicks and not arguments.slices:
        raise BadInput(
            "There is nothing to correct; give --add X,Y,Z or --remove X,Y,Z (LPS mm), or --slices MASK, see --help."
        )
    started = time.perf_counter()
    case = open_case(arguments.case)
    if arguments.clicks:
        progress = lines.begun("correct", "clicks were given")
        before, after = correct_by_clicks(case, arguments.clicks, progress)
    else:
        progress = lines.begun("correct", "drawn slices were given")
        before, after = correct_by_slices(case, arguments.slices, arguments.numbers, progress)
    seconds = time.perf_counter() - started
    lines.ended("correct", seconds)
    values = {"volume_ml": after, "volume_before_ml": before, "clicks": len(arguments.clicks or ()), "seconds": seconds}
    return Answer(dict.fromkeys(_KEYS) | values, f"liver     {after:.0f} ml, {before:.0f} ml before")


def _suggestions(arguments: argparse.Namespace) -> Answer:
    numbers = suggest_slices(open_case(arguments.case), arguments.suggest, arguments.slices, arguments.numbers)
    words = ", ".join(f"slice {number}" for number in numbers)
    return Answer(dict.fromkeys(_KEYS) | {"suggested_slices": list(numbers)}, f"look at   {words}")


def _click(is_organ: bool) -> Callable[[str], Click]:
    return lambda text: Click(point_from_text(text), is_organ)


def _numbers(text: str) -> tuple[int, ...]:
    numbers = text.split(",")
    if not all(number.isdecimal() for number in numbers):
        raise BadInput(f"Slice numbers are written K,K,K, for example 12,30,48, not {text!r}.")
    return tuple(int(number) for number in numbers)


def _count(text: str) -> int:
    if not text.isdecimal() or int(text) == 0:
        raise BadInput(f"--suggest needs a whole number of slices, 1 or more, not {text!r}.")
    return int(text)


COMMAND = Command(
    "correct",
    "  glisson correct liver --add -60,10,120\n  glisson correct liver --remove 20,-5,90 --remove 31,0,96 --json\n"
    "  glisson correct liver --suggest 10\n  glisson correct liver --slices drawn.nii.gz",
    _add_arguments,
    _run,
    _KEYS,
)
