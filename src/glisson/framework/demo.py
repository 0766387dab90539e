"""The demo's case: the phantom as a patient, with its truth beside it.

The liver's mask is not among the labels: like a patient's it is found in the scan from one click. The true
mask lies in `truth/`, to compare with, and so does the true deformation, which another engine computed.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from glisson.core.errors import BadInput
from glisson.framework.case import SCENARIO, TRUTH, Case, new_case, open_case
from glisson.framework.hashing import source_hash
from glisson.framework.importing import write_images
from glisson.framework.settings import Point, SegmentSettings, Settings, TechniqueChoice
from glisson.geometry.distance_map import distance_inside
from glisson.io.deformation_files import write_deformation
from glisson.io.images import write_labels
from glisson.io.scenario_files import write_scenario
from glisson.phantom.demo import demo_phantom
from glisson.phantom.phantom import Phantom

REFERENCE = "truth/organ.nii.gz"
"""The true mask of the demo's liver."""

_MARK = "truth/phantom.json"

# About 4,000 quadratic elements: enough for a tumour within a millimetre, and the solve takes about a minute.
_QUICK_MESH = TechniqueChoice("mesh", "mmg", {"edge_length_mm": 24.0, "envelope_mm": 1.5})

# Its surface strays by the envelope from a mask that is known to a voxel, of 1.5 mm too.
_QUICK_SOLVE = TechniqueChoice("simulate", "quasi-static", {"surface_tolerance_mm": 3.0})


def demo_case(folder: str | Path) -> Case:
    """The demo's case at `folder`: made anew, or the one that is there already.

    Raises:
        BadInput: something else lies there, or a demo of another version of Glisson.
        WriteFailed: the disk is full.
    """
    path = Path(folder)
    if path.exists() and (not path.is_dir() or any(path.iterdir())):
        return _existing(path)
    phantom = demo_phantom()
    choices = {"mesh": _QUICK_MESH, "simulate": _QUICK_SOLVE}
    settings = replace(Settings(), choices=choices, segment=SegmentSettings((click_inside(phantom),)))
    with new_case(path, settings) as making:
        write_images(making, phantom.volume, {"tumours": phantom.tumours, "structures": phantom.structures})
        write_scenario(making / SCENARIO, phantom.scenario)
        (making / TRUTH).mkdir()
        write_labels(making / REFERENCE, phantom.organ)
        if phantom.truth is not None:
            write_deformation(making / TRUTH, phantom.truth)
        (making / _MARK).write_text(json.dumps(_mark()), encoding="utf-8")
    return open_case(path)


def click_inside(phantom: Phantom) -> Point:
    """The point of the liver (LPS mm) that is furthest from its surface, its vessels and tumours."""
    tissue = (phantom.organ.voxels > 0) & (phantom.tumours.voxels == 0) & (phantom.structures.voxels == 0)
    depth = distance_inside(tissue, phantom.organ.grid.spacing_mm)
    index = np.array(np.unravel_index(int(depth.argmax()), depth.shape), dtype=np.float64)
    x, y, z = phantom.organ.grid.points_from_indices(index[None])[0]
    return round(float(x), 1), round(float(y), 1), round(float(z), 1)


def _existing(path: Path) -> Case:
    mark = path / _MARK
    if not mark.is_file():
        raise BadInput(f"{path} exists and is not a demo of Glisson; name another folder with --out.")
    if mark.read_text(encoding="utf-8") != json.dumps(_mark()):
        raise BadInput(f"{path} is the demo of another version of Glisson; remove it or name another with --out.")
    return open_case(path)


def _mark() -> dict[str, str]:
    return {"phantom": "demo", "source": source_hash("glisson.phantom")}
