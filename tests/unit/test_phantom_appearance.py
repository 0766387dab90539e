"""Drawn appearances: what was asked for is in the picture, and artefacts have the strength and the laws they should."""

import numpy as np
import pytest
from scipy.ndimage import binary_erosion, distance_transform_edt

from glisson.core import Grid
from glisson.phantom.appearance import PORTAL_PHASE, Appearance, draw_ct, draw_mr
from glisson.phantom.disturbances import rician, sensitivity, streaks
from glisson.phantom.family import make_phantom

COARSE = (3.0, 3.0, 4.0)


def test_draws_are_seeded_and_differ():
    for draw in (draw_ct, draw_mr):
        assert draw(3) == draw(3)
        assert len({draw(seed).noise for seed in range(20)}) == 20
    assert {draw_ct(seed).name for seed in range(20)} == {"portal", "late", "fatty"}
    clips = [draw_ct(seed).clips for seed in range(20)]
    assert 0 < sum(count > 0 for count in clips) < 20


def test_the_liver_is_as_bright_as_drawn():
    for appearance in (draw_ct(1), draw_mr(1)):
        phantom = make_phantom(5, COARSE, appearance=appearance)
        assert phantom.volume.modality == appearance.modality
        spared = phantom.structures.voxels == 0
        inner = binary_erosion(phantom.organ.mask("liver") & spared & (phantom.tumours.voxels == 0), iterations=2)
        mean = float(np.median(phantom.volume.voxels[inner]))
        # Sensitivity is one on average over the body, not over the liver.
        assert mean == pytest.approx(appearance.values["liver"], rel=0.06 if appearance.modality == "CT" else 0.35)


def test_metal_is_there_and_spoils_its_slices_only():
    disturbed = Appearance("a", "CT", PORTAL_PHASE.values, noise=5.0, clips=2, metal_streaks=30.0)
    plain = Appearance("a", "CT", PORTAL_PHASE.values, noise=5.0, clips=2)
    spoilt, clean = (make_phantom(4, COARSE, appearance=one).volume.voxels.astype(float) for one in (disturbed, plain))
    without = make_phantom(4, COARSE, appearance=Appearance("a", "CT", PORTAL_PHASE.values, noise=5.0))
    clips = clean - without.volume.voxels
    assert clips.max() > 300.0
    assert not clips[without.organ.voxels == 0].any()
    apart = np.abs(spoilt - clean).max(axis=(0, 1))
    assert (apart == 0.0).any()
    assert apart.max() > 30.0


@pytest.mark.parametrize("kind", ["metal", "gas"])
def test_streaks_are_as_strong_as_asked(kind):
    grid = Grid((60, 50, 6), [2.0, 2.0, 3.0], [0.0, 0.0, 0.0])
    source = np.zeros(grid.shape, bool)
    source[20:24, 20:23, 2:4] = True
    none = np.zeros_like(source)
    metal, gas = (source, none) if kind == "metal" else (none, source)
    made = streaks(metal, gas, grid, 25.0, 12.0, seed=1)
    near = (distance_transform_edt(~source, sampling=grid.spacing_mm) < 30.0) & ~source
    assert made[near].std() == pytest.approx(25.0 if kind == "metal" else 12.0, rel=0.01)
    assert not made[:, :, [0, 1, 4, 5]].any()


def test_beam_hardening_joins_two_pieces_of_metal_by_a_dark_band():
    """The textbook's sign of it: between two dense bodies the picture is too dark, beside them it is not."""
    grid = Grid((80, 80, 1), [1.0, 1.0, 1.0], [0.0, 0.0, 0.0])
    metal = np.zeros(grid.shape, bool)
    metal[20:26, 38:44] = metal[54:60, 38:44] = True
    made = streaks(metal, np.zeros_like(metal), grid, 30.0, 0.0, seed=1)[:, :, 0]
    assert made[32:48, 39:43].mean() < -20.0
    assert made[32:48, 39:43].mean() < made[32:48, 10:20].mean() - 20.0


def test_sensitivity_is_smooth_and_as_uneven_as_asked():
    grid = Grid((60, 50, 40), [4.0, 4.0, 5.0], [0.0, 0.0, 0.0])
    even = np.log(sensitivity(grid, 0.2, seed=3))
    assert even.std() == pytest.approx(0.2, rel=1e-3)
    assert np.abs(np.diff(even, axis=0)).max() < 0.05


def test_noise_of_a_magnitude_is_that_of_rice():
    """Background: mean σ √(π/2) (Rayleigh); far above the noise: deviation σ."""
    dark = rician(np.zeros((50, 50, 50), np.float32), 10.0, seed=1)
    assert dark.mean() == pytest.approx(10.0 * np.sqrt(np.pi / 2.0), rel=0.01)
    bright = rician(np.full((50, 50, 50), 500.0, np.float32), 10.0, seed=1)
    assert bright.std() == pytest.approx(10.0, rel=0.02)
    assert bright.mean() == pytest.approx(500.0 + 10.0**2 / (2 * 500.0), abs=0.1)
