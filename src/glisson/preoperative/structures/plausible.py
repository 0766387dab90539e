"""Whether what was found can be what was meant: what cannot is refused, what is doubtful told."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.errors import StageFailed
from glisson.core.image import Grid, Volume
from glisson.core.status import Status
from glisson.geometry.distance_map import distance_inside
from glisson.preoperative.imaging.borders import touched_borders
from glisson.preoperative.structures.kinds import GALLBLADDER, TUMOUR, Kind

_THICK_MM = 5.0
"""Metal deeper than this to all sides is no wire's and no stent's."""


def require_plausible(mask: NDArray[np.bool_], grid: Grid, kind: Kind, organ: NDArray[np.bool_] | None) -> None:
    """Refuse a mask [i, j, k] that leaked.

    Raises:
        StageFailed: it is larger than any, fills most of the liver, is cut off by the scan, or is too thick.
    """
    volume_ml = float(mask.sum()) * grid.voxel_volume_mm3 * 1e-3
    advice = "click farther inside, or narrow the search with --reach-mm or --passage-mm"
    if volume_ml > kind.largest_ml:
        raise _leak(f"What was found has {volume_ml:.0f} ml, more than any {kind.noun}; it leaked: {advice}.")
    if kind is TUMOUR and organ is not None and (mask & organ).sum() > 0.6 * organ.sum():
        raise _leak(f"What was found fills most of the liver ({volume_ml:.0f} ml); it leaked: {advice}.")
    if kind.is_metal:
        box = ndimage.find_objects(mask.astype(np.uint8))[0]
        if float(distance_inside(np.pad(mask[box], 1), grid.spacing_mm).max()) > _THICK_MM:
            raise _leak(f"What was found is thicker than a {kind.noun}, as bones and clips are; click elsewhere on it.")
    elif touched_borders(mask):
        raise _leak(
            f"What was found reaches the scan's border, where a {kind.noun} would be cut off or leaked: {advice}."
        )


def doubts(
    mask: NDArray[np.bool_],
    volume: Volume,
    kind: Kind,
    organ: NDArray[np.bool_] | None,
    reach: NDArray[np.bool_],
    seeds_apart: bool,
) -> tuple[str, ...]:
    """Sentences on what a person should look at.

    Args:
        mask: what was found [i, j, k].
        volume: the scan.
        kind: what it should be.
        organ: the liver on the same grid, where it is known.
        reach: the voxels that were looked at.
        seeds_apart: whether several clicks gave parts that do not touch.
    """
    found = []
    if organ is None and kind in (TUMOUR, GALLBLADDER):
        found.append(f"The case has no liver mask, so nothing but grey values holds the {kind.noun} back.")
    if float(mask.sum()) * volume.grid.voxel_volume_mm3 * 1e-3 < kind.small_ml:
        found.append(f"The {kind.noun} has less than {kind.small_ml} ml; a click near its border finds only a part.")
    if kind is GALLBLADDER and organ is not None and (mask & organ).sum() > 0.05 * mask.sum():
        found.append("A part of the gallbladder lies in the liver's mask; one of the two is wrong there.")
    if kind.usual_hu is not None and volume.modality == "CT":
        low, high = kind.usual_hu
        grey = float(np.median(volume.voxels[mask]))
        if not low - 5.0 <= grey <= high + 5.0:
            found.append(f"The {kind.noun} has {grey:.0f} HU; fluid usually has {low:.0f} to {high:.0f} HU.")
    if kind.is_metal and touched_borders(mask):
        found.append(f"The {kind.noun} reaches the scan's border and may go on beyond.")
    edge = reach & ~ndimage.binary_erosion(reach, border_value=1)
    if (mask & edge).any():
        found.append("It reaches as far as was looked (--reach-mm) and may go on beyond, or have leaked.")
    if seeds_apart:
        found.append("The clicks gave parts that do not touch; check that they belong together.")
    return tuple(found)


def _leak(sentence: str) -> StageFailed:
    return StageFailed(sentence, Status.AMBIGUOUS)
