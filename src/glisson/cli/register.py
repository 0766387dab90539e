"""`glisson register`: the liver as it is now, from sparse observations."""

import argparse
import time
from dataclasses import fields

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.options import add_case
from glisson.cli.progress import StageLines
from glisson.core.registry import list_techniques, technique_class
from glisson.core.units import place_text
from glisson.framework.case import open_case
from glisson.framework.registering import DEFAULT, RegisteredCase, register_case

_KEYS = (
    "status", "message", "technique", "frame", "unobserved", "set_aside", "sigma_mm", "tumours",
    "next_touch_mm", "next_touch", "time_s", "moved_mm", "jumped", "notes", "frames", "folder", "seconds",
)  # fmt: skip


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    add_case(parser)
    parser.add_argument(
        "--observations",
        metavar="FILE",
        nargs="+",
        default=(),
        help="what was seen (see docs/registration.md), several files for frames one after another; default the "
        "case's own",
    )
    parser.add_argument(
        "--technique", metavar="NAME", default=DEFAULT, help=f"see glisson techniques; by default {DEFAULT}"
    )
    for name, words in _explained().items():
        parser.add_argument(f"--{name.replace('_', '-')}", dest=name, metavar="VALUE", help=words)


def _explained() -> dict[str, str]:
    """The parameters of all techniques, each with its help and the techniques that have it."""
    explained: dict[str, tuple[str, list[str]]] = {}
    for listing in list_techniques(("registration",)):
        if listing.is_available:
            for field in fields(technique_class("registration", listing.name).Parameters):
                words = str(field.metadata["help"]).rstrip(".")
                explained.setdefault(field.name, (words, []))[1].append(f"{listing.name}, {_default(field.default)}")
    return {name: f"{words} ({'; '.join(techniques)})" for name, (words, techniques) in explained.items()}


def _default(value: object) -> str:
    return f"default {value:g}" if isinstance(value, (int, float)) else f"default {value}" if value else "no default"


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    started = time.perf_counter()
    parameters = {name: value for name in _explained() if (value := getattr(arguments, name)) is not None}
    case = open_case(arguments.case)
    progress = lines.begun("register", "it was asked for")
    made = register_case(case, arguments.observations, arguments.technique, parameters, progress)
    seconds = time.perf_counter() - started
    lines.ended("register", seconds)
    more = {"folder": str(made.folder), "seconds": seconds}
    return Answer(made.values | more, _text(made), 0 if made.found.status.is_good else 1)


def _text(made: RegisteredCase) -> str:
    values = made.values
    told = [f"status      {values['message']}"]
    if len(values["frames"]) > 1:
        told += [
            f"{frame['time_s']:8.2f} s  {frame['status']}, moved by {frame['moved_mm']:.1f} mm"
            for frame in values["frames"]
        ]
    for tumour in values["tumours"]:
        x, y, z = tumour["after_mm"]
        told.append(
            f"{tumour['name']:11} now at {x:.1f}, {y:.1f}, {z:.1f} mm ({made.found.frame}), within "
            f"{tumour['radius95_mm']:.1f} mm by 95 %"
        )
    told.append(f"elsewhere   known to {values['sigma_mm']:.1f} mm (one standard deviation, median of the nodes)")
    if (touch := values["next_touch"]) is not None:
        told.append(
            f"touch next  the surface at {place_text(values['next_touch_mm'])}: {touch['tumour']} is then expected to "
            f"be off by {touch['rms_after_mm']:.1f} mm (root mean square) instead of {touch['rms_before_mm']:.1f} mm"
        )
    if made.found.set_aside > 0.0:
        told.append(f"set aside   {100.0 * made.found.set_aside:.0f} % of the observed points as outliers")
    told += [f"look at     {note}" for note in made.found.notes]
    return "\n".join([*told, f"written     {made.folder}"])


COMMAND = Command(
    "register",
    "  glisson register liver\n"
    "  glisson register liver --observations swab.json --technique free\n"
    "  glisson register liver --observations frame-1.json frame-2.json frame-3.json\n"
    "  glisson register liver --motion-mm 5 --json",
    _add_arguments,
    _run,
    _KEYS,
)
