"""The liver by a MONAI bundle (Cardoso et al. 2022, arXiv:2211.02701) that lies on the disk, where MONAI is installed.

A bundle is a folder with a trained network and configs/inference.json (or .yaml), which `python -m monai.bundle run`
executes in a process of its own. As the bundles of MONAI's model zoo do, it takes the scans' files from `datalist` and
writes labels as NIfTI into `output_dir`. MONAI is under the Apache licence 2.0; each bundle has a licence of its own.
"""

import json
import sys
import tempfile
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import ClassVar

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput, StageFailed
from glisson.core.image import LabelMap, Volume
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, Segmentation, silent
from glisson.core.status import Status
from glisson.preoperative.child_process import run_child
from glisson.preoperative.liver.plugins.bundle_labels import label_number
from glisson.preoperative.liver.plugins.cleaned import cleaned_liver
from glisson.preoperative.liver.plugins.exchange import read_found, write_scan

_PROGRAM = "The MONAI bundle"
_PACKAGES = {"monai": "monai", "torch": "torch", "ignite": "pytorch-ignite", "fire": "fire"}
"""Module → the package that holds it."""


@dataclass(frozen=True)
class MonaiBundleParameters:
    """Where the bundle lies, and which of its labels is the liver."""

    bundle_folder: str = parameter("", "Folder of the bundle, for example wholeBody_ct_segmentation.")
    label: str = parameter("liver", "Name or number of the bundle's label that is the liver.")


class MonaiBundle:
    """Liver by a trained network that is packed as a MONAI bundle; clicks are not used."""

    name: ClassVar[str] = "monai-bundle"
    summary: ClassVar[str] = "Liver by the network of a MONAI bundle on the disk, without a click."
    Parameters: ClassVar[type[MonaiBundleParameters]] = MonaiBundleParameters

    def __init__(self, parameters: MonaiBundleParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """MONAI, PyTorch and what runs bundles, where they are not installed."""
        return tuple(package for module, package in _PACKAGES.items() if find_spec(module) is None)

    def segment(
        self, volume: Volume, labels: LabelMap | None, seeds_mm: FloatArray, progress: Progress = silent
    ) -> Segmentation:
        """The liver ({1: "liver"}) with the tumours that are known, in one part.

        Args:
            volume: a scan of the modality that the bundle is for.
            labels: tumours that are known already.
            seeds_mm: not used.
            progress: told for how long it has run.

        Raises:
            BadInput: a package or the bundle is missing, the bundle is for other scans or has no such label, or what
                it found falls into parts.
            StageFailed: it ended with an error, or found no liver.
        """
        if missing := self.missing_dependencies():
            raise BadInput(f"MONAI cannot run bundles yet: pip install {' '.join(missing)}.")
        bundle = Path(self._parameters.bundle_folder).expanduser().resolve()
        config = self._config(bundle)
        number = label_number(bundle, self._parameters.label, volume.modality)
        with tempfile.TemporaryDirectory(prefix="glisson-monai-") as name:
            folder = Path(name)
            write_scan(folder / "scan.nii.gz", volume)
            code, said = run_child(_command(bundle, config, folder), folder, _PROGRAM, progress)
            if code != 0:
                reason = said[:200] or "it said nothing"
                raise StageFailed(f"{_PROGRAM} ended with the code {code}: {reason}.", Status.STAGNATED)
            files = sorted((folder / "found").rglob("*.nii.gz"))
            if len(files) != 1:
                raise StageFailed(f"{_PROGRAM} ended with {len(files)} files of labels, not one.", Status.STAGNATED)
            found = np.rint(read_found(files[0], volume.grid, _PROGRAM)) == number
        return cleaned_liver(volume, found, labels, _PROGRAM)

    def _config(self, bundle: Path) -> Path:
        """How the bundle infers."""
        for config in (bundle / "configs" / f"inference.{ending}" for ending in ("json", "yaml")):
            if self._parameters.bundle_folder and config.is_file():
                return config
        raise BadInput(
            "MONAI needs the folder of a bundle; there is no configs/inference.json in "
            f"bundle_folder = {self._parameters.bundle_folder!r}."
        )


def _command(bundle: Path, config: Path, folder: Path) -> list[str]:
    """MONAI's command for one scan; `--key value` replaces what the bundle's config says."""
    replaced = {
        "config_file": str(config),
        "meta_file": str(bundle / "configs" / "metadata.json"),
        "bundle_root": str(bundle),
        "datalist": json.dumps([str(folder / "scan.nii.gz")]),
        "output_dir": str(folder / "found"),
        "output_ext": ".nii.gz",
    }
    words = [word for key, value in replaced.items() for word in (f"--{key}", value)]
    return [sys.executable, "-m", "monai.bundle", "run", *words]
