"""`glisson export`: a case's labels for other programs."""

import argparse

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.options import add_case
from glisson.cli.progress import StageLines
from glisson.framework.case import open_case
from glisson.framework.exporting import export_labels


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    add_case(parser)
    parser.add_argument("file", metavar="FILE", help="the file to make: .seg.nrrd (3D Slicer) or .dcm (DICOM)")
    parser.add_argument(
        "--scan",
        metavar="FOLDER",
        help="the DICOM folder that the case was made of, for .dcm: patient and study are taken from there",
    )
    parser.add_argument("--series", metavar="UID", help="which series, where that folder holds several")


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    names = export_labels(open_case(arguments.case), arguments.file, arguments.scan, arguments.series)
    return Answer(
        {"file": arguments.file, "labels": names}, f"file      {arguments.file}\nlabels    {', '.join(names)}"
    )


COMMAND = Command(
    "export",
    "  glisson export liver liver.seg.nrrd\n  glisson export liver liver.dcm --scan PATIENT_DICOM",
    _add_arguments,
    _run,
    ("file", "labels"),
)
