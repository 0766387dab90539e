"""The commands on a small case, with a solver that only bends; JSON keys as in the design's section 5."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import ndimage

from glisson.core.image import LabelMap
from glisson.framework.case import SCENARIO, SETTINGS, STALE
from glisson.io.images import read_labels, write_labels, write_volume
from small_case import GRID, contents, images, make_small_case, offer_bending

Glisson = Callable[..., tuple[int, dict[str, Any]]]


@pytest.fixture(autouse=True)
def bending(monkeypatch: pytest.MonkeyPatch) -> None:
    offer_bending(monkeypatch)


@pytest.fixture
def case(meshed_small_case: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(meshed_small_case, tmp_path / "case"))


def test_run_gives_the_guidance_and_then_skips_everything(case: Path, glisson: Glisson) -> None:
    code, said = glisson("run", case)
    assert code == 0
    assert said["status"] == "converged"
    assert list(said["seconds"]) == ["segment", "mesh", "scenario", "simulate", "navigate", "report"]
    assert said["seconds"]["mesh"] == 0.0
    assert said["seconds"]["simulate"] > 0.0
    assert set(said["plane"]) == {"carried", "rule"}
    assert set(said["volume"]) == {"liver_ml", "removed_before", "removed_after"}
    assert said["tumour"]["name"] == "tumour1"
    assert said["tumour"]["error_mm"] is None
    assert np.allclose(said["tumour"]["before_mm"], [30.0, 0.0, 6.0], atol=0.1)
    # The shear lifts a point at x by lift · x / 75 mm.
    assert np.allclose(said["tumour"]["after_mm"], [30.0, -8.0, 6.0], atol=0.1)
    assert said["elements"] > 0
    stored = json.loads((case / "results/results.json").read_text())
    assert stored["tumour"] == said["tumour"]
    assert (case / "results/report.html").stat().st_size > 10_000
    # Counted voxels and cut tetrahedra tell the same removed part.
    parts = read_labels(case / "results/parts.nii.gz")
    counted = parts.mask("removed").sum() / (parts.voxels > 0).sum()
    assert counted == pytest.approx(said["volume"]["removed_before"], abs=0.02)
    before = contents(case)
    code, again = glisson("run", case)
    assert code == 0
    assert set(again["seconds"].values()) == {0.0}
    assert again["tumour"] == said["tumour"]
    assert contents(case) == before


def test_an_option_is_kept_in_the_case_and_runs_what_it_touches(case: Path, glisson: Glisson) -> None:
    assert glisson("navigate", case)[0] == 0
    code, said = glisson("navigate", case, "--simulate.lift-mm", "40")
    assert code == 0
    assert [name for name, seconds in said["seconds"].items() if seconds > 0.0] == ["simulate", "navigate"]
    assert "lift_mm = 40.0" in (case / SETTINGS).read_text()
    code, said = glisson("navigate", case)
    assert set(said["seconds"].values()) == {0.0}
    code, said = glisson("navigate", case, "--plane.distance-mm", "8")
    assert [name for name, seconds in said["seconds"].items() if seconds > 0.0] == ["navigate"]
    assert said["margin_mm"] == pytest.approx(8.0, abs=0.3)


def test_a_changed_material_keeps_the_tetrahedra(case: Path, glisson: Glisson) -> None:
    mesh = (case / "mesh/model.vtu").read_bytes()
    text = (case / SETTINGS).read_text()
    (case / SETTINGS).write_text(text.replace("# young_modulus_kpa = 7.0", "young_modulus_kpa = 12.0"))
    code, said = glisson("mesh", case)
    assert code == 0
    assert said["seconds"]["mesh"] > 0.0
    assert (case / "mesh/model.vtu").read_bytes() == mesh
    model = json.loads((case / "mesh/model.json").read_text())
    assert model["materials"]["0"]["young_modulus_kpa"] == 12.0


def test_a_scenario_that_a_person_changed_is_kept(case: Path, glisson: Glisson) -> None:
    text = (case / SCENARIO).read_text().replace("angle_deg = 22.0", "angle_deg = 15.0")
    (case / SCENARIO).write_text(text)
    code, said = glisson("simulate", case)
    assert code == 0
    assert said["status"] == "converged"
    assert (case / SCENARIO).read_text() == text
    settings = (case / SETTINGS).read_text()
    code, said = glisson("simulate", case, "--scenario.angle-deg", "9")
    assert (code, said["status"]) == (2, "bad_input")
    assert "scenario have no effect, because scenario.toml was given or corrected by hand" in said["message"]
    assert (case / SETTINGS).read_text() == settings


def test_a_solve_that_fails_is_told_and_leaves_older_results(case: Path, glisson: Glisson) -> None:
    assert glisson("navigate", case)[0] == 0
    before = contents(case)
    code, said = glisson("navigate", case, "--simulate.outcome", "singular")
    assert code == 1
    assert said["status"] == "singular"
    assert said["stage"] == "simulate"
    assert "(1, 0, 0)" in said["message"]
    assert said["tumours"] is None
    assert said["seconds"] is None
    assert contents(case) == before


def test_results_say_so_when_the_case_has_moved_on(case: Path, glisson: Glisson) -> None:
    assert glisson("navigate", case)[0] == 0
    text = (case / SETTINGS).read_text()
    (case / SETTINGS).write_text(text.replace('technique = "bending"', 'technique = "bending"\noutcome = "singular"'))
    assert glisson("navigate", case)[0] == 1
    assert "simulate" in (case / STALE).read_text()
    (case / SETTINGS).write_text(text)
    code, said = glisson("navigate", case)
    assert code == 0
    assert set(said["seconds"].values()) == {0.0}
    assert not (case / STALE).exists()


def test_segment_compares_with_a_reference(tmp_path: Path, glisson: Glisson) -> None:
    case = make_small_case(tmp_path / "case")
    _, groups = images()
    write_labels(tmp_path / "liver.nii.gz", groups["organ"])
    code, said = glisson("segment", case.folder, "--reference", tmp_path / "liver.nii.gz")
    assert code == 0
    assert said["dice"] == 1.0
    assert said["asd_mm"] == said["hd95_mm"] == 0.0
    assert said["flagged_slices"] == []
    assert said["seconds"] > 0.0
    assert said["volume_ml"] == pytest.approx(groups["organ"].volume_ml("liver"))


def test_segment_keeps_a_mask_that_a_person_corrected(case: Path, glisson: Glisson) -> None:
    text = (case / SETTINGS).read_text().replace('technique = "labels"', 'technique = "seeded-contour"')
    (case / SETTINGS).write_text(text)
    organ = read_labels(case / "labels/organ.nii.gz")
    corrected = organ.voxels.copy()
    corrected[:, :, 0:22] = 0
    write_labels(case / "labels/organ.nii.gz", LabelMap(corrected, GRID, {1: "liver"}))
    code, said = glisson("segment", case)
    assert code == 0
    assert said["volume_ml"] == pytest.approx(float(corrected.sum()) * 27e-3)


def test_new_makes_a_case(tmp_path: Path, glisson: Glisson) -> None:
    volume, groups = images()
    write_volume(tmp_path / "scan.nii.gz", volume)
    write_labels(tmp_path / "liver.nii.gz", groups["organ"])
    code, said = glisson(
        "new", tmp_path / "case", "--ct", tmp_path / "scan.nii.gz", "--labels", tmp_path / "liver.nii.gz"
    )
    assert code == 0
    assert said["case"] == str(tmp_path / "case")
    assert (tmp_path / "case/images/ct.nii.gz").is_file()


def test_techniques_lists_every_kind_with_its_package(glisson: Glisson) -> None:
    code, said = glisson("techniques")
    assert code == 0
    rows = {(row["kind"], row["name"]): row for row in said["techniques"]}
    assert rows["mesher", "mmg"]["package"] == "glisson"
    assert rows["solver", "quasi-static"]["available"] is True


def test_doctor_finds_this_installation_well(glisson: Glisson) -> None:
    code, said = glisson("doctor")
    troubles = [finding for finding in said["findings"] if finding["needed"] and not finding["is_good"]]
    assert troubles == []
    assert code == 0
    assert said["ready"] is True


def test_doctor_says_what_is_missing(glisson: Glisson, monkeypatch: pytest.MonkeyPatch) -> None:
    from glisson.framework import checkup

    real = checkup.package_version
    monkeypatch.setattr(checkup, "package_version", lambda name: None if name == "embreex" else real(name))
    monkeypatch.setattr(checkup, "_column_under_its_weight", lambda: "not now")
    code, said = glisson("doctor")
    assert code == 1
    finding = next(finding for finding in said["findings"] if finding["name"] == "embreex")
    assert "install" in finding["detail"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--seed", "minus"], "--seed"),
        (["--seed-point", "1,2"], "X,Y,Z"),
        (["--seed-point", "1,2,inf"], "finite"),
        (["--mesh.technique", "no-such"], "no-such"),
        (["--mesh.edge-length-mm", "soft"], "a number"),
        (["--mesh.edge-length-mm", "-3"], "between"),
        (["--scenario.angle-deg", "700"], "between"),
    ],
)
def test_an_unusable_option_is_bad_input_and_changes_nothing(
    case: Path, glisson: Glisson, options: list[str], words: str
) -> None:
    before = contents(case)
    code, said = glisson("run", case, *options)
    assert code == 2
    assert said["status"] == "bad_input"
    assert words in said["message"]
    assert contents(case) == before


def test_clicks_correct_the_mask_and_make_what_follows_out_of_date(case: Path, glisson: Glisson) -> None:
    """Half of the tumour is taken out of the mask, and a click puts it back."""
    glisson("run", case)
    organ = read_labels(case / "labels/organ.nii.gz")
    whole = organ.mask("liver")
    tumour = read_labels(case / "labels/tumours.nii.gz").mask("tumour1")
    cut = LabelMap((whole & ~tumour).astype(np.uint8), GRID, {1: "liver"})
    write_labels(case / "labels/organ.nii.gz", cut)
    code, said = glisson("correct", case, "--add", "30,0,6")
    assert code == 0
    assert said["volume_before_ml"] == pytest.approx(cut.volume_ml("liver"))
    corrected = read_labels(case / "labels/organ.nii.gz").mask("liver")
    assert (corrected & tumour).sum() > 0.9 * tumour.sum()
    assert (corrected ^ whole).sum() < 0.01 * whole.sum()
    assert np.array_equal(read_labels(case / "labels/previous-organ.nii.gz").voxels, cut.voxels)
    code, said = glisson("correct", case, "--remove", "66,0,0")
    assert code == 0
    assert said["volume_ml"] < said["volume_before_ml"]
    assert "mesh" in (case / STALE).read_text()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "nothing to correct"),
        (["--add", "1,2"], "X,Y,Z"),
        (["--add", "0,0,0"], "inside the organ already"),
        (["--remove", "30,0,6", "--remove", "900,0,0"], "outside the scan"),
    ],
)
def test_a_click_that_cannot_be_applied_changes_nothing(
    case: Path, glisson: Glisson, options: list[str], words: str
) -> None:
    before = contents(case)
    code, said = glisson("correct", case, *options)
    assert code == 2
    assert words in said["message"]
    assert contents(case) == before


def test_drawn_slices_correct_the_mask_and_the_others_follow(case: Path, glisson: Glisson, tmp_path: Path) -> None:
    """A mask that is too small everywhere; every fifth slice is drawn as it truly is."""
    glisson("run", case)
    organ = read_labels(case / "labels/organ.nii.gz")
    whole = organ.mask("liver")
    shrunk = ndimage.binary_erosion(whole)
    write_labels(case / "labels/organ.nii.gz", LabelMap(shrunk.astype(np.uint8), GRID, {1: "liver"}))
    own = np.flatnonzero(whole.any(axis=(0, 1)))
    numbers = range(own[0], own[-1] + 1, 5)
    drawn = np.zeros_like(organ.voxels)
    drawn[:, :, numbers] = whole[:, :, numbers]
    write_labels(tmp_path / "drawn.nii.gz", LabelMap(drawn, GRID, {1: "liver"}))
    code, said = glisson("correct", case, "--suggest", "4", "--slices", tmp_path / "drawn.nii.gz")
    assert code == 0
    assert len(set(said["suggested_slices"])) == 4
    assert not set(said["suggested_slices"]) & set(numbers)
    assert np.array_equal(read_labels(case / "labels/organ.nii.gz").mask("liver"), shrunk)
    code, said = glisson("correct", case, "--slices", tmp_path / "drawn.nii.gz")
    assert code == 0
    corrected = read_labels(case / "labels/organ.nii.gz").mask("liver")
    assert np.array_equal(corrected[:, :, numbers], whole[:, :, numbers])
    assert (corrected ^ whole).sum() < 0.3 * (shrunk ^ whole).sum()
    assert said["volume_before_ml"] < said["volume_ml"]
    assert "mesh" in (case / STALE).read_text()


def test_only_slices_that_are_named_are_taken_from_a_drawn_mask(case: Path, glisson: Glisson, tmp_path: Path) -> None:
    """An empty one among them says that the liver is not in it."""
    glisson("run", case)
    whole = read_labels(case / "labels/organ.nii.gz").mask("liver")
    last = int(np.flatnonzero(whole.any(axis=(0, 1)))[-1])
    drawn = whole.copy()
    drawn[:, :, last] = False
    write_labels(tmp_path / "drawn.nii.gz", LabelMap(drawn.astype(np.uint8), GRID, {1: "liver"}))
    assert glisson("correct", case, "--slices", tmp_path / "drawn.nii.gz", "--numbers", f"{last - 4},{last}")[0] == 0
    corrected = read_labels(case / "labels/organ.nii.gz").mask("liver")
    assert not corrected[:, :, last].any()
    assert np.array_equal(corrected[:, :, : last - 4], whole[:, :, : last - 4])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--slices", "empty.nii.gz"], "is empty; draw the liver"),
        (["--slices", "empty.nii.gz", "--numbers", "2,x"], "K,K,K"),
        (["--slices", "empty.nii.gz", "--numbers", "900"], "no slice 900"),
        (["--slices", "empty.nii.gz", "--add", "30,0,6"], "one after the other"),
        (["--numbers", "3"], "give that mask with --slices"),
        (["--suggest", "0"], "1 or more"),
    ],
)
def test_drawn_slices_that_cannot_be_used_change_nothing(
    case: Path, glisson: Glisson, tmp_path: Path, options: list[str], words: str
) -> None:
    write_labels(tmp_path / "empty.nii.gz", LabelMap(np.zeros(GRID.shape, dtype=np.uint8), GRID, {1: "liver"}))
    before = contents(case)
    code, said = glisson("correct", case, *(tmp_path / o if o.endswith(".gz") else o for o in options))
    assert code == 2
    assert words in said["message"]
    assert contents(case) == before
