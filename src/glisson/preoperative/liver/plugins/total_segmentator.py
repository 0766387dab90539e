"""The liver by TotalSegmentator (Wasserthal et al., Radiology: AI 5(5), 2023), where it is installed.

It runs as a program of its own: `TotalSegmentator -i SCAN -o FOLDER --task total --roi_subset liver` writes a file for
each class into the folder. The program and the weights of both tasks are under the Apache licence 2.0; it fetches the
weights when it runs first.
"""

import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput, StageFailed
from glisson.core.image import LabelMap, Volume
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, Segmentation, silent
from glisson.core.status import Status
from glisson.preoperative.child_process import run_child
from glisson.preoperative.liver.plugins.cleaned import cleaned_liver
from glisson.preoperative.liver.plugins.exchange import read_found, write_scan

_PROGRAM = "TotalSegmentator"
_TASKS = {"CT": "total", "MR": "total_mr"}


@dataclass(frozen=True)
class TotalSegmentatorParameters:
    """On which device it runs, and at which resolution."""

    device: str = parameter("gpu", "Where the network runs.", choices=("gpu", "cpu", "mps"))
    fast: bool = parameter(False, "Voxels of 3 mm instead of 1.5 mm: sooner ready, and coarser.")


class TotalSegmentator:
    """Liver from a CT or MR by a trained network; clicks are not used."""

    name: ClassVar[str] = "total-segmentator"
    summary: ClassVar[str] = "Liver by TotalSegmentator's network, from a CT or an MR without a click."
    Parameters: ClassVar[type[TotalSegmentatorParameters]] = TotalSegmentatorParameters

    def __init__(self, parameters: TotalSegmentatorParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """The program, where it is not on the path."""
        return () if shutil.which(_PROGRAM) else (_PROGRAM,)

    def segment(
        self, volume: Volume, labels: LabelMap | None, seeds_mm: FloatArray, progress: Progress = silent
    ) -> Segmentation:
        """The liver ({1: "liver"}) with the tumours that are known, in one part.

        Args:
            volume: a CT (HU) or an MR.
            labels: tumours that are known already, on the same grid.
            seeds_mm: not used.
            progress: told for how long it has run.

        Raises:
            BadInput: the program is not installed, or what it found falls into parts.
            StageFailed: it ended with an error, or found no liver.
        """
        program = shutil.which(_PROGRAM)
        if program is None:
            raise BadInput(f"{_PROGRAM} is not installed: pip install {_PROGRAM}, or choose another technique.")
        with tempfile.TemporaryDirectory(prefix="glisson-total-") as name:
            folder = Path(name)
            write_scan(folder / "scan.nii.gz", volume)
            options = ["--task", _TASKS[volume.modality], "--roi_subset", "liver", "--device", self._parameters.device]
            if self._parameters.fast:
                options.append("--fast")
            command = [program, "-i", str(folder / "scan.nii.gz"), "-o", str(folder / "found"), *options]
            code, said = run_child(command, folder, _PROGRAM, progress)
            if code != 0:
                reason = said[:200] or "it said nothing"
                raise StageFailed(f"{_PROGRAM} ended with the code {code}: {reason}.", Status.STAGNATED)
            path = folder / "found" / "liver.nii.gz"
            if not path.is_file():
                raise StageFailed(f"{_PROGRAM} ended without a mask of the liver ({path.name}).", Status.STAGNATED)
            found = read_found(path, volume.grid, _PROGRAM) > 0
        return cleaned_liver(volume, found, labels, _PROGRAM)
