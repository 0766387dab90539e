"""Whether the vessels that were found stand out from the organ, as they do in a scan with contrast agent."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.errors import BadInput
from glisson.core.image import LabelMap, Volume

_LEAST_SHARE = 0.005
"""Vessels that can be seen in a portal-venous scan are some 2 to 5 % of a liver."""

_LEAST_RATIO = 1.5
"""Least difference of the medians of vessels and tissue, in standard deviations of the tissue."""


def require_contrast(volume: Volume, organ: LabelMap, vessels: NDArray[np.bool_]) -> None:
    """Refuse vessels that are hardly any, or that look like the tissue around.

    Args:
        volume: the scan.
        organ: the organ ("liver") on its grid.
        vessels: what was found [i, j, k].

    Raises:
        BadInput: the scan shows too little.
    """
    inside = organ.mask("liver")
    share = float((vessels & inside).sum()) / max(int(inside.sum()), 1)
    what = f"only {100.0 * share:.1f} % of it could be vessels"
    if share >= _LEAST_SHARE:
        box = ndimage.find_objects(inside.astype(np.uint8))[0]
        values, own = volume.voxels[box], vessels[box] & inside[box]
        tissue = values[inside[box] & ~ndimage.binary_dilation(own, iterations=2)]
        middle = float(np.median(tissue))
        spread = 1.4826 * float(np.median(np.abs(tissue - middle)))
        apart = abs(float(np.median(values[own])) - middle)
        if apart >= _LEAST_RATIO * spread:
            return
        what = f"what could be vessels differs by {apart:.0f} from tissue that varies by {spread:.0f}"
    raise BadInput(
        f"The liver's vessels do not stand out in this scan ({what}); vessels need a scan with contrast agent in the "
        "portal-venous phase, or label maps given to glisson new."
    )
