"""Tumours and the gallbladder: the grey values about a click, within what anatomy allows."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput, StageFailed
from glisson.core.image import Volume
from glisson.core.status import Status
from glisson.core.units import place_text
from glisson.geometry.distance_map import distance_inside
from glisson.preoperative.structures.block import Block, block_about
from glisson.preoperative.structures.grey_band import GreyBand, band_against, band_among, frequent, settled
from glisson.preoperative.structures.kinds import TUMOUR, Kind
from glisson.preoperative.structures.parameters import StructureParameters
from glisson.preoperative.structures.piece import piece_about

_NEAR_MM = 4.0
"""What was clicked is looked for so near to the click."""

_ABOUT_MM = 25.0
_GROWN_MM = 3.0
"""A tumour may bulge so far out of the liver's mask, which need not be right to the voxel."""

_SOFT_HU = (-30.0, 300.0)
"""A click below lies in fat or air, one above in bone or metal."""

_WIDEST_HU = 25.0
"""Fluid is told from the bowel's wall beside it: half of their difference in a CT."""

_SETTLING_HU = 10.0


@dataclass(frozen=True, eq=False)
class SoftPiece:
    """What was found about a click: its block of the scan, where it may lie in that, its grey values, and its mask."""

    block: Block
    within: NDArray[np.bool_]
    band: GreyBand
    mask: NDArray[np.bool_]


def soft_piece(
    volume: Volume, organ: NDArray[np.bool_] | None, kind: Kind, point_mm: FloatArray, chosen: StructureParameters
) -> SoftPiece:
    """What was clicked, a tumour or the gallbladder.

    Args:
        volume: the scan.
        organ: the liver [i, j, k] on its grid, where it is known.
        kind: what is looked for.
        point_mm: the click (3,), LPS mm.
        chosen: how far, and through which passages.

    Raises:
        BadInput: the click lies outside the scan, in fat, air or bone, or for a tumour outside the liver.
        StageFailed: nothing stands out there.
    """
    block = block_about(volume, point_mm, chosen.reach_mm)
    if volume.modality == "CT":
        _require_soft(block, kind, point_mm)
    inside = None if organ is None else organ[block.place]
    within = _within(block, inside, kind, point_mm)
    near = block.ball(_NEAR_MM) & within
    band = _against_liver(block, within, near) if kind is TUMOUR else _fluid(block, near, volume.modality)
    mask = np.zeros(within.shape, dtype=bool)
    if band is not None:
        mask = within & piece_about(within & band.holds(block.values), near, block.spacing_mm, chosen.passage_mm)
    if band is None or not mask.any():
        raise StageFailed(
            f"Nothing stands out at {place_text(point_mm)}: the grey value there, {block.clicked:.0f}, is that of the "
            f"tissue about it; click into the middle of the {kind.noun}.",
            Status.UNOBSERVABLE,
        )
    return SoftPiece(block, within, band, mask)


def _require_soft(block: Block, kind: Kind, point_mm: FloatArray) -> None:
    low, high = _SOFT_HU
    if not low <= block.clicked <= high:
        tissue = "fat or air" if block.clicked < low else "bone or metal"
        raise BadInput(
            f"The click {place_text(point_mm)} lies in {tissue} ({block.clicked:.0f} HU); click into the {kind.noun}."
        )


def _within(block: Block, organ: NDArray[np.bool_] | None, kind: Kind, point_mm: FloatArray) -> NDArray[np.bool_]:
    """Where a structure may lie: a tumour in the liver and a little beyond, the gallbladder outside of the liver."""
    everywhere = np.ones(block.values.shape, dtype=bool)
    clicked = block.distance_mm == 0.0
    if organ is None:
        return everywhere
    if kind is TUMOUR:
        grown: NDArray[np.bool_] = distance_inside(~organ, block.spacing_mm) <= _GROWN_MM
        if not grown[clicked].any() or not organ.any():
            raise BadInput(
                f"The click {place_text(point_mm)} lies outside the liver's mask; click into the tumour, or correct "
                "the mask first with glisson correct."
            )
        return grown
    return everywhere if organ[clicked].any() else ~organ


def _against_liver(block: Block, within: NDArray[np.bool_], near: NDArray[np.bool_]) -> GreyBand | None:
    """A tumour is what differs from most of the liver about it, to the click's side."""
    return band_against(frequent(block.values[within]), block.values[near], block.clicked, block.noise)


def _fluid(block: Block, near: NDArray[np.bool_], modality: str) -> GreyBand:
    """Fluid is what lies nearest to its usual grey value; no scale tells that in an MR."""
    if modality != "CT":
        return band_among(block.values[block.ball(_ABOUT_MM)], block.clicked, block.noise, np.inf)
    start = float(np.clip(block.clicked, 0.0, _WIDEST_HU))
    width = max(_SETTLING_HU, 3.0 * block.noise)
    if not (np.abs(block.values[near] - start) <= width).any():
        start = block.clicked  # no fluid, but maybe bile that is thick or holds contrast agent
    grey = settled(start, block.values[near], width)
    return band_among(block.values[block.ball(_ABOUT_MM)], grey, block.noise, _WIDEST_HU)
