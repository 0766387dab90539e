"""`glisson structure`: a tumour, the gallbladder, a guide wire or a stent, marked by clicks."""

import argparse
import time
from dataclasses import fields

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.options import add_case, point_from_text
from glisson.cli.progress import StageLines
from glisson.core.errors import BadInput
from glisson.framework.case import Case, open_case
from glisson.framework.marking import BY_THRESHOLD, Marked, compare_structure, mark_structure, remove_structure
from glisson.preoperative.structures.parameters import StructureParameters

_KEYS = ("name", "technique", "volume_ml", "volume_before_ml", "notes", "file", "seconds")


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    add_case(parser)
    parser.add_argument("name", metavar="NAME", help="tumour1, tumour2, …, gallbladder, wire or stent")
    parser.add_argument(
        "--seed-point", metavar="X,Y,Z", action="append", type=point_from_text,
        help="a click into it, LPS mm; may be repeated, for parts of other grey values or of a torn wire",
    )  # fmt: skip
    parser.add_argument(
        "--technique", metavar="NAME", default=BY_THRESHOLD,
        help=f"threshold or contour, see glisson techniques; by default {BY_THRESHOLD}",
    )  # fmt: skip
    for field in fields(StructureParameters):
        words = str(field.metadata["help"]).rstrip(".")
        flag = f"--{field.name.replace('_', '-')}"
        parser.add_argument(flag, dest=field.name, metavar="VALUE", help=f"{words}, default {field.default:g}")
    parser.add_argument("--reference", metavar="MASK", help="a mask to compare with: a file or a DICOM folder")
    parser.add_argument("--remove", action="store_true", help="take the label out of the case again")


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    if arguments.remove and (arguments.seed_point or arguments.reference):
        raise BadInput("--remove takes a label away; give it without --seed-point and --reference.")
    started = time.perf_counter()
    case = open_case(arguments.case)
    progress = lines.begun("structure", "it was asked for")
    technique: str | None = None
    if arguments.remove:
        marked = remove_structure(case, arguments.name)
    else:
        technique = arguments.technique
        given = {field.name: getattr(arguments, field.name) for field in fields(StructureParameters)}
        parameters = {name: value for name, value in given.items() if value is not None}
        marked = mark_structure(case, arguments.name, arguments.seed_point or (), technique, parameters, progress)
    seconds = time.perf_counter() - started
    lines.ended("structure", seconds)
    values, text = _told(arguments.name, technique, marked)
    if arguments.reference is not None:
        _compare(case, arguments.name, arguments.reference, values, text)
    return Answer(values | {"seconds": seconds}, "\n".join(text))


def _told(name: str, technique: str | None, marked: Marked) -> tuple[dict[str, object], list[str]]:
    values: dict[str, object] = {
        "name": name, "technique": technique, "volume_ml": marked.after_ml, "volume_before_ml": marked.before_ml,
        "notes": list(marked.notes), "file": str(marked.file),
    }  # fmt: skip
    text = [f"{name:11s} {marked.after_ml:.2f} ml, {marked.before_ml:.2f} ml before", f"written     {marked.file}"]
    return values, text + [f"look at     {note}" for note in marked.notes]


def _compare(case: Case, name: str, reference: str, values: dict[str, object], text: list[str]) -> None:
    scores = compare_structure(case, name, reference)
    values.update(dice=scores.dice, asd_mm=scores.asd_mm, hd95_mm=scores.hd95_mm)
    text.append(
        f"reference   Dice {scores.dice:.4f}, mean surface distance {scores.asd_mm:.2f} mm, "
        f"95 % within {scores.hd95_mm:.2f} mm"
    )


COMMAND = Command(
    "structure",
    "  glisson structure liver tumour1 --seed-point -60,10,120\n"
    "  glisson structure liver gallbladder --seed-point -20,-40,60 --reach-mm 50 --json\n"
    "  glisson structure liver wire --seed-point 12,-14,90 --seed-point 40,-16,110\n"
    "  glisson structure liver tumour1 --seed-point -60,10,120 --technique contour --reference truth.nii.gz\n"
    "  glisson structure liver tumour1 --remove",
    _add_arguments,
    _run,
    _KEYS,
)
