"""`glisson study NAME`: many points, each done once, and what they tell."""

import argparse
import json
from pathlib import Path

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.progress import StageLines
from glisson.core.errors import BadInput
from glisson.io.atomic import atomic_path
from glisson.studies.contact.study import ContactStudy
from glisson.studies.dask_cluster import DaskCluster
from glisson.studies.elements.study import Elements
from glisson.studies.executor import Executor
from glisson.studies.lever_lift.study import LeverLift
from glisson.studies.lift_robustness.study import LiftRobustness
from glisson.studies.local_pool import LocalPool
from glisson.studies.region.study import RegionStudy
from glisson.studies.registration.study import SparseDataTwin
from glisson.studies.segmentation.study import SegmentationStudy
from glisson.studies.sensitivity.study import Sensitivity
from glisson.studies.study import Study, run_study
from glisson.studies.surface.study import SurfaceStudy
from glisson.studies.trocar.study import TrocarStudy
from glisson.studies.ventilation.study import VentilationStudy

STUDIES = {
    "contact": "how far the tumour is apart with our contact and with that of the IPC Toolkit",
    "elements": "how much error linear and quadratic elements leave in the same time",
    "lever-lift": "how well tumour, plane and surface are told after a lever lift from a few things that were seen",
    "lift-robustness": "whether the lever lift converges whatever liver, lever, tissue and contact",
    "region": "how much faster a lift is by its region of interest, and what that costs",
    "segmentation": "how well the liver is found in scans of the phantom family, and whether failures are flagged",
    "sensitivity": "how much mesh, law, stiffness, compressibility and contact move the tumour's place",
    "sparse-data": "how well registrations find livers of which only a part of the surface is seen",
    "trocar": "how wrong the pose of a trocar is that sees crosses, and whether a wrong one passes silently",
    "surface": "how wrong surface points from two laparoscope views are (the dissertation's Tables 3 and 4)",
    "ventilation": "how well breathing is told and taken away, and where faster ventilation stops helping",
}


_OWN_OPTIONS = {
    "seed": (
        LeverLift.name, LiftRobustness.name, ContactStudy.name, SparseDataTwin.name, SurfaceStudy.name,
        TrocarStudy.name, VentilationStudy.name,
    ),
    "long": (Sensitivity.name,),
    "element": (Sensitivity.name,),
}  # fmt: skip
"""Options that only some studies have."""


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    listed = "; ".join(f"{name}: {what}" for name, what in STUDIES.items())
    parser.add_argument("study", metavar="NAME", choices=tuple(STUDIES), help=listed)
    parser.add_argument("--quick", action="store_true", help="a minute's worth of points, after a set-up that is kept")
    parser.add_argument("--long", action="store_true", help="with the largest meshes (sensitivity)")
    parser.add_argument(
        "--seed", metavar="N",
        help="seed of random numbers, a whole number (for studies that draw their cases; default 0)",
    )  # fmt: skip
    parser.add_argument("--out", metavar="DIR", help="folder of the study (default: ./studies/NAME)")
    parser.add_argument("--workers", metavar="N", help="processes on this machine (default: one for each core)")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="compute on the Dask cluster with this scheduler")
    parser.add_argument("--element", choices=("T4", "T10"), help="element of the models (sensitivity; default T10)")


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    if arguments.quick and arguments.long:
        raise BadInput("Choose --quick or --long, not both.")
    folder = Path(arguments.out or f"studies/{arguments.study}")
    return study_answer(_study(arguments), folder, _executor(arguments), lines, arguments.quick)


def study_answer(study: Study, folder: Path, executor: Executor, lines: StageLines, quick: bool) -> Answer:
    """Run a study, keep what it says in `results.json` of its folder, and close the executor."""
    try:
        conclusion, seconds = run_study(study, folder, executor, lines, quick)
    finally:
        executor.close()
    values = {**conclusion.values, "study": study.name, "quick": quick, "seconds": seconds}
    with atomic_path(folder / "results.json") as temporary:
        temporary.write_text(json.dumps(values, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    times = f"seconds   set-up {seconds['set-up']:.1f} (kept), points {seconds['points']:.1f}"
    return Answer(values, "\n".join([conclusion.text, times, f"results   {folder}"]))


def _study(arguments: argparse.Namespace) -> Study:
    for option, studies in _OWN_OPTIONS.items():
        if getattr(arguments, option) and arguments.study not in studies:
            raise BadInput(f"{arguments.study} has no --{option}; that is for the study {', '.join(studies)}.")
    seed = whole_number(arguments.seed, "--seed", 0) or 0
    if arguments.study == LeverLift.name:
        return LeverLift.of(arguments.quick, seed)
    if arguments.study == LiftRobustness.name:
        return LiftRobustness.of(arguments.quick, seed)
    if arguments.study == ContactStudy.name:
        return ContactStudy.of(arguments.quick, seed)
    if arguments.study == Elements.name:
        return Elements.of(arguments.quick)
    if arguments.study == RegionStudy.name:
        return RegionStudy.of(arguments.quick)
    if arguments.study == SegmentationStudy.name:
        return SegmentationStudy.of(arguments.quick)
    if arguments.study == TrocarStudy.name:
        return TrocarStudy.of(arguments.quick, seed)
    if arguments.study == SparseDataTwin.name:
        return SparseDataTwin.of(arguments.quick, seed)
    if arguments.study == SurfaceStudy.name:
        return SurfaceStudy.of(arguments.quick, seed)
    if arguments.study == VentilationStudy.name:
        return VentilationStudy.of(arguments.quick, seed)
    return Sensitivity.of(arguments.quick, arguments.long, arguments.element or "T10")


def _executor(arguments: argparse.Namespace) -> Executor:
    if arguments.scheduler is None:
        return LocalPool(whole_number(arguments.workers, "--workers", 1))
    if arguments.workers is not None:
        raise BadInput("--workers is for this machine; a Dask cluster has its own number of workers.")
    return DaskCluster(arguments.scheduler)


def whole_number(text: str | None, option: str, least: int) -> int | None:
    """What an option says; None where it was not given."""
    if text is None:
        return None
    if not text.isdecimal() or int(text) < least:
        raise BadInput(f"{option} must be a whole number of at least {least}, not {text!r}.")
    return int(text)


COMMAND = Command(
    "study",
    "  glisson study sensitivity --quick\n  glisson study lift-robustness --seed 7\n"
    "  glisson study sensitivity --scheduler tcp://127.0.0.1:8786 --json",
    _add_arguments,
    _run,
    ("rows", "cases", "converged", "pairs", "breathing", "views", "silent_wrong", "flagged", "seconds"),
)
