"""Blending of surfaces in the order in which each ray meets them."""

import numpy as np
from numpy.typing import NDArray

from glisson.geometry.compiled import compiled

Floats = NDArray[np.float32]
Part = tuple[tuple[slice, slice], Floats, Floats, Floats, bool]
"""Rows and columns in the picture, there depth (r, c), colour (r, c, 3), opacity (r, c), and whether it is inner."""

_VEIL = 0.6
"""What is left of the opacity of a transparent surface over an inner body, so that the latter can be read."""


def blend(picture: Floats, parts: list[Part]) -> None:
    """Paint parts into a picture (h, w, 3), of each pixel the farthest first (depth inf: nothing there)."""
    places = np.array([[w[0].start, w[0].stop, w[1].start, w[1].stop] for w, *_ in parts], dtype=np.int64)
    sizes = (places[:, 1] - places[:, 0]) * (places[:, 3] - places[:, 2])
    offsets = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    depth = np.concatenate([part[1].ravel() for part in parts])
    colour = np.concatenate([part[2].reshape(-1, 3) for part in parts])
    opacity = np.concatenate([part[3].ravel() for part in parts])
    inner = np.array([part[4] for part in parts])
    _blend(picture, places, offsets, depth, colour, opacity, inner)


@compiled
def _blend(
    picture: Floats,
    places: NDArray[np.int64],
    offsets: NDArray[np.int64],
    depth: Floats,
    colour: Floats,
    opacity: Floats,
    inner: NDArray[np.bool_],
) -> None:
    count = len(places)
    met, owner = np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            number = 0
            for part in range(count):
                top, bottom, left, right = places[part]
                if row < top or row >= bottom or column < left or column >= right:
                    continue
                ray = offsets[part] + (row - top) * (right - left) + column - left
                if depth[ray] == np.inf:
                    continue
                slot = number
                while slot > 0 and depth[met[slot - 1]] < depth[ray]:
                    met[slot], owner[slot] = met[slot - 1], owner[slot - 1]
                    slot -= 1
                met[slot], owner[slot] = ray, part
                number += 1
            veil = 1.0
            for slot in range(number):
                share = opacity[met[slot]]
                if inner[owner[slot]]:
                    veil = _VEIL
                elif share < 1.0:
                    share *= veil
                for channel in range(3):
                    below = picture[row, column, channel]
                    picture[row, column, channel] = below + share * (colour[met[slot], channel] - below)
