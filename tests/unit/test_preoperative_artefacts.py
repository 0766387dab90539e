"""Streaks of metal against rays in closed form, streaks of gas against the phantom without them; and the command."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from glisson.cli.main import main
from glisson.core.errors import BadInput
from glisson.core.image import Grid, Volume
from glisson.framework.case import ARTEFACTS, ARTEFACTS_PICTURE, LOST, SCAN
from glisson.framework.case_warnings import case_warnings
from glisson.framework.cleaning import clean_case
from glisson.framework.settings import Settings
from glisson.io.images import read_labels, read_volume, write_volume
from glisson.phantom.appearance import draw_ct
from glisson.phantom.family import assemble, build_anatomy, scan_grid
from glisson.preoperative.artefacts.cleaning import cleaned_scan
from glisson.preoperative.artefacts.metal import metal_voxels, without_metal_streaks
from glisson.preoperative.artefacts.streaks import find_streaks, gas_voxels, without_streaks
from ray_traced_ct import PIXEL_MM, abdomen_with_metal
from small_case import make_small_case

_SPACING = np.array([PIXEL_MM, PIXEL_MM, 3.0])


def test_metal_streaks_are_halved() -> None:
    near, far = [], []
    for seed in range(40, 48):
        clean, streaked = abdomen_with_metal(seed, False), abdomen_with_metal(seed, True)
        metal = metal_voxels(streaked)
        ((_, after),) = without_metal_streaks(streaked[:, :, None], metal[:, :, None], _SPACING)
        assert np.array_equal(after[metal], streaked[metal])
        apart = distance_transform_edt(~metal) * PIXEL_MM
        soft = (np.abs(clean - 50.0) < 100.0) & (apart > 5.0)
        for places, ratios in ((soft & (apart < 50.0), near), (soft & (apart >= 50.0), far)):
            ratios.append(_rms(after - clean, places) / _rms(streaked - clean, places))
    print(f"error beside metal {np.median(near):.2f} times as large (worst {max(near):.2f}), far {np.median(far):.2f}")
    assert np.median(near) < 0.6
    assert max(near) < 1.0
    assert max(far) < 1.1


@pytest.mark.parametrize("member", [343, 344, 345])
def test_streaks_are_found_and_lessened(member: int) -> None:
    look, anatomy, grid = draw_ct(member), build_anatomy(member), scan_grid((2.0, 2.0, 2.5))
    without = replace(look, gas_streaks=0.0, metal_streaks=0.0)
    hu, clean, truth = (
        np.asarray(assemble(anatomy, member, grid, appearance=one).volume.voxels, dtype=np.float32)
        for one in (look, without, replace(without, noise=1e-3))
    )
    found = find_streaks(hu, metal_voxels(hu) | gas_voxels(hu), grid.spacing_mm)
    assert found is not None
    assert found.noise_hu == pytest.approx(_rms(hu - truth, found.where), rel=0.2)
    assert found.usual_noise_hu == pytest.approx(look.noise, rel=0.1)
    after = without_streaks(hu, found)
    assert _rms(after - truth, found.where) < 0.65 * _rms(hu - truth, found.where)
    sound = find_streaks(clean, metal_voxels(clean) | gas_voxels(clean), grid.spacing_mm)
    soft = (np.abs(truth - 50.0) < 150.0).sum()
    assert sound is None or sound.where.sum() < 0.01 * soft


def test_values_that_no_streak_touches_stay() -> None:
    hu = np.stack([abdomen_with_metal(50, with_metal) for with_metal in (True, False, False)], axis=2)
    grid = Grid(hu.shape, [PIXEL_MM, PIXEL_MM, 5.0], [0.0, 0.0, 0.0])
    cleaned = cleaned_scan(Volume(np.rint(hu).astype(np.int16), grid))
    assert np.array_equal(cleaned.volume.voxels[:, :, 1:], np.rint(hu[:, :, 1:]).astype(np.int16))
    assert not cleaned.lost[:, :, 2].any()
    assert cleaned.metal_change_hu > 5.0
    assert "slice 0" in cleaned.sentences[0]


def test_a_scan_without_streaks_stays_as_it_is(tmp_path: Path) -> None:
    case = make_small_case(tmp_path / "case", Settings())
    before = case.path(SCAN).read_bytes()
    assert clean_case(case).sentences == ()
    assert case.path(SCAN).read_bytes() == before
    assert not case.has(ARTEFACTS)


def test_the_command_its_record_and_the_way_back(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    case = make_small_case(tmp_path / "case", Settings())
    volume = read_volume(case.path(SCAN))
    voxels = np.array(volume.voxels)
    voxels[20:22, 18:20, 10:14] = 3000
    write_volume(case.path(SCAN), Volume(voxels, volume.grid))
    before = case.path(SCAN).read_bytes()
    assert any("glisson artefacts" in warning for warning in case_warnings(case))
    assert main(["artefacts", str(case.folder), "--json"]) == 0
    told = json.loads(capfd.readouterr().out)
    assert told["metal_ml"] == pytest.approx(16 * 27e-3)
    assert told["lost_ml"] > told["metal_ml"]
    assert case.path(ARTEFACTS_PICTURE).stat().st_size > 5000
    assert read_labels(case.path(LOST)).mask("lost")[20:22, 18:20, 10:14].all()
    assert set(told["sentences"]) <= set(case_warnings(case))
    assert main(["artefacts", str(case.folder)]) == 2
    assert "already" in capfd.readouterr().err
    assert main(["artefacts", str(case.folder), "--undo"]) == 0
    assert case.path(SCAN).read_bytes() == before
    assert not case.has(ARTEFACTS)
    assert main(["artefacts", str(case.folder), "--undo"]) == 2


def test_an_mr_is_refused() -> None:
    grid = Grid((8, 8, 8), [1.0, 1.0, 1.0], [0.0, 0.0, 0.0])
    with pytest.raises(BadInput, match="MR"):
        cleaned_scan(Volume(np.zeros(grid.shape, dtype=np.int16), grid, "MR"))


def _rms(values: np.ndarray, where: np.ndarray) -> float:
    return float(np.sqrt((values[where] ** 2).mean()))
