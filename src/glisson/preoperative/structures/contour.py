"""Structures by a localized active contour that starts from the threshold's result (the dissertation's "snake")."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.image import Volume
from glisson.preoperative.contours.localized_contour import LocalizedContourParameters, evolve
from glisson.preoperative.structures.kinds import Kind
from glisson.preoperative.structures.marker import StructureMarker
from glisson.preoperative.structures.soft import SoftPiece

_RADIUS_MM = (4.0, 8.0)
_FREEDOM_MM = 3.0
"""How far the contour may get from the threshold's border: more is another structure."""


class ContourStructure(StructureMarker):
    """The threshold's result, its border moved to where the grey values about it part best."""

    name: ClassVar[str] = "contour"
    summary: ClassVar[str] = "The threshold's result as the start of a localized active contour; not for metal."

    def _piece(
        self, volume: Volume, liver: NDArray[np.bool_] | None, kind: Kind, point_mm: FloatArray
    ) -> tuple[tuple[slice, ...], NDArray[np.bool_]]:
        if kind.is_metal:
            raise BadInput(f"A {kind.noun} is too thin for a contour; mark it with --technique threshold.")
        return super()._piece(volume, liver, kind, point_mm)

    def _refined(self, piece: SoftPiece) -> NDArray[np.bool_]:
        spacing = piece.block.spacing_mm
        size_mm = float((0.75 / np.pi * piece.mask.sum() * np.prod(spacing)) ** (1.0 / 3.0))
        band = piece.band
        half = min(band.high - band.grey, band.grey - band.low)
        radius = float(np.clip(0.6 * size_mm, *_RADIUS_MM))
        forces = LocalizedContourParameters(radius_mm=radius, contrast=max(half, 1e-3))
        # Grey values far off the band would draw the means of what is outside, and the contour, to them.
        values = np.clip(piece.block.values, band.grey - 3.0 * half, band.grey + 3.0 * half)
        found: NDArray[np.bool_] = evolve(values, piece.mask, spacing, forces, _FREEDOM_MM).mask & piece.within
        return found if found.any() else piece.mask
