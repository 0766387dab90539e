"""The liver of a real CT (3D-IRCADb-01, case 17), found and corrected; tumours count as liver."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core import Volume
from glisson.framework.segmentation_scores import segmentation_scores
from glisson.io.dicom import read_dicom_mask
from glisson.io.images import read_volume
from glisson.preoperative.correction.correcting import Correcting
from glisson.preoperative.liver.seeded_contour import SeededContour, SeededContourParameters

pytestmark = pytest.mark.real

Mask = NDArray[np.bool_]


@pytest.fixture(scope="module")
def scan(ircad: Path) -> tuple[Volume, Mask]:
    """The CT and its liver."""
    liver = read_dicom_mask(ircad / "MASKS_DICOM" / "liver")
    return read_volume(ircad / "PATIENT_DICOM"), np.asarray(liver.voxels) > 0


@pytest.fixture(scope="module")
def automatic(scan: tuple[Volume, Mask]) -> Mask:
    """The liver as it is found without a click."""
    found = SeededContour(SeededContourParameters()).segment(scan[0], None, np.zeros((0, 3)))
    return found.labels.mask("liver")


def check(
    what: str,
    found: Mask,
    scan: tuple[Volume, Mask],
    least: tuple[float, float, float],
    capfd: pytest.CaptureFixture[str],
) -> None:
    """Print the scores, with the worst slice, and compare with the least: Dice, mean and 95 % distance in mm."""
    volume, true = scan
    scores = segmentation_scores(found, true, volume.grid)
    own = np.flatnonzero(true.any(axis=(0, 1)))
    overlap = [2.0 * (found & true)[:, :, k].sum() / (found[:, :, k].sum() + true[:, :, k].sum()) for k in own]
    with capfd.disabled():
        print(
            f"\n3D-IRCADb-01 case 17, {what}: Dice {scores.dice:.4f}, mean surface distance {scores.asd_mm:.2f} mm, "
            f"95 % within {scores.hd95_mm:.2f} mm; "
            f"worst slice {own[int(np.argmin(overlap))]} with Dice {min(overlap):.3f}"
        )
    assert scores.dice >= least[0]
    assert scores.asd_mm <= least[1]
    assert scores.hd95_mm <= least[2]


def test_without_a_click(scan: tuple[Volume, Mask], automatic: Mask, capfd: pytest.CaptureFixture[str]) -> None:
    check("no click", automatic, scan, (0.93, 2.5, 12.0), capfd)


def test_a_tenth_of_the_slices_corrected(
    scan: tuple[Volume, Mask], automatic: Mask, capfd: pytest.CaptureFixture[str]
) -> None:
    """Each slice where the program suggests it after those before; 0.975, 0.8 mm and 3 mm are aimed at."""
    volume, true = scan
    box = (*ndimage.find_objects((automatic | true).any(axis=2).astype(np.uint8))[0], slice(None))
    correcting = Correcting(automatic[box], volume.grid.spacing_mm)
    for _ in range(round(0.1 * true.any(axis=(0, 1)).sum())):
        number = correcting.suggest()
        correcting.correct(number, true[box][:, :, number])
    corrected = np.zeros_like(true)
    corrected[box] = correcting.mask
    check(f"slices {correcting.corrected} corrected", corrected, scan, (0.965, 1.1, 3.5), capfd)
