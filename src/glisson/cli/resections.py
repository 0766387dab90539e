"""`glisson resections`: what each resection would take, and what would remain."""

import argparse

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.options import add_case
from glisson.cli.progress import StageLines
from glisson.framework.case import open_case
from glisson.framework.dividing import case_resections


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    add_case(parser)
    parser.add_argument("--segments", metavar="MASK", help="a label map with segments 1 to 8 instead of the case's")


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    found = case_resections(open_case(arguments.case), arguments.segments)
    values = {
        "resections": [
            {
                "name": row.resection.name,
                "segments": list(row.resection.removed),
                "major": row.resection.is_major,
                "removed_ml": row.removed_ml,
                "remnant_ml": row.remnant_ml,
                "remnant_share": row.remnant_share,
            }
            for row in found
        ]
    }
    width = max(len(row.resection.name) for row in found)
    head = f"{'resection':{width}s}         removed   remnant"
    text = [
        f"{row.resection.name:{width}s}  {'major' if row.resection.is_major else 'minor'}  {row.removed_ml:5.0f} ml  "
        f"{row.remnant_ml:5.0f} ml  {100.0 * row.remnant_share:3.0f} %"
        for row in found
    ]
    return Answer(values, "\n".join([head, *text]))


COMMAND = Command(
    "resections",
    "  glisson resections liver\n  glisson resections liver --segments segments.nii.gz --json",
    _add_arguments,
    _run,
    ("resections",),
)
