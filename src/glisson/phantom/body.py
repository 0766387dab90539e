"""The body around the liver: wall, ribs, spine, lungs, heart, spleen, stomach, kidneys, bowel, great vessels.

Only what a segmenter meets: neighbours that touch the liver, some with nearly its HU. Organ coordinates
(patient LPS, mm, board at y = 0). Everything lies under the liver in painting order.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glisson.phantom.implicit import Points, Solid, cone, difference, ellipsoid, grown, half_space, intersection, union
from glisson.phantom.liver_shape import LiverShape
from glisson.phantom.proportions import Proportions

BODY_BOX = np.array([[-172.0, -112.0, -98.0], [172.0, 104.0, 108.0]])
"""Lowest and highest corner (2, 3) of what the CT shows, mm."""


def body_solids(proportions: Proportions, shape: LiverShape) -> list[tuple[Solid, str]]:
    """Solids with the names of their tissues in painting order."""
    return _wall_solids(shape) + _neighbours(proportions) + _dorsal_organs()


def _wall_solids(shape: LiverShape) -> list[tuple[Solid, str]]:
    """Skin and fat, muscle, the fat inside, ribs, lungs above a diaphragm that lies on the liver."""
    skin = _column(166.0, 106.0)
    muscle = _column(154.0, 95.0)
    inside = _column(146.0, 86.0)
    dome = union(
        [
            ellipsoid([-57.0, -15.0, -6.0], [84.0, 74.0, 76.0]),
            ellipsoid([48.0, -8.0, -4.0], [74.0, 70.0, 66.0]),
        ],
        blend=20.0,
    )
    # The diaphragm lies on the liver of every member, so the dome includes the liver itself.
    dome = union([dome, grown(shape.liver, 3.0)], blend=8.0)
    lungs = intersection(difference(_column(145.0, 85.0), dome), half_space(2, 5.0, keep_below=False))
    diaphragm = intersection(grown(lungs, 3.0), inside)
    return [
        (skin, "skin fat"),
        (muscle, "muscle"),
        (inside, "fat"),
        (diaphragm, "diaphragm"),
        (lungs, "lung"),
        *_ribs(),
    ]


def _neighbours(proportions: Proportions) -> list[tuple[Solid, str]]:
    """Heart, stomach, colon and duodenum: they touch the liver, and heart and stomach wall look like it."""
    place = proportions.place
    heart = ellipsoid(place([30.0, -32.0, 86.0]), [48.0, 38.0, 34.0])
    stomach = ellipsoid(place([82.0, -22.0, -8.0]), [42.0, 36.0, 50.0])
    colon = union(
        [
            cone(place([-100.0, -38.0, -86.0]), place([-20.0, -52.0, -88.0]), 17.0, 16.0),
            cone(place([-20.0, -52.0, -88.0]), place([70.0, -50.0, -84.0]), 16.0, 15.0),
        ]
    )
    gas = ellipsoid(place([-20.0, -60.0, -88.0]), [34.0, 7.0, 10.0])
    duodenum = cone(place([2.0, 2.0, -34.0]), place([-42.0, 13.0, -90.0]), 12.0, 13.0)
    return [
        (heart, "heart"),
        (stomach, "stomach wall"),
        (grown(stomach, -4.0), "stomach"),
        (ellipsoid(place([84.0, -46.0, -4.0]), [22.0, 7.0, 24.0]), "stomach gas"),
        (colon, "colon"),
        (gas, "gas"),
        (duodenum, "duodenum"),
    ]


def _dorsal_organs() -> list[tuple[Solid, str]]:
    """Spleen, kidneys, aorta, spine and the muscles beside it, all behind the board's plane or lateral."""
    spleen = ellipsoid([110.0, 34.0, 34.0], [26.0, 38.0, 46.0])
    right_kidney = ellipsoid([-62.0, 36.0, -58.0], [28.0, 25.0, 50.0])
    left_kidney = ellipsoid([66.0, 40.0, -40.0], [27.0, 25.0, 50.0])
    back_muscle = union([cone([x, 72.0, -130.0], [x, 72.0, 140.0], 22.0, 22.0) for x in (-38.0, 38.0)])
    psoas = union([cone([x, 46.0, -130.0], [0.6 * x, 52.0, -30.0], 18.0, 8.0) for x in (-34.0, 34.0)])
    vertebrae = [ellipsoid([0.0, 48.0, z], [23.0, 20.0, 15.5]) for z in np.arange(-120.0, 140.0, 30.0)]
    discs = cone([0.0, 48.0, -130.0], [0.0, 48.0, 140.0], 18.0, 18.0)
    arches = union([cone([0.0, 72.0, z], [0.0, 92.0, z - 10.0], 7.0, 5.0) for z in np.arange(-120.0, 140.0, 30.0)])
    bone = union(vertebrae)
    canal = cone([0.0, 70.0, -130.0], [0.0, 70.0, 140.0], 8.0, 8.0)
    aorta = cone([16.0, 20.0, -130.0], [14.0, 22.0, 140.0], 11.0, 12.0)
    crura = union([cone([x, 22.0, -60.0], [0.5 * x, 14.0, 70.0], 7.0, 7.0) for x in (-18.0, 24.0)])
    return [
        (back_muscle, "back muscle"),
        (psoas, "psoas"),
        (crura, "crura"),
        (discs, "disc"),
        (bone, "bone"),
        (grown(bone, -2.5), "marrow"),
        (arches, "arch"),
        (canal, "canal"),
        (aorta, "aorta"),
        (spleen, "spleen"),
        (right_kidney, "kidney"),
        (ellipsoid([-58.0, 36.0, -58.0], [11.0, 10.0, 26.0]), "renal pelvis"),
        (left_kidney, "kidney"),
        (ellipsoid([62.0, 40.0, -40.0], [11.0, 10.0, 26.0]), "renal pelvis"),
    ]


