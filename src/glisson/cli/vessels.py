"""`glisson vessels`: portal and hepatic veins."""

import argparse
import time
from collections.abc import Mapping
from typing import Any

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.progress import StageLines
from glisson.cli.running import add_run_arguments, run_to
from glisson.framework.case import open_case
from glisson.framework.comparing import compare_vessels


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    add_run_arguments(parser, ("vessels",), ())
    for name, words in (("portal", "the portal vein enters the liver"), ("hepatic", "a hepatic vein leaves the liver")):
        parser.add_argument(
            f"--{name}", metavar="X,Y,Z", action="append",
            help=f"a click where {words}, LPS mm; may be repeated, also for large branches",
        )  # fmt: skip
    parser.add_argument(
        "--reference", metavar="MASK", help="masks of the veins to compare with: a file or a folder of DICOM folders"
    )


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    started = time.perf_counter()
    facts = run_to("vessels", arguments, lines).facts["vessels"]
    values = dict(facts)
    text = [_system(name, facts) for name in facts["volume_ml"]]
    text += [f"from      {facts['source']}", *(f"look at   {note}" for note in facts["notes"])]
    if arguments.reference is not None:
        scores = compare_vessels(open_case(arguments.case), arguments.reference)
        values |= scores
        told = "" if scores["right_system"] is None else f", {100.0 * scores['right_system']:.1f} % in the right system"
        text.append(f"reference Dice {scores['dice']:.4f}, centreline Dice {scores['centreline_dice']:.4f}{told}")
    values["seconds"] = time.perf_counter() - started
    return Answer(values, "\n".join(text))


def _system(name: str, facts: Mapping[str, Any]) -> str:
    own = [length for tree, length in facts["length_mm"].items() if tree.partition(" ")[0] == name]
    lines = f", {sum(own):.0f} mm of centreline in {len(own)} tree{'' if len(own) == 1 else 's'}" if own else ""
    return f"{name:9s} {facts['volume_ml'][name]:.1f} ml{lines}"


COMMAND = Command(
    "vessels",
    "  glisson vessels liver --portal -9,-8,-9 --hepatic -12,-24,44\n"
    "  glisson vessels liver --vessels.technique top-hat --json",
    _add_arguments,
    _run,
    ("source", "volume_ml", "length_mm", "roots", "notes", "seconds"),
)
