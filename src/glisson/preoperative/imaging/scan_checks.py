"""Whether a scan is fit for what is made of it: the scale of a CT's values, its slices, and the organ's ends.

What makes numbers less good is told; values that are no HU are refused where HU are needed (`require_hu`).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glisson.core.errors import BadInput
from glisson.core.image import Volume
from glisson.preoperative.imaging.axial import slice_axis
from glisson.preoperative.imaging.borders import touched_borders

_THICK_MM = 5.0
"""Slices farther apart are told. Livers are measured on slices of 5 mm or less."""

_BODY_HU = (-200.0, 300.0)
"""Fat, muscle and organs, with a contrast agent or without: most of a body."""

_OFFSET_HU = 1024.0
"""What most scanners store is HU + 1024 (or 1000)."""

_LEAST_BODY = 0.05
"""Fraction of a scan that body fills at least; bone as dense as soft tissue with that offset fills less."""

_FAT_HU = -30.0
_LEAST_FAT = 1e-3
_CLIPPED = 0.01
"""Fraction of the voxels at the very lowest value, as where all that is darker was cut off."""

_LEAST_SPAN = 50.0
_LARGEST_SAMPLE = 2_000_000


def scan_warnings(volume: Volume) -> tuple[str, ...]:
    """Sentences about a scan that can be used, but not trusted as others are.

    Args:
        volume: a CT or MR.
    """
    found = [] if (fault := hu_fault(volume)) is None else [f"{fault} Nothing that goes by HU can be trusted."]
    apart = float(volume.grid.spacing_mm[slice_axis(volume.grid)])
    if apart > _THICK_MM:
        found.append(
            f"The slices lie {apart:.4g} mm apart: what is between two of them is guessed, so that surfaces, volumes "
            f"and places may be wrong by up to {apart / 2.0:.3g} mm along the patient."
        )
    return tuple(found)


def organ_warnings(mask: NDArray[np.bool_]) -> tuple[str, ...]:
    """Sentences about an organ (i, j, k) that the scan cuts off."""
    return tuple(f"{border.sentence} Volumes lack what is beyond." for border in touched_borders(mask))


def require_hu(volume: Volume) -> None:
    """Refuse a CT whose values are no HU.

    Raises:
        BadInput: they are not, with what they look like.
    """
    if (fault := hu_fault(volume)) is not None:
        raise BadInput(fault)


def hu_fault(volume: Volume) -> str | None:
    """A sentence where the values of a CT are no HU, None where they may be, or the scan is no CT.

    A body has most of its voxels between fat and contrast agent, and some fat or air. Where these lie one offset
    too high, nothing was rescaled; where hardly any are left, it was done twice, or in another way.
    """
    if volume.modality != "CT":
        return None
    voxels = volume.voxels.ravel()
    values = voxels[:: -(-len(voxels) // _LARGEST_SAMPLE)]
    low, high = _BODY_HU
    if _share(values, low + _OFFSET_HU, high + _OFFSET_HU) > _LEAST_BODY:
        return (
            "The values of the CT are no HU: the body's are about 1000 too high, as in images that were never "
            "rescaled; export the scan with its rescale slope and intercept."
        )
    if (share := _share(values, low, high)) < _LEAST_BODY:
        return (
            f"The values of the CT are no HU: only {100.0 * share:.1f} % lie where fat and soft tissue do "
            f"({low:.0f} to {high:.0f} HU), as in images that were rescaled twice; export the scan again."
        )
    least, most = float(voxels.min()), float(voxels.max())
    is_cut = most - least < _LEAST_SPAN or float((values == least).mean()) > _CLIPPED
    if is_cut and float((values < _FAT_HU).mean()) < _LEAST_FAT:
        return (
            f"The values of the CT ({least:.4g} to {most:.4g}) are no HU: there is neither fat nor air, as in images "
            "that were windowed or normalised; export the scan with its HU."
        )
    return None


def _share(values: NDArray[Any], low: float, high: float) -> float:
    return float(((values >= low) & (values <= high)).mean())
