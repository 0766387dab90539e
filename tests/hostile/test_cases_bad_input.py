"""The bad inputs of the issue through the commands: an exit code, one sentence, and the case as it was."""

import html
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydicom.uid import generate_uid

from dicom_samples import stored_values, write_series
from glisson.cli.main import main
from glisson.core.image import Grid, LabelMap, Volume
from glisson.framework.case import ORGAN, REPORT, SCAN, SCENARIO, SETTINGS
from glisson.framework.settings_file import settings_text
from glisson.io.images import read_volume, write_labels, write_volume
from glisson.preoperative.imaging.scan_checks import scan_warnings
from small_case import GRID, contents, images, make_small_case, offer_bending, small_settings

Refused = Callable[..., str]

SHIFTED = Grid(GRID.shape, GRID.spacing_mm, GRID.origin_mm + np.array([0.0, 0.0, 3.0]))


@pytest.fixture
def refused(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Refused:
    """Run a command that must fail with an exit code, leaving a folder as it is; its one sentence."""
    offer_bending(monkeypatch)

    def run(folder: Path, code: int, *words: Any) -> str:
        before = contents(folder)
        for as_json in (False, True):
            found = main([*map(str, words), *(["--json"] if as_json else [])])
            out, err = capfd.readouterr()
            assert "Traceback" not in out + err
            assert found == code, out + err
            assert contents(folder) == before
        said = json.loads(out)
        assert (said["status"] == "bad_input") == (code == 2)
        message: str = said["message"]
        assert message.endswith(".")
        assert "\n" not in message
        return message

    return run


@pytest.fixture
def meshed(meshed_small_case: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(meshed_small_case, tmp_path / "case"))


def new(folder: Path, *words: Any) -> tuple[Any, ...]:
    return ("new", folder / "case", "--ct", *words)


def test_a_folder_without_dicom(tmp_path: Path, refused: Refused) -> None:
    (tmp_path / "scan").mkdir()
    (tmp_path / "scan" / "readme.txt").write_text("nothing here")
    assert "DICOM" in refused(tmp_path, 2, *new(tmp_path, tmp_path / "scan"))
    assert "does not exist" in refused(tmp_path, 2, *new(tmp_path, tmp_path / "nowhere"))


def test_two_series_mixed(tmp_path: Path, refused: Refused) -> None:
    write_series(tmp_path / "scan", stored_values(), prefix="a")
    write_series(tmp_path / "scan", stored_values(), prefix="b")
    assert "2 series" in refused(tmp_path, 2, *new(tmp_path, tmp_path / "scan"))


def test_one_of_two_series_is_chosen(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    wanted = generate_uid()
    write_series(tmp_path / "scan", stored_values(8), SeriesInstanceUID=wanted)
    write_series(tmp_path / "scan", stored_values(2), prefix="b")
    assert main(list(map(str, (*new(tmp_path, tmp_path / "scan"), "--series", wanted)))) == 0
    assert read_volume(tmp_path / "case" / SCAN).grid.shape[2] == 8


def test_a_missing_slice(tmp_path: Path, refused: Refused) -> None:
    paths = write_series(tmp_path / "scan", stored_values(8))
    paths[4].unlink()
    assert "slice" in refused(tmp_path, 2, *new(tmp_path, tmp_path / "scan"))


def body() -> np.ndarray:
    """Stored values (slices, rows, columns) of HU + 1024: soft tissue with fat about it, in air."""
    y, x = np.mgrid[-1:1:40j, -1:1:36j]
    distance = np.hypot(x, y)
    values = np.select([distance < 0.6, distance < 0.8], [60, -95], -1000) + 1024
    return np.repeat(values[None], 8, axis=0).astype(np.uint16)


@pytest.mark.parametrize(
    ("values", "tags", "words"),
    [
        (body(), {"RescaleIntercept": 0}, "about 1000 too high, as in images that were never rescaled"),
        (body() - 24, {"RescaleIntercept": 0}, "about 1000 too high"),
        (body(), {"RescaleIntercept": -2048}, "rescaled twice"),
        (body(), {"RescaleSlope": 8, "RescaleIntercept": 5000}, "only 0.0 % lie where fat and soft tissue do"),
        (np.clip(body() // 4, 200, 290) - 200, {"RescaleIntercept": 0}, "windowed or normalised"),
        (body() // 1000, {"RescaleIntercept": 0}, "windowed or normalised"),
    ],
    ids=["never", "never, with another offset", "twice", "wildly", "windowed", "normalised"],
)
def test_values_that_are_no_hu(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], values: np.ndarray, tags: dict[str, Any], words: str
) -> None:
    """Told when the case is made, and refused where HU are needed."""
    write_series(tmp_path / "scan", values, **tags)
    assert main([*map(str, new(tmp_path, tmp_path / "scan")), "--json"]) == 0
    [warning] = json.loads(capfd.readouterr().out)["warnings"]
    assert words in warning
    before = contents(tmp_path / "case")
    assert main(["segment", str(tmp_path / "case"), "--json"]) == 2
    assert words in json.loads(capfd.readouterr().out)["message"]
    assert contents(tmp_path / "case") == before


def test_hu_are_not_complained_of(tmp_path: Path) -> None:
    for tags in ({}, {"RescaleSlope": 1, "RescaleIntercept": -1000}):
        write_series(tmp_path / "scan", body(), **tags)
        assert scan_warnings(read_volume(tmp_path / "scan")) == ()
        shutil.rmtree(tmp_path / "scan")
    padded = body()
    padded[:, :4] = padded[:, -4:] = 0
    write_series(tmp_path / "scan", padded)
    assert scan_warnings(read_volume(tmp_path / "scan")) == ()
    inside = np.random.default_rng(0).normal(110.0, 12.0, (20, 20, 20)).astype(np.int16)
    assert scan_warnings(Volume(inside, Grid(inside.shape, np.ones(3), np.zeros(3)))) == ()


def test_thick_slices_and_a_liver_cut_by_the_scan(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both are told by every command that looks, for machines too, and on top of the report."""
    offer_bending(monkeypatch)
    volume, groups = images()
    grid = Grid((64, 36, 10), [3.0, 3.0, 10.0], GRID.origin_mm + np.array([0.0, 0.0, 3.0]))
    part = (slice(None), slice(None), slice(1, 31, 3))
    liver = LabelMap(groups["organ"].voxels[part], grid, {1: "liver"})
    write_volume(tmp_path / "scan.nii.gz", Volume(volume.voxels[part], grid))
    write_labels(tmp_path / "liver.nii.gz", liver)
    words = new(tmp_path, tmp_path / "scan.nii.gz", "--labels", tmp_path / "liver.nii.gz")
    thick, cut = "The slices lie 10 mm apart", "touches the scan's last layer along axis k"

    def said(*words: Any) -> dict[str, Any]:
        assert main([*map(str, words), "--json"]) == 0
        out, err = capfd.readouterr()
        assert thick in err
        values: dict[str, Any] = json.loads(out)
        return values

    assert [thick in warning for warning in said(*words)["warnings"]] == [True]
    case = tmp_path / "case"
    (case / SETTINGS).write_text(settings_text(small_settings()))
    warnings = said("segment", case)["warnings"]
    assert any(thick in warning and "up to 5 mm" in warning for warning in warnings)
    assert any(cut in warning for warning in warnings)
    notes = said("run", case)["notes"]
    assert warnings == notes[: len(warnings)]
    page = html.unescape((case / REPORT).read_text())
    assert all(warning in page for warning in warnings)


def test_a_label_map_on_another_grid(tmp_path: Path, refused: Refused) -> None:
    volume, groups = images()
    write_volume(tmp_path / "scan.nii.gz", volume)
    write_labels(tmp_path / "liver.nii.gz", LabelMap(groups["organ"].voxels, SHIFTED, {1: "liver"}))
    words = new(tmp_path, tmp_path / "scan.nii.gz", "--labels", tmp_path / "liver.nii.gz")
    assert "another grid" in refused(tmp_path, 2, *words)


def test_a_label_map_on_another_grid_put_into_the_case(meshed: Path, refused: Refused) -> None:
    _, groups = images()
    write_labels(meshed / ORGAN, LabelMap(groups["organ"].voxels, SHIFTED, {1: "liver"}))
    assert "grid" in refused(meshed, 2, "run", meshed)


def test_a_reference_on_another_grid(meshed: Path, tmp_path: Path, refused: Refused) -> None:
    _, groups = images()
    write_labels(tmp_path / "liver.nii.gz", LabelMap(groups["organ"].voxels, SHIFTED, {1: "liver"}))
    assert "another grid" in refused(meshed, 2, "segment", meshed, "--reference", tmp_path / "liver.nii.gz")


def test_a_mask_with_two_components(tmp_path: Path, refused: Refused) -> None:
    case = make_small_case(tmp_path / "case")
    _, groups = images()
    parts = groups["organ"].voxels.copy()
    parts[28:34] = 0
    write_labels(case.path(ORGAN), LabelMap(parts, GRID, {1: "liver"}))
    for command in ("segment", "mesh", "run"):
        assert "2 separate parts" in refused(case.folder, 2, command, case.folder)


def test_an_empty_mask(tmp_path: Path, refused: Refused) -> None:
    case = make_small_case(tmp_path / "case")
    write_labels(case.path(ORGAN), LabelMap(np.zeros(GRID.shape, np.uint8), GRID, {1: "liver"}))
    assert "empty" in refused(case.folder, 2, "run", case.folder)


def test_a_mesh_that_cannot_be_made(tmp_path: Path, refused: Refused) -> None:
    case = make_small_case(tmp_path / "case")
    _, groups = images()
    sheet = groups["organ"].voxels.copy()
    sheet[:, :, : sheet.shape[2] // 2] = sheet[:, :, sheet.shape[2] // 2 + 1 :] = 0
    write_labels(case.path(ORGAN), LabelMap(sheet, GRID, {1: "liver"}))
    main(["segment", str(case.folder)])
    assert "thinner than the lattice" in refused(case.folder, 1, "mesh", case.folder, "--mesh.envelope-mm", "10")


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("poisson_ratio = 0.5", "below 0.5"),
        ("poisson_ratio = 0.7", "below 0.5"),
        ("poisson_ratio = nan", "poisson_ratio"),
        ("young_modulus_kpa = 0", "positive"),
        ("young_modulus_kpa = -7", "positive"),
        ("young_modulus_kpa = inf", "young_modulus_kpa"),
        ('young_modulus_kpa = "soft"', "young_modulus_kpa"),
        ("density_kg_m3 = -1", "Density"),
        ('law = "jelly"', "jelly"),
    ],
)
def test_a_material_out_of_range(meshed: Path, refused: Refused, line: str, words: str) -> None:
    preset = '\npreset = "human-liver"\n'
    (meshed / SETTINGS).write_text((meshed / SETTINGS).read_text().replace(preset, f"{preset}{line}\n"))
    message = refused(meshed, 2, "run", meshed)
    assert words in message
    assert "jelly" in message or "materials.liver" in message


def test_a_lever_that_does_not_touch(meshed: Path, refused: Refused) -> None:
    """With the real solver: the bar lies 200 mm below the liver and is lifted by 5°."""
    text = (meshed / SETTINGS).read_text()
    (meshed / SETTINGS).write_text(text.replace('technique = "bending"', 'technique = "quasi-static"\nelement = "T4"'))
    lines = (meshed / SCENARIO).read_text().replace("from-gravity", "as-scanned").splitlines()
    at = next(number for number, line in enumerate(lines) if line.startswith("hinge_mm"))
    lines[at + 2] = "    200.0,"
    text = "\n".join(lines).replace("angle_deg = 22.0", "angle_deg = 5.0")
    (meshed / SCENARIO).write_text(text)
    message = refused(meshed, 2, "run", meshed)
    assert "never touched" in message
    assert "'lever'" in message


@pytest.mark.parametrize(
    ("part", "text", "words"),
    [
        (SETTINGS, "schema = 2", "newer Glisson"),
        (SETTINGS, "schema = 1\n[mesh", "half-written"),
        (SETTINGS, "schema = 1\ncolour = 'red'", "colour"),
        (SETTINGS, 'schema = 1\ntarget = "tumour9"\n[simulate]\ntechnique = "bending"', "tumour9"),
        (SCAN, "not an image", "ct.nii.gz"),
        ("scenario.toml", "schema = 1\nstages = 3", "stages"),
        ("scenario.toml", "", "scenario.toml"),
    ],
)
def test_a_damaged_file(meshed: Path, refused: Refused, part: str, text: str, words: str) -> None:
    if part == SETTINGS and "tumour9" in text:
        text = (meshed / SETTINGS).read_text().replace("# target =", 'target = "tumour9"')
        main(["simulate", str(meshed)])
    (meshed / part).write_text(text)
    assert words in refused(meshed, 2, "run", meshed)


def test_no_case(tmp_path: Path, refused: Refused) -> None:
    for command in ("segment", "mesh", "simulate", "navigate", "report", "run"):
        assert "no case folder" in refused(tmp_path, 2, command, tmp_path / "nowhere")
        assert "not a case folder" in refused(tmp_path, 2, command, tmp_path)


def test_no_click_for_the_contour(tmp_path: Path, refused: Refused) -> None:
    """A CT of nothing but fat has no liver to be found; a click may also lie outside."""
    case = make_small_case(tmp_path / "case", small_settings().choosing("segment", "seeded-contour", {}))
    case.path(ORGAN).unlink()
    scan = read_volume(case.path(SCAN))
    write_volume(case.path(SCAN), Volume(np.full(scan.grid.shape, -90, dtype=np.int16), scan.grid))
    assert "No organ like a liver" in refused(case.folder, 1, "run", case.folder)
    assert "outside" in refused(case.folder, 2, "run", case.folder, "--seed-point", "900,0,0")


def test_a_demo_never_overwrites(meshed: Path, tmp_path: Path, refused: Refused) -> None:
    assert "not a demo" in refused(meshed, 2, "demo", "--out", meshed)
    (tmp_path / "file").write_text("mine")
    assert "not a demo" in refused(tmp_path, 2, "demo", "--out", tmp_path / "file")
    assert "exists already" in refused(tmp_path, 2, "new", meshed, "--ct", meshed / SCAN)
