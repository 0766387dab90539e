"""The liver from a CT and a click or none, or an MR and a click: localized contours from slice to slice.

The start is found (`automatic_start`), and a click confirms it; one elsewhere is the start itself. What of the start's
band belongs together with it, by the width of passages and the grey value, is the region that the contours start from
(`scene`), completed by surface tumours; the grey values settle with it. The contours run from the largest slice to both
ends (`propagation`), and where the scan's voxels are finer the border is found again in them (`fine_border`).
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput, StageFailed
from glisson.core.image import Grid, LabelMap, Volume
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, Segmentation, silent
from glisson.core.status import Status
from glisson.core.units import place_text
from glisson.preoperative.contours.localized_contour import LocalizedContourParameters
from glisson.preoperative.imaging.axial import slice_axis
from glisson.preoperative.imaging.borders import touched_borders
from glisson.preoperative.imaging.clicked import checked_clicks
from glisson.preoperative.imaging.ct import smoothed_ct
from glisson.preoperative.imaging.mr import smoothed_mr
from glisson.preoperative.imaging.working_grid import WorkingGrid
from glisson.preoperative.liver.automatic_start import Start, find_start
from glisson.preoperative.liver.between_lungs import between_lungs
from glisson.preoperative.liver.completion import without_gaps
from glisson.preoperative.liver.fine_border import fine_border
from glisson.preoperative.liver.intensity_prior import IntensityPrior
from glisson.preoperative.liver.propagation import propagate
from glisson.preoperative.liver.reachable import opened
from glisson.preoperative.liver.scene import GAP_MM, Scene, holds, region_about
from glisson.preoperative.liver.slice_flags import flag_slices

_SMALLEST_ML = 100.0
_USUAL_ML = (500.0, 4000.0)
"""Volumes of adults' livers; what is outside is shown to a person."""


@dataclass(frozen=True)
class SeededContourParameters:
    """Resolution at which is worked, and the localized contour's forces."""

    resolution_mm: float = parameter(1.6, "Voxels are averaged to about this size, mm.", 0.4, 5.0)
    energy: str = parameter(
        "uniform", "Contour energy: uniform modelling or mean separation.", choices=("uniform", "separation")
    )
    radius_mm: float = parameter(8.0, "Radius of the ball in which the contour looks at the image, mm.", 2.0, 50.0)
    curvature: float = parameter(0.5, "Weight of the contour's curvature, in voxels.", 0.0, 10.0)
    iterations: int = parameter(30, "Iterations of the contour in each slice at most.", 1, 1000)