def _ribs() -> list[tuple[Solid, str]]:
    """Ribs in the muscle of the wall, dense outside and spongy inside.

    They are elliptic rings every 26 mm that sink towards the front by 35 degrees, 5 mm thick, 12 mm tall.
    """
    half_width, half_depth, apart = 150.0, 90.0, 26.0
    sink = float(np.tan(np.deg2rad(35.0)))

    def distance(points: Points) -> NDArray[Any]:
        around = _oval(points, half_width, half_depth) / 2.5
        level = points[..., 2] - sink * (points[..., 1] - 40.0)
        # The slope of `level` is 1/cos 35°; the rings repeat along it.
        height = ((level + apart / 2.0) % apart - apart / 2.0) * (0.82 / 6.0)
        value: NDArray[Any] = 2.5 * (np.sqrt(around * around + height * height) - 1.0)
        return value

    low = [-half_width - 4.0, -half_depth - 4.0, -1e3]
    ribs = Solid(distance, np.array([low, [half_width + 4.0, 84.0, 1e3]]))
    ribs = intersection(ribs, half_space(1, 84.0, keep_below=True))
    return [(ribs, "rib"), (grown(ribs, -1.6), "rib marrow")]


def _column(half_width: float, half_depth: float) -> Solid:
    """An upright elliptic cylinder about the body's axis."""
    bounds = np.array([[-half_width, -half_depth, -1e3], [half_width, half_depth, 1e3]])
    return Solid(lambda points: _oval(points, half_width, half_depth), bounds)


def _oval(points: Points, half_width: float, half_depth: float) -> NDArray[Any]:
    """Signed distance (close to the surface) from an upright elliptic cylinder."""
    x, y = points[..., 0] / half_width, points[..., 1] / half_depth
    first = np.sqrt(x * x + y * y)
    x /= half_width
    y /= half_depth
    value: NDArray[Any] = first * (first - 1.0) / np.maximum(np.sqrt(x * x + y * y), 1e-6)
    return value
