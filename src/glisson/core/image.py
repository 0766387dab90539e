"""Voxel images: the scan (`Volume`) and what was found in it (`LabelMap`).

Voxel arrays are indexed [i, j, k]; voxel (i, j, k) has its centre at
`origin + direction @ (spacing * (i, j, k))` in patient LPS coordinates (mm).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glisson.core.arrays import FloatArray, frozen_floats
from glisson.core.errors import BadInput


@dataclass(frozen=True, eq=False)
class Grid:
    """Where voxels lie: shape (i, j, k), spacing (mm), origin (LPS mm), direction (3 × 3, columns)."""

    shape: tuple[int, int, int]
    spacing_mm: FloatArray
    origin_mm: FloatArray
    direction: FloatArray = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        shape = tuple(int(n) for n in self.shape)
        if len(shape) != 3 or min(shape) < 1:
            raise BadInput(f"An image needs three dimensions of at least one voxel, not {shape}.")
        object.__setattr__(self, "shape", shape)
        object.__setattr__(self, "spacing_mm", frozen_floats(self.spacing_mm, (3,), "voxel spacing"))
        object.__setattr__(self, "origin_mm", frozen_floats(self.origin_mm, (3,), "image origin"))
        object.__setattr__(self, "direction", frozen_floats(self.direction, (3, 3), "image direction"))
        if float(self.spacing_mm.min()) <= 0.0:
            raise BadInput(f"Voxel spacing must be positive, not {self.spacing_mm.tolist()} mm.")
        if not np.allclose(self.direction.T @ self.direction, np.eye(3), atol=1e-3):
            raise BadInput("The image axes are not perpendicular (sheared or tilted scan); resample it first.")

    @property
    def voxel_volume_mm3(self) -> float:
        """Volume of one voxel in mm³."""
        return float(np.prod(self.spacing_mm))

    @property
    def lps_from_index(self) -> FloatArray:
        """4 × 4 affine that takes voxel indices (i, j, k, 1) to LPS mm."""
        affine = np.eye(4)
        affine[:3, :3] = self.direction * self.spacing_mm
        affine[:3, 3] = self.origin_mm
        return affine

    def points_from_indices(self, indices: ArrayLike) -> FloatArray:
        """LPS mm (n, 3) of (fractional) voxel indices (n, 3)."""
        ijk = np.asarray(indices, dtype=np.float64)
        return ijk * self.spacing_mm @ self.direction.T + self.origin_mm

    def indices_from_points(self, points_mm: ArrayLike) -> FloatArray:
        """Fractional voxel indices (n, 3) of LPS points (n, 3) in mm."""
        offset = np.asarray(points_mm, dtype=np.float64) - self.origin_mm
        result: FloatArray = offset @ np.linalg.inv(self.direction).T / self.spacing_mm
        return result

    def matches(self, other: "Grid", tolerance_mm: float = 1e-3) -> bool:
        """Whether both grids put every voxel centre at the same place within the tolerance."""
        if self.shape != other.shape:
            return False
        corners = np.array(np.meshgrid(*[(0, n - 1) for n in self.shape])).reshape(3, -1).T
        apart = self.points_from_indices(corners) - other.points_from_indices(corners)
        return bool(np.abs(apart).max() <= tolerance_mm)


@dataclass(frozen=True, eq=False)
class Volume:
    """A scan: voxels [i, j, k] (HU for CT, arbitrary for MR) on a grid. `modality` is "CT" or "MR"."""

    voxels: NDArray[Any]
    grid: Grid
    modality: str = "CT"

    def __post_init__(self) -> None:
        _check_voxels(self.voxels, self.grid)
        if self.modality not in ("CT", "MR"):
            raise BadInput(f"Modality must be CT or MR, not {self.modality!r}.")
        if self.voxels.dtype.kind == "f" and not np.isfinite(self.voxels).all():
            raise BadInput("The image has voxels that are not finite numbers.")
        self.voxels.setflags(write=False)


@dataclass(frozen=True, eq=False)
class LabelMap:
    """Whole-number labels [i, j, k] on a grid, 0 being background, and the name of each label."""

    voxels: NDArray[Any]
    grid: Grid
    names: Mapping[int, str]

    def __post_init__(self) -> None:
        _check_voxels(self.voxels, self.grid)
        if self.voxels.dtype.kind not in "iu":
            raise BadInput(f"A label map must hold whole numbers, not {self.voxels.dtype}.")
        names = {int(number): str(name) for number, name in self.names.items()}
        if len(set(names.values())) != len(names) or 0 in names:
            raise BadInput("Label names must differ from each other, and 0 is background.")
        self.voxels.setflags(write=False)
        object.__setattr__(self, "names", MappingProxyType(names))

    def number(self, name: str) -> int:
        """The label number that carries `name`.

        Raises:
            BadInput: there is no such label.
        """
        for number, known in self.names.items():
            if known == name:
                return number
        raise BadInput(f"The label map has no label {name!r}; it has {sorted(self.names.values())}.")

    def mask(self, *names: str) -> NDArray[np.bool_]:
        """Boolean voxels [i, j, k] that carry any of the named labels."""
        return np.isin(self.voxels, [self.number(name) for name in names])

    def volume_ml(self, *names: str) -> float:
        """Volume of the named labels together, in ml."""
        return float(self.mask(*names).sum()) * self.grid.voxel_volume_mm3 * 1e-3


def _check_voxels(voxels: NDArray[Any], grid: Grid) -> None:
    if tuple(voxels.shape) != grid.shape:
        raise BadInput(f"The voxel array has shape {voxels.shape} but its grid says {grid.shape}.")
