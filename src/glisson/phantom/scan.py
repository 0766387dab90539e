"""The CT of a digital liver and its label maps, from the rest shape and the loading that leads to A."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from glisson.core.image import Grid, LabelMap, Volume
from glisson.phantom.body import AIR_HU, body_solids
from glisson.phantom.canvas import Box, Canvas, sub_grid, voxel_places
from glisson.phantom.couinaud import SEGMENT_NAMES
from glisson.phantom.interior import DUCT_RADIUS_MM, WIRE_RADIUS_MM, Interior
from glisson.phantom.liver_shape import LiverShape
from glisson.phantom.loading import Loading
from glisson.phantom.noise import ct_noise
from glisson.phantom.proportions import Proportions

LIVER_HU, TUMOUR_HU, PORTAL_HU, HEPATIC_HU, CAVA_HU = 110.0, 70.0, 172.0, 165.0, 145.0
DUCT_HU, GALLBLADDER_HU, WIRE_HU = 10.0, 10.0, 2600.0
NOISE_HU = 11.0

_NAMES = {1: "portal", 2: "hepatic", 3: "duct", 4: "wire", 5: "gallbladder", 6: "ivc"}


@dataclass(frozen=True, eq=False)
class Scan:
    """A CT with the label groups of a case and Couinaud's segments, all on one grid."""

    volume: Volume
    organ: LabelMap
    tumours: LabelMap
    structures: LabelMap
    couinaud: LabelMap


@dataclass(frozen=True, eq=False)
class Anatomy:
    """All that is painted: proportions, shape and interior of the rest shape, and the loading, if any."""

    proportions: Proportions
    shape: LiverShape
    interior: Interior
    loading: Loading | None = None


def make_scan(anatomy: Anatomy, grid: Grid, seed: int) -> Scan:
    """Render the CT (int16 HU, portal-venous phase) and the truth's labels on `grid`."""
    hu = np.full(grid.shape, AIR_HU, dtype=np.float32)
    places = voxel_places(grid)
    body = Canvas(grid, hu, places, 0.0)
    for solid, value in body_solids(anatomy.proportions, anatomy.shape):
        body.paint(solid, value)
    structures = np.zeros(grid.shape, dtype=np.uint8)
    structures[body.paint(anatomy.shape.cava, CAVA_HU)] = 6
    structures[body.paint(anatomy.shape.portal_trunk, PORTAL_HU)] = 1
    canvas, box = _organ_canvas(anatomy, body)
    gallbladder = canvas.paint(anatomy.shape.gallbladder, GALLBLADDER_HU)
    structures[box][gallbladder] = 5
    liver = canvas.paint(anatomy.shape.liver, LIVER_HU)
    structures[box][liver] = 0
    _paint_texture(canvas, liver, seed)
    tumours = _paint_interior(anatomy.interior, canvas, structures[box])
    segments = np.zeros(grid.shape, dtype=np.uint8)
    segments[box][liver] = anatomy.interior.planes.segments(canvas.places[liver])
    hu += ct_noise(grid, NOISE_HU, seed)
    names = {n: tumour.name for n, tumour in enumerate(anatomy.interior.tumours, start=1)}
    return Scan(
        volume=Volume(np.clip(np.rint(hu), -1024, 3071).astype(np.int16), grid),
        organ=LabelMap(_whole(grid, box, liver), grid, {1: "liver"}),
        tumours=LabelMap(_whole(grid, box, tumours), grid, names),
        structures=LabelMap(structures, grid, _NAMES),
        couinaud=LabelMap(segments, grid, SEGMENT_NAMES),
    )


def _organ_canvas(anatomy: Anatomy, body: Canvas) -> tuple[Canvas, Box]:
    """The part of the picture around the organ, with rest coordinates, and where it lies."""
    reach = 0.0 if anatomy.loading is None else anatomy.loading.largest_mm
    solids = (anatomy.shape.liver, anatomy.shape.gallbladder)
    low = np.min([solid.bounds[0] for solid in solids], axis=0) - reach
    high = np.max([solid.bounds[1] for solid in solids], axis=0) + reach
    box = body.box(np.array([low, high]))
    places = body.places[box]
    if anatomy.loading is not None:
        places = anatomy.loading.rest_places(places)
    return Canvas(sub_grid(body.grid, box), body.hu[box], places, reach), box


def _paint_texture(canvas: Canvas, liver: NDArray[np.bool_], seed: int) -> None:
    """Uneven enhancement of the parenchyma: a few HU, over some 15 mm."""
    random = np.random.default_rng([seed, 3])
    texture = gaussian_filter(random.standard_normal(liver.shape, dtype=np.float32), 6.0 / canvas.grid.spacing_mm)
    canvas.hu[liver] += 2.5 * texture[liver] / float(texture.std())


def _paint_interior(interior: Interior, canvas: Canvas, structures: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Vessels, tumours, duct and wire; fills in `structures` and returns the tumours' labels."""
    structures[canvas.paint_tree(interior.hepatic, HEPATIC_HU)] = 2
    structures[canvas.paint_tree(interior.portal, PORTAL_HU)] = 1
    tumours = np.zeros(structures.shape, dtype=np.uint8)
    for number, tumour in enumerate(interior.tumours, start=1):
        tumours[canvas.paint(tumour.solid, TUMOUR_HU)] = number
    duct = interior.duct.points_mm
    structures[canvas.paint_tube(duct, DUCT_RADIUS_MM, DUCT_HU)] = 3
    wire = duct[interior.duct.arc_lengths_mm <= interior.wire_length_mm]
    structures[canvas.paint_tube(wire, WIRE_RADIUS_MM, WIRE_HU)] = 4
    return tumours


def _whole(grid: Grid, box: Box, part: NDArray[np.bool_] | NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Labels of a block, on the whole grid."""
    labels = np.zeros(grid.shape, dtype=np.uint8)
    labels[box] = part
    return labels
