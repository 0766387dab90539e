"""The three label maps of a case: the whole organ, its tumours, and the other structures.

Structures overlap (a liver mask contains its tumours and vessels), so one map cannot hold them all.
"""

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glisson.core import BadInput, Grid, LabelMap, Volume
from glisson.io.stored_image import whole_type

_TUMOUR = re.compile(r"^tumour(\d+)$")


def group_labels(maps: Sequence[LabelMap]) -> dict[str, LabelMap]:
    """Sort masks by their canonical names into "organ", "tumours" and "structures"; empty groups are left out.

    "organ" is the liver with its tumours, label 1. Tumours are numbered by their names. Where structures
    overlap, the smaller one keeps the voxels, since it would vanish otherwise. Of two maps that name the
    same structure the voxels are united.

    Raises:
        BadInput: the maps lie on different grids.
    """
    masks: dict[str, NDArray[np.bool_]] = {}
    for labels in maps:
        require_same_grid(maps[0], labels, "a label map")
        for name in labels.names.values():
            mask = labels.mask(name)
            if mask.any():
                masks[name] = masks[name] | mask if name in masks else mask
    if not masks:
        return {}
    grid = maps[0].grid
    tumours = sorted((name for name in masks if _TUMOUR.match(name)), key=_tumour_number)
    others = [name for name in masks if name != "liver" and name not in tumours]
    groups = {}
    if "liver" in masks:
        organ = np.logical_or.reduce([masks["liver"], *(masks[name] for name in tumours)])
        groups["organ"] = LabelMap(organ.astype(np.uint8), grid, {1: "liver"})
    if tumours:
        groups["tumours"] = _stacked({name: masks[name] for name in tumours}, grid)
    if others:
        groups["structures"] = _stacked({name: masks[name] for name in others}, grid)
    return groups


def require_same_grid(reference: Volume | LabelMap | Grid, other: Volume | LabelMap | Grid, what: str) -> None:
    """Refuse an image that does not lie voxel on voxel with the reference.

    Args:
        reference: the scan, usually.
        other: what must lie on its grid.
        what: the other's name for the sentence ("the label map liver.nii.gz").

    Raises:
        BadInput: the grids differ; both are described.
    """
    wanted = reference if isinstance(reference, Grid) else reference.grid
    found = other if isinstance(other, Grid) else other.grid
    if not wanted.matches(found):
        raise _another_grid(wanted, found, what)


def on_grid_of(reference: Volume | Grid, labels: LabelMap, what: str) -> LabelMap:
    """The same labels on the reference's grid: axes in its order and sense, and cropped parts filled up.

    Other tools often store a scan's labels with axes flipped, or only the box that holds some, though each voxel
    lies on one of the scan's. Nothing is interpolated.

    Args:
        reference: the scan, usually.
        labels: what must lie on its grid.
        what: its name for the sentence ("the label map liver.nii.gz").

    Raises:
        BadInput: the voxels do not coincide, or labelled ones lie outside; both grids are described.
    """
    wanted = reference if isinstance(reference, Grid) else reference.grid
    turn = wanted.direction.T @ labels.grid.direction
    order = np.abs(turn).argmax(axis=1)
    if sorted(order) != [0, 1, 2]:
        raise _another_grid(wanted, labels.grid, what)
    voxels = labels.voxels.transpose(order)
    flipped = [axis for axis in range(3) if turn[axis, order[axis]] < 0.0]
    first = np.zeros(3)
    first[order[flipped]] = np.array(labels.grid.shape)[order[flipped]] - 1
    signs = np.where(np.isin(np.arange(3), flipped), -1.0, 1.0)
    grid = Grid(
        (voxels.shape[0], voxels.shape[1], voxels.shape[2]),
        labels.grid.spacing_mm[order],
        labels.grid.points_from_indices(first),
        labels.grid.direction[:, order] * signs,
    )
    placed = _filled_up(wanted, grid, np.flip(voxels, tuple(flipped)))
    if placed is None:
        raise _another_grid(wanted, labels.grid, what)
    return LabelMap(placed, wanted, labels.names)


def _filled_up(wanted: Grid, grid: Grid, voxels: NDArray[Any]) -> NDArray[Any] | None:
    """Voxels of a part of a grid on the whole; None where they do not coincide or labels lie outside.

    What has the whole's shape is no part of it: shifted by a voxel, it more likely has a wrong origin.
    """
    if wanted.shape == grid.shape:
        return np.ascontiguousarray(voxels) if wanted.matches(grid) else None
    start = np.rint(wanted.indices_from_points(grid.origin_mm[None])[0]).astype(int)
    part = Grid(grid.shape, wanted.spacing_mm, wanted.points_from_indices(start[None])[0], wanted.direction)
    if not part.matches(grid):
        return None
    low = np.maximum(-start, 0)
    high = np.minimum(np.array(wanted.shape) - start, grid.shape)
    inside = tuple(slice(a, max(a, b)) for a, b in zip(low.tolist(), high.tolist(), strict=True))
    if np.count_nonzero(voxels[inside]) < np.count_nonzero(voxels):
        return None
    whole = np.zeros(wanted.shape, dtype=voxels.dtype)
    whole[tuple(slice(a + s.start, a + s.stop) for a, s in zip(start.tolist(), inside, strict=True))] = voxels[inside]
    return whole


def _another_grid(wanted: Grid, found: Grid, what: str) -> BadInput:
    return BadInput(
        f"{what[:1].upper()}{what[1:]} lies on another grid than the scan: {_described(found)}, but the scan has "
        f"{_described(wanted)}; resample it onto the scan's grid with nearest neighbours."
    )


def _stacked(masks: dict[str, NDArray[np.bool_]], grid: Grid) -> LabelMap:
    numbers = {name: number for number, name in enumerate(masks, start=1)}
    voxels: NDArray[Any] = np.zeros(grid.shape, dtype=whole_type(0, len(masks)))
    for name in sorted(masks, key=lambda name: -int(masks[name].sum())):
        voxels[masks[name]] = numbers[name]
    return LabelMap(voxels, grid, {number: name for name, number in numbers.items()})


def _tumour_number(name: str) -> int:
    match = _TUMOUR.match(name)
    assert match is not None  # only names that matched are sorted
    return int(match.group(1))


def _described(grid: Grid) -> str:
    spacing = " × ".join(f"{value:.4g}" for value in grid.spacing_mm)
    origin = ", ".join(f"{value:.2f}" for value in grid.origin_mm)
    turned = (
        "" if np.allclose(grid.direction, np.eye(3), atol=1e-4) else f", axes {np.round(grid.direction, 3).tolist()}"
    )
    return f"{' × '.join(map(str, grid.shape))} voxels of {spacing} mm from ({origin}){turned}"
