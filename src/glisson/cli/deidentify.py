"""`glisson deidentify`: DICOM files without what tells who the patient is."""

import argparse

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.progress import StageLines
from glisson.framework.deidentifying import deidentify


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", metavar="FOLDER", help="where the DICOM files lie, in folders or not")
    parser.add_argument(
        "out", metavar="OUT", help="the folder to make, with a folder for each series if there are more"
    )


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    made, warnings = deidentify(arguments.folder, arguments.out, lines.begun("deidentify", "files were given"))
    lines.close()
    folders = [str(folder) for folder in made.folders]
    text = [f"files     {made.files} in {', '.join(folders)}"]
    if made.left_out:
        text.append(f"left out  {made.left_out} files that are no CT, MR or segmentation")
    text += [f"warning   {warning}" for warning in warnings]
    values = {"folders": folders, "files": made.files, "left_out": made.left_out, "warnings": warnings}
    return Answer(values, "\n".join(text))


COMMAND = Command(
    "deidentify",
    "  glisson deidentify PATIENT_DICOM FOR_OTHERS\n  glisson deidentify PATIENT_DICOM FOR_OTHERS --json",
    _add_arguments,
    _run,
    ("folders", "files", "left_out", "warnings"),
)