class SeededContour:
    """Liver from one click, or from none."""

    name: ClassVar[str] = "seeded-contour"
    summary: ClassVar[str] = (
        "Liver from a CT with or without a click, or an MR with one, by contours from slice to slice."
    )
    Parameters: ClassVar[type[SeededContourParameters]] = SeededContourParameters

    def __init__(self, parameters: SeededContourParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """Nothing beyond Glisson's own dependencies."""
        return ()

    def segment(
        self, volume: Volume, labels: LabelMap | None, seeds_mm: FloatArray, progress: Progress = silent
    ) -> Segmentation:
        """The liver ({1: "liver"}) with its tumours and vessels, and the slices to look at.

        Args:
            volume: a CT (HU), or an MR.
            labels: tumours that are known already ("tumour1" and so on); they belong to the liver.
            seeds_mm: clicks inside the liver, (n, 3) LPS mm; without any the widest even tissue on the right of a CT
                is taken.
            progress: told how far it is.

        Raises:
            BadInput: a click outside the scan or in air, fat or bone, labels on another grid, a CT whose values are no
                HU, or an MR without a click.
            StageFailed: nothing like a liver lies about the click, or is found without one.
        """
        known = _known_tumours(volume, labels)
        grid = WorkingGrid.of(volume.grid, self._parameters.resolution_mm)
        progress(0.0, "smoothing")
        seeds_mm = np.asarray(seeds_mm, dtype=np.float64).reshape(-1, 3)
        smooth, clicked = _smoothed(volume, grid, seeds_mm)
        _require_soft_tissue(smooth, clicked, seeds_mm)
        progress(0.05, "region")
        tumours = grid.working(known) >= 0.5
        start = _start(smooth, volume, grid, needed=not clicked)
        thorax = between_lungs(smooth, grid, volume.grid) if volume.modality == "CT" else None
        scene = Scene(smooth, grid.spacing_mm, tumours, thorax)
        found = None if start is None else region_about(scene, [_place(start, volume.grid, grid)])
        if clicked and (found is None or not holds(found[0], clicked, grid)):
            found = region_about(scene, clicked)
        if found is None:
            raise BadInput("There is no soft tissue about the click; click inside the liver.")
        region, prior = found
        _require_volume(region, grid, seeds_mm if start is None or clicked else start.point_mm[None])
        organ, flags = self._contoured(smooth, region, prior, grid, progress)
        on_scan = fine_border(volume, organ, smooth, prior, grid) if volume.modality == "CT" else grid.full(organ)
        full = ndimage.binary_fill_holes(on_scan | known)
        flags += [(border.slice_near(volume.grid), border.sentence) for border in touched_borders(full)]
        flags += _volume_flag(full, volume.grid) + _start_flags(None if clicked else start, full, volume.grid)
        return Segmentation(LabelMap(full.astype(np.uint8), volume.grid, {1: "liver"}), tuple(sorted(flags)))

    def _contoured(
        self,
        smooth: NDArray[np.float32],
        region: NDArray[np.bool_],
        prior: IntensityPrior,
        grid: WorkingGrid,
        progress: Progress,
    ) -> tuple[NDArray[np.bool_], list[tuple[int, str]]]:
        """The contours' mask, cleaned in 3-D, and the slices that look wrong (the scan's numbers)."""
        chosen = self._parameters
        forces = LocalizedContourParameters(
            energy=chosen.energy,
            radius_mm=chosen.radius_mm,
            curvature=chosen.curvature,
            iterations=chosen.iterations,
        )
        image = np.clip(smooth, *prior.visible)
        mask, contours = propagate(
            image, region, grid.spacing_mm, forces, lambda done, message: progress(0.4 + 0.5 * (done or 0.0), message)
        )
        progress(0.9, "clean-up")
        voxel = float(grid.spacing_mm.max())
        cleaned = opened(without_gaps(mask, smooth, grid.spacing_mm, GAP_MM), grid.spacing_mm, voxel)
        flags = flag_slices(contours, cleaned, smooth, prior, grid, region)
        return cleaned, flags


def _known_tumours(volume: Volume, labels: LabelMap | None) -> NDArray[np.bool_]:
    """Voxels [i, j, k] of the tumours that are labelled already."""
    names = [] if labels is None else [name for name in labels.names.values() if name.startswith("tumour")]
    if labels is None or not names:
        return np.zeros(volume.grid.shape, dtype=bool)
    if not volume.grid.matches(labels.grid):
        raise BadInput("The label map of the tumours lies on another grid than the scan; resample it onto the scan's.")
    return labels.mask(*names)


def _smoothed(
    volume: Volume, grid: WorkingGrid, seeds_mm: FloatArray
) -> tuple[NDArray[np.float32], list[tuple[int, int, int]]]:
    """Smoothed values (HU, or on their scale), and the working voxels that were clicked."""
    clicked = [grid.working_index(index) for index in checked_clicks(volume.grid, seeds_mm)]
    if volume.modality == "CT":
        return smoothed_ct(volume, grid), clicked
    if not clicked:
        raise BadInput(
            "In an MR the liver is not found without a click, since its signal has no scale; give --seed-point "
            "X,Y,Z (LPS mm)."
        )
    return smoothed_mr(volume, grid, clicked), clicked


def _start(smooth: NDArray[np.float32], volume: Volume, grid: WorkingGrid, needed: bool) -> Start | None:
    """Where the liver seems to be, whatever was clicked; None in an MR, and where a click has to tell."""
    if volume.modality != "CT":
        return None
    try:
        return find_start(smooth, grid, volume.grid)
    except StageFailed:
        if needed:
            raise
        return None


def _place(start: Start, scan: Grid, grid: WorkingGrid) -> tuple[int, int, int]:
    return grid.working_index(scan.indices_from_points(start.point_mm[None])[0])


def _require_soft_tissue(
    smooth: NDArray[np.float32], clicked: list[tuple[int, int, int]], seeds_mm: FloatArray
) -> None:
    kinds = ((-200.0, "air"), (-30.0, "fat"), (250.0, ""), (np.inf, "bone or contrast agent"))
    for index, seed in zip(clicked, seeds_mm, strict=True):
        kind = next(name for limit, name in kinds if smooth[index] <= limit)
        if kind:
            raise BadInput(
                f"The click {place_text(seed)} lies in {kind} ({smooth[index]:.0f} HU); click inside the liver."
            )


def _require_volume(region: NDArray[np.bool_], grid: WorkingGrid, seeds_mm: FloatArray) -> None:
    volume_ml = _volume_ml(region, grid)
    if volume_ml < _SMALLEST_ML:
        raise StageFailed(
            f"Only {volume_ml:.1f} ml of like tissue hang together about the click {place_text(seeds_mm[0])}; "
            "click in a larger, even part of the liver.",
            Status.STAGNATED,
        )


def _volume_ml(region: NDArray[np.bool_], grid: WorkingGrid) -> float:
    return float(region.sum() * np.prod(grid.spacing_mm)) * 1e-3


def _volume_flag(mask: NDArray[np.bool_], grid: Grid) -> list[tuple[int, str]]:
    """A sentence at the largest slice when the volume is none of an adult's liver."""
    volume_ml = float(mask.sum()) * grid.voxel_volume_mm3 * 1e-3
    if _USUAL_ML[0] <= volume_ml <= _USUAL_ML[1]:
        return []
    axis = slice_axis(grid)
    largest = int(np.argmax(mask.sum(axis=tuple(a for a in range(3) if a != axis))))
    return [(largest, f"Unusual volume for a liver: {volume_ml:.0f} ml; parts may be missing, or others included.")]


def _start_flags(start: Start | None, mask: NDArray[np.bool_], grid: Grid) -> list[tuple[int, str]]:
    """Where the liver was taken to be without a click, and where else it might be."""
    if start is None:
        return []
    sentence = f"The start was found without a click, at {place_text(start.point_mm)}"
    if start.rival_mm is not None and not mask[_voxel(start.rival_mm, grid)]:
        sentence += f"; an organ at {place_text(start.rival_mm)} is almost as wide: if that is the liver, click into it"
    return [(_voxel(start.point_mm, grid)[slice_axis(grid)], sentence + ".")]


def _voxel(point_mm: FloatArray, grid: Grid) -> tuple[int, int, int]:
    index = np.rint(grid.indices_from_points(point_mm[None])[0]).astype(int)
    i, j, k = np.clip(index, 0, np.array(grid.shape) - 1).tolist()
    return i, j, k
