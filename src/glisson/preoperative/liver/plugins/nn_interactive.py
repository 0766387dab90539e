"""The liver from clicks by nnInteractive (Isensee et al. 2025, arXiv:2503.08373), where it is installed.

The package is under the Apache licence 2.0, its official weights under CC BY-NC-SA 4.0: for no commercial use. Whoever
may use them gives the folder with the trained model. It wants a graphics card of NVIDIA.
"""

import os
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import ClassVar

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.image import LabelMap, Volume
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, Segmentation, silent
from glisson.preoperative.imaging.clicked import checked_clicks
from glisson.preoperative.liver.plugins.cleaned import cleaned_liver

_PACKAGES = {"nnInteractive": "nninteractive", "torch": "torch"}
"""Module → the package that holds it."""


@dataclass(frozen=True)
class NnInteractiveParameters:
    """Where the trained model lies, and where it runs."""

    model_folder: str = parameter("", "Folder of the trained model, for example nnInteractive_v1.0.")
    device: str = parameter("cuda:0", "Where the network runs, as PyTorch calls it.")


class NnInteractive:
    """Liver from clicks inside it, by a trained network."""

    name: ClassVar[str] = "nn-interactive"
    summary: ClassVar[str] = "Liver by nnInteractive's network, from a CT or an MR with clicks."
    Parameters: ClassVar[type[NnInteractiveParameters]] = NnInteractiveParameters

    def __init__(self, parameters: NnInteractiveParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """Its package and PyTorch, where they are not installed."""
        return tuple(package for module, package in _PACKAGES.items() if find_spec(module) is None)

    def segment(
        self, volume: Volume, labels: LabelMap | None, seeds_mm: FloatArray, progress: Progress = silent
    ) -> Segmentation:
        """The liver ({1: "liver"}) with the tumours that are known, in one part.

        Args:
            volume: a CT (HU) or an MR.
            labels: tumours that are known already, on the same grid.
            seeds_mm: clicks inside the liver, (n, 3) LPS mm, at least one.
            progress: told how far it is.

        Raises:
            BadInput: a package or the model is missing, there is no click, one lies outside the scan, or what was
                found falls into parts.
            StageFailed: no liver was found.
        """
        folder = Path(self._parameters.model_folder)
        if missing := self.missing_dependencies():
            raise BadInput(f"nnInteractive is not installed: pip install {' '.join(missing)}.")
        if not self._parameters.model_folder or not folder.is_dir():
            raise BadInput(f"nnInteractive needs its trained model; there is no folder model_folder = {str(folder)!r}.")
        clicks = checked_clicks(volume.grid, np.asarray(seeds_mm, dtype=np.float64).reshape(-1, 3))
        if not len(clicks):
            raise BadInput("nnInteractive needs a click inside the liver; give --seed-point X,Y,Z (LPS mm).")
        import torch
        from nnInteractive.inference.inference_session import nnInteractiveInferenceSession

        progress(0.0, "loading the model")
        session = nnInteractiveInferenceSession(
            device=torch.device(self._parameters.device),
            use_torch_compile=False,
            verbose=False,
            torch_n_threads=os.cpu_count(),
            do_autozoom=True,
            use_pinned_memory=self._parameters.device.startswith("cuda"),
        )
        session.initialize_from_trained_model_folder(str(folder))
        # The values as they are: the session scales them itself.
        session.set_image(volume.voxels[None].copy())
        target = torch.zeros(volume.voxels.shape, dtype=torch.uint8)
        session.set_target_buffer(target)
        for number, click in enumerate(np.rint(clicks).astype(int).tolist(), start=1):
            session.add_point_interaction(tuple(click), include_interaction=True)
            progress(number / len(clicks), f"click {number} of {len(clicks)}")
        return cleaned_liver(volume, np.asarray(target) > 0, labels, "nnInteractive")
