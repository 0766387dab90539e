"""Puts the scanned surface in order with the tools before anything moves."""

from collections.abc import Mapping, Sequence

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.units import place_text
from glisson.mechanics.contact import ToolContact
from glisson.mechanics.rest_shape import Support


def settle_gaps(
    contacts: Sequence[ToolContact],
    points_mm: FloatArray,
    supports: Mapping[str, Support],
    tolerance_mm: float,
) -> None:
    """Choose each tool's offsets so that the scanned shape starts in equilibrium.

    A segmented surface is known to about a voxel. Where a board carried the organ, each pressed point
    starts at the gap at which it has the pressure of the rest shape; every other point that would start
    within a cushion is moved just out of it.

    Args:
        contacts: one for each tool, at its starting angle.
        points_mm: surface points (p, 3) of the scanned shape.
        supports: board name → how it carried the organ in the scanned shape.
        tolerance_mm: the deepest cut of a tool into the organ that may be put down to the segmentation.

    Raises:
        BadInput: a tool cuts deeper into the organ.
    """
    for contact in contacts:
        gaps = contact.gaps(points_mm)
        deepest = float(gaps.min())
        if deepest < -tolerance_mm:
            where = place_text(points_mm[int(gaps.argmin())])
            raise BadInput(
                f"{contact.tool.name!r} cuts {-deepest:.1f} mm into the organ at {where} before anything moves; "
                f"at most {tolerance_mm:g} mm can be put down to the segmentation, so move it away."
            )
        cushion = contact.cushion
        offsets = np.maximum(cushion.range_mm - gaps, 0.0)
        support = supports.get(contact.tool.name)
        if support is not None:
            # Bedding that has taken the organ's shape is met at once where it does not press yet.
            held = np.ones_like(support.points, dtype=bool) if support.conforming else support.pressures > 0.0
            points = support.points[held]
            offsets[points] = cushion.gap(support.pressures[held]) - gaps[points]
        contact.states.offsets = offsets
