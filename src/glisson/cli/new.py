"""`glisson new`: a case folder from a scan and label maps."""

import argparse

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.progress import StageLines
from glisson.framework.importing import import_case


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("case", metavar="CASE", help="the case folder to make")
    parser.add_argument("--ct", metavar="PATH", required=True, help="the scan: a DICOM folder, NIfTI or NRRD file")
    parser.add_argument("--series", metavar="UID", help="which series, where the DICOM folder holds several")
    parser.add_argument(
        "--labels",
        metavar="PATH",
        nargs="+",
        default=[],
        help="label maps whose voxels lie on the scan's: NIfTI, NRRD, .seg.nrrd or DICOM segmentations, folders of "
        "such files, DICOM masks, folders of DICOM masks",
    )
    parser.add_argument(
        "--label-scheme",
        choices=("totalsegmentator",),
        help="how label maps without names in them are numbered",
    )


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    made = import_case(arguments.case, arguments.ct, arguments.labels, arguments.label_scheme, series=arguments.series)
    text = f"case      {made.case.folder}\nlabels    {', '.join(made.labels) or 'none'}"
    if made.left_out:
        text += f"\nleft out  {made.left_out} labels of unknown names"
    text += "".join(f"\nwarning   {warning}" for warning in made.warnings)
    values = {
        "case": str(made.case.folder), "labels": made.labels, "left_out": made.left_out, "warnings": made.warnings
    }  # fmt: skip
    return Answer(values, text)


COMMAND = Command(
    "new",
    "  glisson new liver --ct PATIENT_DICOM --labels MASKS_DICOM\n"
    "  glisson new liver --ct ct.nii.gz --labels total.nii.gz --label-scheme totalsegmentator",
    _add_arguments,
    _run,
    ("case",),
)
