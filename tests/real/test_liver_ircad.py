"""The liver of a real CT (3D-IRCADb-01, case 17), found and corrected; tumours count as liver."""

import tarfile
import tempfile
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
from glisson.preoperative.correction.drawn_slices import DrawnSlices
from glisson.preoperative.imaging.ct import smoothed_ct
from glisson.preoperative.imaging.working_grid import WorkingGrid
from glisson.preoperative.liver.organ_region import found_region
from glisson.preoperative.liver.seeded_contour import SeededContour, SeededContourParameters

pytestmark = pytest.mark.real

Mask = NDArray[np.bool_]


@pytest.fixture(scope="module")
def scan(shared_data: Path) -> tuple[Volume, Mask]:
    """The CT and its liver; nothing of it stays on the disk."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for part in ("PATIENT_DICOM", "MASKS_DICOM"):
            with tarfile.open(shared_data / "research-only" / "ircadb01-case17" / f"{part}.tar.xz") as archive:
                archive.extractall(folder, filter="data")
        liver = read_dicom_mask(folder / "MASKS_DICOM" / "liver")
        return read_volume(folder / "PATIENT_DICOM"), np.asarray(liver.voxels) > 0


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


def test_a_click_anywhere_in_the_liver_says_that_it_is_the_liver(scan: tuple[Volume, Mask]) -> None:
    """Wherever in the found region it lies, the mask is that without a click."""
    volume, true = scan
    grid = WorkingGrid.of(volume.grid, SeededContourParameters().resolution_mm)
    smooth = smoothed_ct(volume, grid)
    _, region = found_region(volume, smooth, grid, np.zeros(smooth.shape, dtype=bool), [])
    assert region is not None
    inside = np.argwhere(true)
    clicks = inside[np.random.default_rng(17).integers(len(inside), size=20)].astype(float)
    assert all(region.holds(grid.working_index(click), smooth, grid.spacing_mm) for click in clicks)


def test_six_contours(scan: tuple[Volume, Mask], automatic: Mask, capfd: pytest.CaptureFixture[str]) -> None:
    """The dissertation's groups of about 20 slices, with a true contour on the middle of each; 0.96 is aimed at."""
    volume, true = scan
    own = np.flatnonzero(true.any(axis=(0, 1)))
    numbers = np.linspace(own[0], own[-1] + 1, 13)[1::2].astype(int)
    check(
        "six contours", DrawnSlices(automatic, true, numbers.tolist(), volume.grid).mask, scan, (0.94, 2.3, 10.0), capfd
    )


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
