import numpy as np
import pytest
import trimesh

from glisson.core import Grid, LabelMap
from glisson.preoperative.imaging.borders import touched_borders
from glisson.preoperative.meshing.surface import MarchingCubes, MarchingCubesParameters
from preoperative_shapes import ellipsoid, labels_of, mask_of

ROTATED = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
RADII = (34.0, 22.0, 27.0)
GRIDS = {
    "isotropic": Grid((80, 56, 66), [1.0, 1.0, 1.0], [-40.0, -28.0, -33.0]),
    "slices": Grid((108, 76, 40), [0.743, 0.743, 1.6], [-40.0, -28.0, -32.0]),
    "left-handed": Grid((80, 56, 66), [1.0, 1.0, 1.0], [40.0, -28.0, -33.0], np.diag([-1.0, 1.0, 1.0])),
    "rotated": Grid((90, 90, 66), [1.0, 1.0, 1.0], ROTATED @ [-45.0, -45.0, -33.0], ROTATED),
}


def extract(labels: LabelMap, **parameters: float):
    return MarchingCubes(MarchingCubesParameters(**parameters)).extract(labels.mask("liver"), labels)


@pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
def test_ellipsoid_is_closed_outward_and_keeps_the_masks_volume(grid):
    labels = labels_of("liver", ellipsoid((0.0, 0.0, 0.0), RADII), grid)
    surface = extract(labels)
    assert surface.is_closed
    assert trimesh.Trimesh(surface.vertices, surface.triangles, process=False).is_watertight
    assert surface.volume_mm3 == pytest.approx(1e3 * labels.volume_ml("liver"), rel=1e-6)
    assert surface.volume_mm3 == pytest.approx(4.0 / 3.0 * np.pi * np.prod(RADII), rel=0.005)


@pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
def test_surface_lies_within_half_a_voxel_of_the_true_one(grid):
    surface = extract(labels_of("liver", ellipsoid((0.0, 0.0, 0.0), RADII), grid))
    level = np.sqrt((((surface.vertices) / RADII) ** 2).sum(axis=1))
    # First-order distance to the ellipsoid: (level − 1) over the size of the level's gradient.
    slope = np.linalg.norm(surface.vertices / np.square(RADII), axis=1) / level
    distance = np.abs(level - 1.0) / slope
    assert np.percentile(distance, 95) < 0.5 * grid.spacing_mm.max()


def test_triangles_have_the_edge_asked_for():
    surface = extract(labels_of("liver", ellipsoid((0.0, 0.0, 0.0), RADII), GRIDS["isotropic"]), edge_length_mm=4.0)
    corners = surface.vertices[surface.triangles]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    assert np.median(edges) == pytest.approx(4.0, rel=0.2)


def test_a_mask_at_the_scans_border_is_closed_and_said():
    grid = Grid((40, 40, 20), [2.0, 2.0, 2.0], [-40.0, -40.0, 0.0])
    labels = labels_of("liver", ellipsoid((0.0, 0.0, 0.0), (30.0, 30.0, 30.0)), grid)
    surface = extract(labels)
    assert surface.is_closed
    assert surface.volume_mm3 == pytest.approx(1e3 * labels.volume_ml("liver"), rel=1e-6)
    (border,) = touched_borders(labels.mask("liver"))
    assert border.slice_near(grid) == 0
    assert "first layer along axis k" in border.sentence


def test_a_single_voxel_has_a_closed_surface():
    labels = labels_of("liver", lambda p: np.linalg.norm(p, axis=1) < 0.5, Grid((9, 9, 9), [1, 1, 1], [-4, -4, -4]))
    surface = extract(labels, edge_length_mm=1.0)
    assert surface.is_closed
    assert surface.volume_mm3 == pytest.approx(1.0, rel=1e-3)


def test_two_bodies_keep_their_volumes():
    """Two separate spheres in one mask (a tumour in two pieces): one closed surface with both volumes."""
    grid = Grid((90, 44, 44), [1.0, 1.0, 1.0], [-45.0, -22.0, -22.0])

    def inside(points):
        return ellipsoid((-24, 0, 0), (16, 16, 16))(points) | ellipsoid((25, 0, 0), (10, 10, 10))(points)

    labels = LabelMap(mask_of(inside, grid).astype(np.uint8), grid, {1: "liver"})
    surface = extract(labels)
    assert surface.is_closed
    assert surface.volume_mm3 == pytest.approx(4.0 / 3.0 * np.pi * (16**3 + 10**3), rel=0.01)
