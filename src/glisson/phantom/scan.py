"""The CT of a digital liver and its label maps, from the rest shape and the loading that leads to A."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from glisson.core.image import Grid, LabelMap, Volume
from glisson.phantom.appearance import PORTAL_PHASE, Appearance
from glisson.phantom.body import body_solids
from glisson.phantom.canvas import Box, Canvas, sub_grid, voxel_places
from glisson.phantom.couinaud import SEGMENT_NAMES
from glisson.phantom.disturbances import rician, sensitivity, streaks
from glisson.phantom.implicit import ellipsoid
from glisson.phantom.interior import DUCT_RADIUS_MM, WIRE_RADIUS_MM, Interior
from glisson.phantom.liver_shape import LiverShape
from glisson.phantom.loading import Loading
from glisson.phantom.noise import ct_noise
from glisson.phantom.proportions import Proportions
from glisson.phantom.vessels import scattered_targets

_CLIP_RADII_MM = (3.0, 1.2, 1.2)

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


def make_scan(anatomy: Anatomy, grid: Grid, seed: int, appearance: Appearance = PORTAL_PHASE) -> Scan:
    """Render the scan (int16 HU or MR signal) and the truth's labels on `grid`."""
    values = appearance.values
    hu = np.full(grid.shape, values["air"], dtype=np.float32)
    gas = np.zeros(grid.shape, dtype=bool)
    places = voxel_places(grid)
    body = Canvas(grid, hu, places, 0.0)
    for solid, tissue in body_solids(anatomy.proportions, anatomy.shape):
        inside = body.paint(solid, values[tissue])
        if tissue in ("gas", "stomach gas"):
            gas |= inside
    structures = np.zeros(grid.shape, dtype=np.uint8)
    structures[body.paint(anatomy.shape.cava, values["cava"])] = 6
    structures[body.paint(anatomy.shape.portal_trunk, values["portal"])] = 1
    canvas, box = _organ_canvas(anatomy, body)
    gallbladder = canvas.paint(anatomy.shape.gallbladder, values["gallbladder"])
    structures[box][gallbladder] = 5
    liver = canvas.paint(anatomy.shape.liver, values["liver"])
    structures[box][liver] = 0
    _paint_texture(canvas, liver, appearance.texture, seed)
    tumours = _paint_interior(anatomy.interior, canvas, structures[box], appearance)
    metal = np.zeros(grid.shape, dtype=bool)
    metal[box] = _paint_clips(canvas, anatomy.shape, appearance, seed) | (structures[box] == 4)
    segments = np.zeros(grid.shape, dtype=np.uint8)
    segments[box][liver] = anatomy.interior.planes.segments(canvas.places[liver])
    voxels = _disturbed(hu, metal, gas & (structures == 0) & (segments == 0), grid, appearance, seed)
    names = {n: tumour.name for n, tumour in enumerate(anatomy.interior.tumours, start=1)}
    return Scan(
        volume=Volume(voxels, grid, appearance.modality),
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


def _paint_texture(canvas: Canvas, liver: NDArray[np.bool_], deviation: float, seed: int) -> None:
    """Uneven enhancement of the parenchyma: a few HU, over some 15 mm."""
    random = np.random.default_rng([seed, 3])
    texture = gaussian_filter(random.standard_normal(liver.shape, dtype=np.float32), 6.0 / canvas.grid.spacing_mm)
    canvas.hu[liver] += deviation * texture[liver] / float(texture.std())


def _paint_interior(
    interior: Interior, canvas: Canvas, structures: NDArray[np.uint8], appearance: Appearance
) -> NDArray[np.uint8]:
    """Vessels, tumours, duct and wire; fills in `structures` and returns the tumours' labels."""
    values = appearance.values
    structures[canvas.paint_tree(interior.hepatic, values["hepatic"])] = 2
    structures[canvas.paint_tree(interior.portal, values["portal"])] = 1
    tumours = np.zeros(structures.shape, dtype=np.uint8)
    for number, tumour in enumerate(interior.tumours, start=1):
        tumours[canvas.paint(tumour.solid, values["tumour"])] = number
    duct = interior.duct.points_mm
    structures[canvas.paint_tube(duct, DUCT_RADIUS_MM, values["duct"])] = 3
    wire = duct[interior.duct.arc_lengths_mm <= interior.wire_length_mm]
    structures[canvas.paint_tube(wire, WIRE_RADIUS_MM, values["wire"])] = 4
    return tumours


def _paint_clips(canvas: Canvas, shape: LiverShape, appearance: Appearance, seed: int) -> NDArray[np.bool_]:
    """Metal clips at places inside the liver; their mask on the canvas."""
    mask = np.zeros(canvas.grid.shape, dtype=bool)
    if appearance.clips:
        random = np.random.default_rng([seed, 6])
        for place in scattered_targets(shape.liver, 5.0, 200, random)[: appearance.clips]:
            mask |= canvas.paint(ellipsoid(place, np.array(_CLIP_RADII_MM)), appearance.values["metal"])
    return mask


def _disturbed(
    clean: NDArray[np.float32],
    metal: NDArray[np.bool_],
    gas: NDArray[np.bool_],
    grid: Grid,
    appearance: Appearance,
    seed: int,
) -> NDArray[np.int16]:
    """The picture as the scanner stores it, with noise and artefacts."""
    if appearance.modality == "MR":
        seen, low, high = rician(clean * sensitivity(grid, appearance.bias, seed), appearance.noise, seed), 0, 32767
    else:
        seen, low, high = clean + ct_noise(grid, appearance.noise, seed), -1024, 3071
        seen += streaks(metal, gas, grid, appearance.metal_streaks, appearance.gas_streaks, seed)
    stored: NDArray[np.int16] = np.clip(np.rint(seen), low, high).astype(np.int16)
    return stored


def _whole(grid: Grid, box: Box, part: NDArray[np.bool_] | NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Labels of a block, on the whole grid."""
    labels = np.zeros(grid.shape, dtype=np.uint8)
    labels[box] = part
    return labels
