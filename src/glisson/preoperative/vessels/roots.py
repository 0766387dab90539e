"""Where the portal and the hepatic veins start: as clicked, or the widest vessel where anatomy lets one expect it.

Portal vein: enters at the hilum, low, in the middle and at the back. Hepatic veins: meet at the vena cava, high, in the
middle and at the back. Places are in standard deviations of the liver's own voxels from its centroid along the
patient's axes, so that they hold for livers of any size.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.image import LabelMap
from glisson.preoperative.vessels.skeleton import Piece

_EXPECTED = {"portal": (0.5, 0.5, -0.4), "hepatic": (0.5, 0.5, 1.1)}
"""Place along left, back and head."""

_SPREAD = 0.7
_FARTHEST_CLICK_MM = 15.0
_ANOTHER_MM = 30.0
_WIDE_MM = 3.0
_SURE = 1.5


@dataclass(frozen=True, eq=False)
class Root:
    """Points (k, 3) LPS mm, and why they may be wrong (empty: they were clicked, or nothing rivals it)."""

    points_mm: FloatArray
    doubt: str = ""


def likely_roots(
    pieces: Mapping[str, Sequence[Piece]], organ: LabelMap, clicks: Mapping[str, FloatArray]
) -> dict[str, Root]:
    """The root of each system.

    Args:
        pieces: of the vessels in which the system lies.
        organ: the organ ("liver").
        clicks: roots (k, 3) LPS mm that a person gave, by system.

    Raises:
        BadInput: a click lies far from all vessels, or there is no vessel.
    """
    for name, own in pieces.items():
        if not own:
            raise BadInput(f"The mask of the {name} veins is too small to have a centreline; check it.")
    voxels = organ.grid.points_from_indices(np.argwhere(organ.mask("liver")))
    middle, spread = voxels.mean(axis=0), voxels.std(axis=0)
    return {
        name: _clicked(name, own, clicks[name]) if name in clicks else _expected(name, own, middle, spread)
        for name, own in pieces.items()
    }


def _clicked(name: str, pieces: Sequence[Piece], clicks: FloatArray) -> Root:
    for click in clicks:
        _require_vessel(name, pieces, click)
    return Root(clicks)


def _require_vessel(name: str, pieces: Sequence[Piece], click: FloatArray) -> None:
    apart = min(float((np.linalg.norm(piece.points_mm - click, axis=1) - piece.radii_mm).min()) for piece in pieces)
    if apart > _FARTHEST_CLICK_MM:
        place = ", ".join(f"{value:.1f}" for value in click)
        raise BadInput(
            f"The click --{name} ({place}) lies {apart:.0f} mm from the nearest vessel that was found; click into the "
            f"{name} vein where it enters the liver (LPS mm)."
        )


def _expected(name: str, pieces: Sequence[Piece], middle: FloatArray, spread: FloatArray) -> Root:
    points = np.concatenate([piece.points_mm for piece in pieces])
    radii = np.concatenate([np.full(len(piece.points_mm), piece.radius_mm) for piece in pieces])
    off = ((points - middle) / spread - _EXPECTED[name]) / _SPREAD
    scores = radii * np.exp(-0.5 * np.square(off).sum(axis=1))
    best = int(np.argmax(scores))
    elsewhere = np.linalg.norm(points - points[best], axis=1) > _ANOTHER_MM
    rival = float(scores[elsewhere].max(initial=0.0))
    if radii[best] < _WIDE_MM:
        return Root(points[best : best + 1], f"the vessel there is only {2.0 * radii[best]:.0f} mm wide")
    if scores[best] < _SURE * rival:
        return Root(points[best : best + 1], "another vessel is as likely")
    return Root(points[best : best + 1])
