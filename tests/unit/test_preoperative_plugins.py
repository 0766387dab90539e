"""The plug-ins for other programs, with stand-ins that take the same words and calls as these."""

import os
import sys
import types
from importlib.machinery import ModuleSpec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glisson.core import BadInput, Grid, LabelMap, StageFailed, Volume
from glisson.preoperative.liver.plugins.nn_interactive import NnInteractive, NnInteractiveParameters
from glisson.preoperative.liver.plugins.total_segmentator import TotalSegmentator, TotalSegmentatorParameters

NO_SEED = np.zeros((0, 3))

STAND_IN = """#!{python}
import argparse
import sys

import nibabel
import numpy as np
from pathlib import Path

parser = argparse.ArgumentParser()
parser.add_argument("-i", dest="input", required=True)
parser.add_argument("-o", dest="output", required=True)
parser.add_argument("-ta", "--task", choices=["total", "total_mr"], default="total")
parser.add_argument("-rs", "--roi_subset", nargs="+", required=True)
parser.add_argument("-d", "--device", default="gpu")
parser.add_argument("-f", "--fast", action="store_true")
words = parser.parse_args()
Path(r"{log}").write_text(" ".join(sys.argv[1:]))
if words.device == "mps":
    sys.exit("no such device\\n")
scan = nibabel.load(words.input)
Path(words.output).mkdir()
for name in words.roi_subset if words.device == "gpu" else []:
    found = (np.asarray(scan.dataobj) > 50) & (not words.fast)
    nibabel.save(nibabel.Nifti1Image(found.astype(np.uint8), scan.affine), Path(words.output) / (name + ".nii.gz"))
"""


def scan(modality: str = "CT") -> tuple[Volume, np.ndarray]:
    """A block of liver in fat, on an oblique grid, and the block."""
    rotation, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    grid = Grid((12, 14, 10), [2.0, 2.5, 3.0], [-40.25, 31.5, 812.125], rotation)
    liver = np.zeros(grid.shape, dtype=bool)
    liver[3:9, 2:11, 4:8] = True
    return Volume(np.where(liver, 110, -90).astype(np.int16), grid, modality), liver


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """TotalSegmentator's stand-in on the path; what it was called with is in the file."""
    called = tmp_path / "called.txt"
    script = tmp_path / "bin" / "TotalSegmentator"
    script.parent.mkdir()
    script.write_text(STAND_IN.format(python=sys.executable, log=called))
    script.chmod(0o755)
    monkeypatch.setenv("PATH", str(script.parent), prepend=os.pathsep)
    return called


def total(**parameters: Any) -> TotalSegmentator:
    return TotalSegmentator(TotalSegmentatorParameters(**parameters))


def test_total_segmentator_is_asked_for_the_liver(program: Path) -> None:
    assert TotalSegmentator.missing_dependencies() == ()
    for modality, task in (("CT", "total"), ("MR", "total_mr")):
        volume, liver = scan(modality)
        found = total().segment(volume, None, NO_SEED)
        assert np.array_equal(found.labels.mask("liver"), liver)
        assert found.labels.grid.matches(volume.grid)
        assert f"--task {task} --roi_subset liver --device gpu" in program.read_text()


def test_known_tumours_belong_to_the_liver(program: Path) -> None:
    volume, liver = scan()
    tumour = np.zeros(liver.shape, dtype=np.uint8)
    tumour[9:11, 5:7, 5:7] = 1
    labels = LabelMap(tumour, volume.grid, {1: "tumour1"})
    assert np.array_equal(total().segment(volume, labels, NO_SEED).labels.mask("liver"), liver | (tumour > 0))


def test_total_segmentator_that_fails_is_a_sentence(program: Path) -> None:
    for parameters, words in (
        ({"device": "mps"}, "ended with the code 1: no such device"),
        ({"device": "cpu"}, "ended without a mask of the liver"),
        ({"fast": True}, "found no liver in the scan"),
    ):
        with pytest.raises(StageFailed, match=words):
            total(**parameters).segment(scan()[0], None, NO_SEED)


def test_absent_programs_say_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    assert TotalSegmentator.missing_dependencies() == ("TotalSegmentator",)
    with pytest.raises(BadInput, match="pip install TotalSegmentator"):
        total().segment(scan()[0], None, NO_SEED)
    if missing := NnInteractive.missing_dependencies():
        with pytest.raises(BadInput, match=f"pip install {' '.join(missing)}"):
            NnInteractive(NnInteractiveParameters()).segment(scan()[0], None, NO_SEED)


class Session:
    """Stands in for nnInteractive's session: marks what is like the voxel that was clicked."""

    def __init__(self, device, use_torch_compile, verbose, torch_n_threads, do_autozoom, use_pinned_memory) -> None:
        self.device = device

    def initialize_from_trained_model_folder(self, folder: str) -> None:
        assert Path(folder).is_dir()

    def set_image(self, image: np.ndarray) -> None:
        assert image.ndim == 4
        self.image = image[0]

    def set_target_buffer(self, target: np.ndarray) -> None:
        assert target.shape == self.image.shape
        self.target = target

    def add_point_interaction(self, coordinates: tuple[int, ...], include_interaction: bool) -> None:
        self.target[self.image == self.image[coordinates]] = include_interaction


@pytest.fixture
def session(monkeypatch: pytest.MonkeyPatch) -> None:
    modules: dict[str, Any] = {
        "torch": {"device": str, "zeros": np.zeros, "uint8": np.uint8},
        "nnInteractive": {},
        "nnInteractive.inference": {},
        "nnInteractive.inference.inference_session": {"nnInteractiveInferenceSession": Session},
    }
    for name, members in modules.items():
        module = types.ModuleType(name)
        module.__spec__ = ModuleSpec(name, None)
        vars(module).update(members)
        monkeypatch.setitem(sys.modules, name, module)


def test_nn_interactive_gets_the_click_as_voxels(session: None, tmp_path: Path) -> None:
    volume, liver = scan()
    click = volume.grid.points_from_indices([[5.2, 6.0, 5.9]])
    segmenter = NnInteractive(NnInteractiveParameters(str(tmp_path)))
    assert np.array_equal(segmenter.segment(volume, None, click).labels.mask("liver"), liver)
    with pytest.raises(BadInput, match="needs a click"):
        segmenter.segment(volume, None, NO_SEED)
    with pytest.raises(BadInput, match="lies outside the scan"):
        segmenter.segment(volume, None, click + 500.0)
    with pytest.raises(BadInput, match="needs its trained model"):
        NnInteractive(NnInteractiveParameters()).segment(volume, None, click)
