"""The plug-in for MONAI bundles, with a stand-in for `python -m monai.bundle run` that takes the same words."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from glisson.core import BadInput, Grid, LabelMap, StageFailed, Volume
from glisson.preoperative.liver.plugins.monai_bundle import MonaiBundle, MonaiBundleParameters

NO_SEED = np.zeros((0, 3))

STAND_IN = """
import argparse
import json
import sys

import nibabel
import numpy as np
from pathlib import Path

assert sys.argv.pop(1) == "run"
parser = argparse.ArgumentParser()
for word in ("config_file", "meta_file", "bundle_root", "datalist", "output_dir", "output_ext"):
    parser.add_argument("--" + word, required=True)
words = parser.parse_args()
config = json.loads(Path(words.config_file).read_text())
assert "network_data_format" in json.loads(Path(words.meta_file).read_text())
assert Path(words.bundle_root).is_dir()
if "fails" in config:
    sys.exit(config["fails"])
for name in [] if "silent" in config else json.loads(words.datalist):
    scan = nibabel.load(name)
    values = np.asarray(scan.dataobj)
    found = np.where(values > 50, config["written"], np.where(values > 0, 1, 0)).astype(np.float32)
    # MONAI's SaveImaged makes a folder for each scan, and adds a postfix to its name.
    stem = Path(name).name.removesuffix(".nii.gz")
    target = Path(words.output_dir) / stem / (stem + "_trans" + words.output_ext)
    target.parent.mkdir(parents=True)
    nibabel.save(nibabel.Nifti1Image(found, scan.affine), target)
"""


def scan(modality: str = "CT") -> tuple[Volume, np.ndarray]:
    """A block of liver and one of another organ in fat, on an oblique grid, and the liver."""
    rotation, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    grid = Grid((12, 14, 10), [2.0, 2.5, 3.0], [-40.25, 31.5, 812.125], rotation)
    voxels = np.full(grid.shape, -90, dtype=np.int16)
    voxels[1:3, 2:11, 4:8] = 40
    voxels[4:9, 2:11, 4:8] = 110
    return Volume(voxels, grid, modality), voxels > 100


@pytest.fixture
def monai(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Packages that stand in for MONAI and what it needs, for this process and its children."""
    site = tmp_path / "site"
    for name in ("monai/bundle", "torch", "ignite", "fire"):
        (site / name).mkdir(parents=True)
        (site / name / "__init__.py").touch()
    (site / "monai" / "__init__.py").touch()
    (site / "monai" / "bundle" / "__main__.py").write_text(STAND_IN)
    monkeypatch.syspath_prepend(str(site))
    monkeypatch.setenv("PYTHONPATH", str(site), prepend=os.pathsep)


def bundle(folder: Path, **config: object) -> str:
    """The folder of a bundle with the labels spleen and liver, as MONAI's model zoo lays it out."""
    (folder / "configs").mkdir(parents=True)
    formats = {
        "inputs": {"image": {"modality": "CT"}},
        "outputs": {"pred": {"channel_def": {"0": "background", "1": "spleen", "5": "Liver"}}},
    }
    (folder / "configs" / "metadata.json").write_text(json.dumps({"network_data_format": formats}))
    (folder / "configs" / "inference.json").write_text(json.dumps({"written": 5, **config}))
    return str(folder)


def segmenter(*parameters: str) -> MonaiBundle:
    return MonaiBundle(MonaiBundleParameters(*parameters))


@pytest.mark.parametrize("label", ["liver", "5"])
def test_the_bundles_label_is_the_liver(monai: None, tmp_path: Path, label: str) -> None:
    assert MonaiBundle.missing_dependencies() == ()
    volume, liver = scan()
    tumour = np.zeros(liver.shape, dtype=np.uint8)
    tumour[9:11, 5:7, 5:7] = 1
    known = LabelMap(tumour, volume.grid, {1: "tumour1"})
    found = segmenter(bundle(tmp_path / "a bundle"), label).segment(volume, known, NO_SEED)
    assert np.array_equal(found.labels.mask("liver"), liver | (tumour > 0))
    assert found.labels.grid.matches(volume.grid)


def test_a_bundle_that_does_not_fit_is_a_sentence(monai: None, tmp_path: Path) -> None:
    folder, volume = bundle(tmp_path / "bundle"), scan()[0]
    with pytest.raises(BadInput, match=r"has no label 'lung'; it has 1 spleen, 5 Liver"):
        segmenter(folder, "lung").segment(volume, None, NO_SEED)
    with pytest.raises(BadInput, match="is for CT, but the scan is MR"):
        segmenter(folder).segment(scan("MR")[0], None, NO_SEED)
    for absent in ("", str(tmp_path)):
        with pytest.raises(BadInput, match=r"there is no configs/inference\.json"):
            segmenter(absent).segment(volume, None, NO_SEED)
    for text in ("{}", "no JSON", '{"network_data_format": {"outputs": {"pred": {"channel_def": []}}}}'):
        (Path(folder) / "configs" / "metadata.json").write_text(text)
        with pytest.raises(BadInput, match="does not say the bundle's labels"):
            segmenter(folder).segment(volume, None, NO_SEED)


def test_a_bundle_that_fails_is_a_sentence(monai: None, tmp_path: Path) -> None:
    for number, (config, words) in enumerate(
        (
            ({"fails": "no such file: models/model.pt"}, r"ended with the code 1: no such file: models/model\.pt"),
            ({"silent": True}, "ended with 0 files of labels"),
            ({"written": 7}, "found no liver in the scan"),
        )
    ):
        with pytest.raises(StageFailed, match=words):
            segmenter(bundle(tmp_path / str(number), **config)).segment(scan()[0], None, NO_SEED)


def test_absent_packages_say_what_to_install(tmp_path: Path) -> None:
    if missing := MonaiBundle.missing_dependencies():
        with pytest.raises(BadInput, match=f"pip install {' '.join(missing)}"):
            segmenter(bundle(tmp_path / "bundle")).segment(scan()[0], None, NO_SEED)
