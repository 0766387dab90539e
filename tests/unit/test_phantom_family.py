"""The family against what was built into it: HU, volumes, partition, containment, seeds."""

import numpy as np
import pytest
from scipy.ndimage import binary_dilation, binary_erosion, gaussian_filter, label
from skimage.measure import marching_cubes

from glisson.core import BadInput, Grid
from glisson.core.mesh import TriangleSurface
from glisson.geometry.distance import inside
from glisson.phantom.appearance import PORTAL_PHASE
from glisson.phantom.family import build_anatomy, make_phantom

SPACING = (2.0, 2.0, 2.5)
LIVER_HU, PORTAL_HU, TUMOUR_HU, DUCT_HU, GALLBLADDER_HU = (
    PORTAL_PHASE.values[name] for name in ("liver", "portal", "tumour", "duct", "gallbladder")
)
NOISE_HU = PORTAL_PHASE.noise


@pytest.fixture(scope="module")
def phantom():
    return make_phantom(1, SPACING)


@pytest.fixture(scope="module")
def liver_surface():
    solid = build_anatomy(1).shape.liver
    low, step = solid.bounds[0] - 6.0, 2.0
    count = np.ceil((solid.bounds[1] + 6.0 - low) / step).astype(int)
    axes = [low[a] + step * np.arange(count[a]) for a in range(3)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    vertices, triangles, _, _ = marching_cubes(solid.distance(grid), 0.0, spacing=(step,) * 3)
    surface = TriangleSurface(vertices + low, triangles)
    return surface if surface.volume_mm3 > 0 else TriangleSurface(surface.vertices, triangles[:, ::-1])


def _mean_hu(phantom, mask, margin):
    inner = binary_erosion(mask, iterations=margin)
    values = phantom.volume.voxels[inner]
    return float(values.mean()), float(values.std()), values.size


def test_volume_is_a_ct_in_lps(phantom):
    assert phantom.volume.voxels.dtype == np.int16
    assert phantom.volume.modality == "CT"
    assert phantom.volume.voxels.min() >= -1024
    assert all(
        labels.grid.matches(phantom.volume.grid)
        for labels in (phantom.organ, phantom.tumours, phantom.structures, phantom.couinaud)
    )


def test_hu_inside_eroded_structures(phantom):
    vessels = phantom.structures.mask("portal", "hepatic", "duct", "wire")
    parenchyma = phantom.organ.mask("liver") & ~vessels & (phantom.tumours.voxels == 0)
    for mask, hu, margin in (
        (parenchyma, LIVER_HU, 2),
        (phantom.tumours.mask("tumour1"), TUMOUR_HU, 1),
        (phantom.structures.mask("gallbladder"), GALLBLADDER_HU, 2),
    ):
        mean, spread, count = _mean_hu(phantom, mask, margin)
        # 4 standard errors, with the noise taken as correlated over some ten voxels.
        assert mean == pytest.approx(hu, abs=1.0 + 4 * NOISE_HU * np.sqrt(10 / count))
        assert spread == pytest.approx(NOISE_HU, rel=0.25)
    trunk = binary_erosion(phantom.structures.mask("portal"), iterations=2)
    assert phantom.volume.voxels[trunk].mean() == pytest.approx(PORTAL_HU, abs=6.0)
    # Half a millimetre of steel in a voxel of 2 mm is still told from the parenchyma.
    assert phantom.volume.voxels[phantom.structures.mask("wire")].min() > LIVER_HU + 5 * NOISE_HU
    # Beyond the wire the duct is dark; it is as thin as two voxels.
    duct = phantom.structures.mask("duct") & ~binary_dilation(phantom.structures.mask("wire"), iterations=3)
    assert DUCT_HU < phantom.volume.voxels[duct].mean() < 0.75 * LIVER_HU


def test_a_threshold_leaks(phantom):
    """Muscle, stomach wall, heart and spleen look like liver and touch it: connected voxels of its HU are not it."""
    liver = phantom.organ.mask("liver")
    smooth = gaussian_filter(phantom.volume.voxels.astype(np.float32), 1.0)
    parts, _ = label((smooth > LIVER_HU - 45) & (smooth < LIVER_HU + 45))
    inside_liver = np.bincount(parts[liver])[1:].argmax() + 1
    leaked = (parts == inside_liver) & ~binary_dilation(liver)
    assert leaked.sum() > 0.1 * liver.sum()


def test_organ_mask_has_the_surface_volume(phantom, liver_surface):
    assert liver_surface.is_closed
    assert phantom.organ.volume_ml("liver") == pytest.approx(liver_surface.volume_mm3 * 1e-3, rel=0.01)
    assert 1200.0 < phantom.organ.volume_ml("liver") < 1800.0


def test_organ_has_the_stated_extent(liver_surface):
    width, thickness, height = np.ptp(liver_surface.vertices, axis=0)
    assert 200.0 < width < 245.0
    assert 55.0 < thickness < 85.0
    assert 135.0 < height < 165.0


def test_tumour_mask_has_the_exact_volume(phantom):
    tumour = phantom.exact.tumours[0]
    assert phantom.tumours.volume_ml("tumour1") == pytest.approx(tumour.volume_mm3 * 1e-3, rel=0.03)
    voxels = np.argwhere(phantom.tumours.mask("tumour1"))
    centroid = phantom.tumours.grid.points_from_indices(voxels).mean(axis=0)
    assert np.linalg.norm(centroid - tumour.centroid_mm) < 0.3


def test_vessel_mask_has_the_exact_volume():
    """A straight tube of known size, painted alone: its covered volume against the closed form."""
    from glisson.phantom.canvas import Canvas, voxel_places

    grid = Grid((40, 40, 40), np.full(3, 1.0), np.zeros(3))
    canvas = Canvas(grid, np.zeros(grid.shape, dtype=np.float32), voxel_places(grid), 0.0)
    points = np.array([[20.2, 19.7, 8.0], [20.2, 19.7, 32.0]])
    canvas.paint_tube(points, 5.0, 1.0)
    assert canvas.hu.sum() == pytest.approx(np.pi * 25 * 24 + 4 / 3 * np.pi * 125, rel=0.01)


def test_couinaud_segments_partition_the_organ(phantom):
    np.testing.assert_array_equal(phantom.couinaud.voxels > 0, phantom.organ.voxels > 0)
    volumes = [phantom.couinaud.volume_ml(f"segment {n}") for n in range(1, 9)]
    assert min(volumes) > 10.0
    # The portal and hepatic trees supply what the planes say: segments 2 and 3 lie left of 4, 7 and 8 above 5 and 6.
    centres = {n: _centre(phantom, n) for n in range(1, 9)}
    assert min(centres[2][0], centres[3][0]) > centres[4][0] > centres[5][0]
    assert centres[2][2] > centres[3][2]
    assert centres[7][2] > centres[6][2]
    assert centres[8][2] > centres[5][2]


def _centre(phantom, number):
    voxels = np.argwhere(phantom.couinaud.voxels == number)
    return phantom.couinaud.grid.points_from_indices(voxels).mean(axis=0)


@pytest.mark.parametrize("seed", range(4))
def test_interior_lies_inside(seed):
    anatomy = build_anatomy(seed)
    liver, interior = anatomy.shape.liver, anatomy.interior
    for tree in (interior.portal, interior.hepatic):
        assert liver.distance(tree.points_mm).max() < -1.0
        assert len(tree.edges) == len(tree.points_mm) - 1
    assert liver.distance(interior.duct.points_mm).max() < -1.0
    for tumour in interior.tumours:
        assert liver.distance(tumour.surface.vertices).max() < -2.0
        gap = tumour.solid.distance(interior.duct.points_mm).min()
        assert gap > 1.5 or tumour.name != "tumour1"
    assert interior.tumours[0].centre_mm[0] > 30.0
    assert interior.tumours[0].radii_mm.min() >= 8.0
    assert interior.tumours[0].radii_mm.max() <= 14.0
    assert 0.0 < interior.wire_length_mm < interior.duct.length_mm


def test_interior_lies_inside_the_surface(phantom, liver_surface):
    """The same by another way: winding of the triangulated surface."""
    exact = phantom.exact
    points = np.vstack([exact.duct.points_mm, *(tree.points_mm for tree in exact.trees)])
    assert inside(points, liver_surface).all()


def test_murray(phantom):
    for tree in phantom.exact.trees:
        children = {}
        for parent, child in tree.edges:
            children.setdefault(int(parent), []).append(int(child))
        for parent, own in children.items():
            assert tree.radii_mm[parent] ** 3 == pytest.approx((tree.radii_mm[own] ** 3).sum(), rel=1e-9)


def test_resection_rule_has_room(phantom):
    """Going along the wire towards the hilum there is a place 5 mm outside the tumour, still in the duct."""
    duct = phantom.exact.duct
    distance = phantom.exact.tumours[0]
    along = duct.points_mm
    far = np.linalg.norm(along[:, None] - distance.surface.vertices[None, ::10], axis=2).min(axis=1)
    nearest = int(far.argmin())
    assert (far[:nearest] > 5.0).any()
    assert duct.arc_lengths_mm[nearest] < phantom.exact.wire_length_mm


def test_same_seed_same_bytes():
    first, second = (make_phantom(4, (6.0, 6.0, 6.0)) for _ in range(2))
    assert first.volume.voxels.tobytes() == second.volume.voxels.tobytes()
    assert first.structures.voxels.tobytes() == second.structures.voxels.tobytes()
    np.testing.assert_array_equal(first.exact.duct.points_mm, second.exact.duct.points_mm)


def test_seeds_differ():
    first, second = (make_phantom(seed, (6.0, 6.0, 6.0)) for seed in (0, 2))
    assert (first.organ.voxels != second.organ.voxels).sum() > 0.03 * first.organ.voxels.sum()
    assert not np.array_equal(first.volume.voxels, second.volume.voxels)


def test_oblique_grid_shows_the_same_organ(phantom):
    angle = 0.3
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    turn = turn @ np.diag([-1.0, -1.0, 1.0])  # right-handed, as a RAS scan has it
    shape, spacing = (120, 70, 60), np.array([2.5, 2.5, 3.0])
    centre = np.array([-22.0, -38.0, 0.0])
    grid = Grid(shape, spacing, centre - turn @ (spacing * (np.array(shape) - 1) / 2.0), turn)
    oblique = make_phantom(1, grid=grid)
    assert oblique.organ.volume_ml("liver") == pytest.approx(phantom.organ.volume_ml("liver"), rel=0.005)
    centres = [p.organ.grid.points_from_indices(np.argwhere(p.organ.voxels)).mean(axis=0) for p in (oblique, phantom)]
    np.testing.assert_allclose(centres[0], centres[1], atol=0.2)


def test_noise_is_correlated_like_ct():
    from glisson.phantom.noise import ct_noise

    grid = Grid((96, 96, 20), np.array([0.8, 0.8, 2.0]), np.zeros(3))
    noise = ct_noise(grid, 10.0, 0)
    assert noise.std() == pytest.approx(10.0, rel=1e-3)
    near = np.mean(noise[1:] * noise[:-1]) / 100.0
    between_slices = np.mean(noise[:, :, 2:] * noise[:, :, :-2]) / 100.0
    assert near > 0.3
    assert abs(between_slices) < 0.1
    # Averages over large regions have far less noise than independent voxels would leave.
    blocks = noise.reshape(6, 16, 6, 16, 20).mean(axis=(1, 3))
    assert blocks.std() < 10.0 * 0.5 / 4.0


@pytest.mark.parametrize("spacing", [(0.0, 1.0, 1.0), (1.0, 1.0), (1.0, 1.0, float("nan")), (20.0, 1.0, 1.0)])
def test_bad_spacing_is_refused(spacing):
    with pytest.raises(BadInput, match="spacing"):
        make_phantom(0, spacing)


def test_negative_seed_is_refused():
    with pytest.raises(BadInput, match="seed"):
        make_phantom(-1)
