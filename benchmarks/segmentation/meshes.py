"""Pictures of the benchmark: `python meshes.py COUNT pixels|voxels OUT`, with (about) so many of them."""

import sys
from pathlib import Path

import numpy as np
from problem import MEMBER, START_MM
from scipy import ndimage

from glisson.core.image import Grid
from glisson.io.atomic import atomic_path
from glisson.phantom.appearance import draw_ct
from glisson.phantom.body import BODY_BOX
from glisson.phantom.family import make_phantom
from glisson.preoperative.imaging.ct import smoothed_ct
from glisson.preoperative.imaging.working_grid import WorkingGrid

_FIELD_MM, _LEVEL_MM, _THICKNESS_MM = 358.4, 10.0, 2.0
"""Side and height of the slice: 0.7 mm at 512 pixels, through both lobes and a tumour."""

_SEEN_HU = 84.0
"""Grey values further from the liver's are cut off, or lung would hide the border to fat."""


def slice_grid(pixels: int) -> Grid:
    """One square slice."""
    side = round(np.sqrt(pixels))
    spacing = _FIELD_MM / side
    first = 0.5 * (spacing - _FIELD_MM)
    return Grid((side, side, 1), [spacing, spacing, _THICKNESS_MM], [first, first, _LEVEL_MM])


def scan_grid(voxels: int) -> Grid:
    """The whole phantom in cubes."""
    spacing = float(np.cbrt(np.prod(BODY_BOX[1] - BODY_BOX[0]) / voxels))
    shape = np.ceil((BODY_BOX[1] - BODY_BOX[0]) / spacing).astype(int)
    return Grid((int(shape[0]), int(shape[1]), int(shape[2])), [spacing] * 3, BODY_BOX[0] + 0.5 * spacing)


def main(count: int, element: str, target: Path, member: int = MEMBER) -> None:
    """Scan the phantom, smooth it as Glisson's segmenter does, and write picture, start and truth."""
    grid = slice_grid(count) if element == "pixels" else scan_grid(count)
    phantom = make_phantom(member, grid=grid, appearance=draw_ct(member))
    smooth = smoothed_ct(phantom.volume, WorkingGrid.of(grid, 0.4))
    truth = phantom.organ.mask("liver")
    depth = ndimage.distance_transform_edt(truth, sampling=grid.spacing_mm)
    if element == "pixels":
        smooth, truth = smooth[:, :, 0], truth[:, :, 0]
        depth = ndimage.distance_transform_edt(truth, sampling=grid.spacing_mm[:2])
    start = depth > START_MM
    level = np.float32(np.median(smooth[start]))
    with atomic_path(target) as path:
        np.savez_compressed(
            path,
            picture=np.clip(smooth, level - _SEEN_HU, level + _SEEN_HU),
            spacing_mm=grid.spacing_mm[: truth.ndim],
            start=start,
            truth=truth,
        )


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2], Path(sys.argv[3]))
