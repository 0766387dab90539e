"""A real CT (3D-IRCADb-01, case 17): the whole way, from its masks and from the CT with one click."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glisson.framework.case import SETTINGS
from glisson.io.dicom import read_dicom_mask

pytestmark = pytest.mark.real

Glisson = Callable[..., tuple[int, dict[str, Any]]]

COARSE = ("--mesh.edge-length-mm", "32", "--mesh.envelope-mm", "3", "--surface.edge-length-mm", "8")
LESS_COARSE = ("--mesh.edge-length-mm", "24", "--mesh.envelope-mm", "2", "--surface.edge-length-mm", "7")
"""The lift of the liver that is found from a click slips in its second stage, and stagnates on the coarser mesh."""

CLICK_MM = "129,155,123"
"""In the right lobe, away from vessels and tumours, as a person would click."""

PLANE = """
[plane]
points_mm = [[172.0, 100.0, 100.0], [172.0, 200.0, 100.0], [172.0, 100.0, 170.0]]
"""
"""A sagittal plane medial of tumour2, which lies in the left lobe; the case has no wire for the rule."""


def plan(case: Path) -> None:
    """The target in the left lobe and a plane beside it."""
    text = (case / SETTINGS).read_text()
    text = text.replace("# target =", 'target = "tumour2"').replace("[plane]\n", PLANE.strip() + "\n")
    (case / SETTINGS).write_text(text)


def centroid_mm(folder: Path) -> np.ndarray:
    """Centroid of a DICOM mask, voxel by voxel."""
    image = read_dicom_mask(folder)
    return image.grid.points_from_indices(np.argwhere(image.voxels > 0)).mean(axis=0)


def check_guidance(said: dict[str, Any], ircad: Path) -> None:
    assert said["status"] == "converged"
    for name in ("tumour1", "tumour2"):
        tumour = next(found for found in said["tumours"] if found["name"] == name)
        assert np.linalg.norm(tumour["before_mm"] - centroid_mm(ircad / "MASKS_DICOM" / f"livertumor{name[-1]}")) < 0.5
        assert tumour["error_mm"] is None
    left, right = (
        np.subtract(found["after_mm"], found["before_mm"])
        for found in sorted(said["tumours"], key=lambda found: -found["before_mm"][0])
    )
    # The lever lifts the left lobe: towards the belly, and much more than the right one.
    assert left[1] < -0.5
    assert np.linalg.norm(left) > 2.0 * np.linalg.norm(right)
    assert said["tumour"]["name"] == "tumour2"
    assert said["plane"]["rule"] is None
    assert said["wire"] is None
    assert 0.05 < said["volume"]["removed_before"] < 0.6


def test_from_the_masks(ircad: Path, tmp_path: Path, glisson: Glisson) -> None:
    case = tmp_path / "case"
    assert glisson("new", case, "--ct", ircad / "PATIENT_DICOM", "--labels", ircad / "MASKS_DICOM")[0] == 0
    plan(case)
    code, said = glisson("run", case, *COARSE)
    assert code == 0, said
    check_guidance(said, ircad)
    assert said["volume"]["liver_ml"] == pytest.approx(1861.0, rel=0.01)  # as the data's provenance says
    assert (case / "results/report.html").stat().st_size > 100_000
    print(json.dumps({key: said[key] for key in ("tumours", "plane", "volume", "seconds")}, indent=1))


def test_from_the_scan_and_one_click(
    ircad: Path, tmp_path: Path, glisson: Glisson, capfd: pytest.CaptureFixture[str]
) -> None:
    case, masks = tmp_path / "case", ircad / "MASKS_DICOM"
    tumours = [masks / "livertumor1", masks / "livertumor2"]
    assert glisson("new", case, "--ct", ircad / "PATIENT_DICOM", "--labels", *tumours)[0] == 0
    code, found = glisson("segment", case, "--seed-point", CLICK_MM, "--reference", masks / "liver")
    assert code == 0, found
    plan(case)
    code, said = glisson("run", case, *LESS_COARSE)
    assert code == 0, said
    check_guidance(said, ircad)
    with capfd.disabled():
        print(
            f"\n3D-IRCADb-01 case 17 from one click: Dice {found['dice']:.4f}, mean surface distance "
            f"{found['asd_mm']:.2f} mm, 95 % within {found['hd95_mm']:.2f} mm, {found['seconds']:.0f} s"
        )
    # The prototypes' one-click figures on this kind of scan begin at 0.91; 0.945 is aimed at.
    assert found["dice"] > 0.93
