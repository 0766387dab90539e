"""`glisson instruments`: the library of instruments, and instruments seen by a trocar's camera."""

import argparse
import time
from collections.abc import Callable

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.instrument_text import library_answer, recognised_answer, timeline_answer
from glisson.cli.progress import StageLines
from glisson.core.errors import BadInput
from glisson.core.instruments import SECTORS, Instrument
from glisson.framework.instrument_timeline import timeline_of_video
from glisson.framework.instruments import add_instrument, library_or_example, recognise_picture
from glisson.intraoperative.instruments.codes import alike_codes

_EXAMPLES = {
    "list": "  glisson instruments list --library instruments.toml",
    "check": "  glisson instruments check --library instruments.toml",
    "add": "  glisson instruments add grasper --length-mm 330 --library instruments.toml",
    "recognise": "  glisson instruments recognise view.png --trocar trocar.toml --library instruments.toml "
    "--layout layout.toml",
    "timeline": "  glisson instruments timeline trocar.mp4 --trocar trocar.toml --every 5 --out timeline --json",
}

_KEYS = ("instrument", "code", "distance_mm", "angle_deg", "tip_mm", "tip_covariance_mm2", "room", "picture", "seconds")


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION", parser_class=type(parser))
    about: dict[str, tuple[Callable[[argparse.ArgumentParser], None], str]] = {
        "list": (_add_library, "list the instruments of a library"),
        "check": (_add_library, "check that no two codes of a library may be mistaken for each other"),
        "add": (_add_new, "add an instrument to a library, with a free code or with your own"),
        "recognise": (
            _add_recognise,
            "tell which instrument a picture of a trocar's camera shows, and where its tip is",
        ),
        "timeline": (_add_timeline, "tell when which instrument was in use in a video of a trocar's camera"),
    }
    for name, (add, summary) in about.items():
        made = actions.add_parser(
            name, help=summary, description=summary, allow_abbrev=False, epilog=f"examples:\n{_EXAMPLES[name]}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )  # fmt: skip
        add(made)
        made.add_argument("--json", action="store_true", help="print one JSON object on stdout, all else on stderr")
        made.add_argument("--debug", action="store_true", help=argparse.SUPPRESS)


def _add_library(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--library", metavar="FILE", help="instruments.toml; by default the one that comes with Glisson"
    )


def _add_new(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="NAME", help="of the instrument")
    parser.add_argument("--library", metavar="FILE", required=True, help="instruments.toml; made where there is none")
    parser.add_argument("--length-mm", metavar="MM", required=True, help="from the wheel to the tip")
    parser.add_argument(
        "--wheel-mm", metavar="MM", default=str(Instrument.wheel_mm), help="diameter of the wheel, default 40"
    )
    parser.add_argument(
        "--colours", metavar="C,C,C,C,C,C", help="of the sectors, anticlockwise; by default a code far from all others"
    )


def _add_seen(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--trocar", metavar="FILE", required=True, help="trocar.toml: its camera, pivot and axis")
    _add_library(parser)
    parser.add_argument(
        "--layout", metavar="FILE", help="layout.toml of crosses that are seen, too: the tip in the room"
    )


def _add_recognise(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("image", metavar="IMAGE", help="a picture of the trocar's camera, PNG or JPEG")
    _add_seen(parser)
    parser.add_argument("--out", metavar="PICTURE", help="what was seen, as PNG; by default beside the image")


def _add_timeline(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("video", metavar="VIDEO", help="a video of the trocar's camera")
    _add_seen(parser)
    parser.add_argument("--every", metavar="N", default="1", help="look at one frame of so many, default 1")
    parser.add_argument("--gap-s", metavar="S", default="1", help="not seen for longer is taken out, default 1 s")
    parser.add_argument("--out", metavar="DIR", default="timeline", help="folder for results (default: timeline)")


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    action = arguments.action
    if action == "list":
        return library_answer(library_or_example(arguments.library))
    if action == "check":
        library = library_or_example(arguments.library)
        return library_answer(library, alike_codes(library))
    if action == "add":
        added = _added(arguments)
        return library_answer(library_or_example(arguments.library), added=added)
    started = time.perf_counter()
    progress = lines.begun(action, "it was asked for")
    if action == "recognise":
        done = recognise_picture(arguments.image, arguments.trocar, arguments.library, arguments.layout, arguments.out)
        answer = recognised_answer(done)
    else:
        every, gap = _number(arguments.every, "--every", 1.0), _number(arguments.gap_s, "--gap-s", 0.0)
        if every != int(every):
            raise BadInput(f"--every must be a whole number, not {arguments.every!r}.")
        told = timeline_of_video(
            arguments.video, arguments.trocar, arguments.out, arguments.library, arguments.layout, int(every), gap,
            progress,
        )  # fmt: skip
        answer = timeline_answer(told, arguments.out)
    seconds = time.perf_counter() - started
    lines.ended(action, seconds)
    return Answer({**answer.values, "seconds": seconds}, answer.text)


def _added(arguments: argparse.Namespace) -> Instrument:
    colours = None
    if arguments.colours is not None:
        colours = tuple(part.strip() for part in arguments.colours.split(","))
        if len(colours) != SECTORS:
            raise BadInput(f"--colours needs {SECTORS} colours with commas between them, not {arguments.colours!r}.")
    length, wheel = (_number(text, option, 0.0) for text, option in
                     ((arguments.length_mm, "--length-mm"), (arguments.wheel_mm, "--wheel-mm")))  # fmt: skip
    return add_instrument(arguments.library, arguments.name, length, wheel, colours)


def _number(text: str, option: str, least: float) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not least <= value < float("inf"):
        raise BadInput(f"{option} must be a number of at least {least:g}, not {text!r}.")
    return value


COMMAND = Command("instruments", "\n".join(_EXAMPLES.values()), _add_arguments, _run, _KEYS)
