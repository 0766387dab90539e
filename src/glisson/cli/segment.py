"""`glisson segment`: the liver's mask."""

import argparse
import time

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.options import add_seed_points
from glisson.cli.progress import StageLines
from glisson.cli.running import add_run_arguments, run_to
from glisson.framework.case import open_case
from glisson.framework.case_warnings import case_warnings
from glisson.framework.comparing import compare_with_reference, given_mask_facts


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    add_run_arguments(parser, ("segment",), ())
    add_seed_points(parser)
    parser.add_argument("--reference", metavar="MASK", help="a mask to compare with: a file or a DICOM folder")


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    started = time.perf_counter()
    # Only somebody who says how to segment wants to have a mask replaced that a person gave or corrected.
    says_how = any(value is not None for name, value in vars(arguments).items() if name.startswith("segment."))
    result = run_to("segment", arguments, lines, replace=says_how or arguments.seed_point is not None)
    facts = result.facts.get("segment") or given_mask_facts(open_case(arguments.case))
    warnings = case_warnings(open_case(arguments.case))
    values = {"volume_ml": facts["volume_ml"], "flagged_slices": facts["flagged_slices"], "flags": facts["flags"]}
    values["warnings"] = warnings
    text = [f"liver     {facts['volume_ml']:.0f} ml"]
    text += [f"warning   {warning}" for warning in warnings]
    text += [f"look at   slice {number}: {reason}" for number, reason in facts["flags"]]
    if arguments.reference is not None:
        scores = compare_with_reference(open_case(arguments.case), arguments.reference)
        values |= {"dice": scores.dice, "asd_mm": scores.asd_mm, "hd95_mm": scores.hd95_mm}
        text.append(
            f"reference Dice {scores.dice:.4f}, mean surface distance {scores.asd_mm:.2f} mm, "
            f"95 % within {scores.hd95_mm:.2f} mm"
        )
    values["seconds"] = time.perf_counter() - started
    return Answer(values, "\n".join(text))


COMMAND = Command(
    "segment",
    "  glisson segment liver --seed-point -60,10,120\n  glisson segment liver --reference MASKS_DICOM/liver --json",
    _add_arguments,
    _run,
    ("volume_ml", "flagged_slices", "seconds"),
)
