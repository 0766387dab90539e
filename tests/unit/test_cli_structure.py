"""`glisson structure` on the small case: labels kept, the file before kept, and what is refused."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glisson.core.image import LabelMap
from glisson.framework.case import STRUCTURES, TUMOURS, Case
from glisson.io.images import read_labels, write_labels, write_volume
from small_case import GRID, TUMOUR_MM, contents, images, make_small_case, offer_bending

Glisson = Callable[..., tuple[int, dict[str, Any]]]
CLICK = "28,3,8"


@pytest.fixture
def case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Case:
    offer_bending(monkeypatch)
    return make_small_case(tmp_path / "case")


def test_both_techniques_are_listed(glisson: Glisson) -> None:
    _, said = glisson("techniques")
    rows = {row["name"]: row for row in said["techniques"] if row["kind"] == "structure-segmenter"}
    assert set(rows) == {"threshold", "contour"}
    assert all(row["available"] for row in rows.values())


def test_a_second_tumour_leaves_the_first_as_it_was(case: Case, glisson: Glisson) -> None:
    volume, _ = images()
    voxels = np.array(volume.voxels)
    cells = np.moveaxis(np.indices(GRID.shape), 0, -1).reshape(-1, 3)
    second = np.linalg.norm(GRID.points_from_indices(cells) - [-30.0, 0.0, 0.0], axis=1).reshape(GRID.shape) < 12.0
    voxels[second] -= 50
    write_volume(case.path("images/ct.nii.gz"), type(volume)(voxels, GRID))
    before = case.path(TUMOURS).read_bytes()
    first = read_labels(case.path(TUMOURS)).mask("tumour1")
    write_labels(case.folder / "truth.nii.gz", LabelMap(second.astype(np.uint8), GRID, {1: "tumour2"}))
    code, said = glisson(
        "structure", case.folder, "tumour2", "--seed-point", "-30,0,0", "--reference", case.folder / "truth.nii.gz"
    )
    assert code == 0, said
    assert said["dice"] > 0.9
    assert said["volume_before_ml"] == 0.0
    assert said["volume_ml"] == pytest.approx(second.sum() * 27e-3, rel=0.15)
    labels = read_labels(case.path(TUMOURS))
    assert set(labels.names.values()) == {"tumour1", "tumour2"}
    np.testing.assert_array_equal(labels.mask("tumour1"), first)
    assert case.path("labels/previous-tumours.nii.gz").read_bytes() == before


def test_marking_anew_replaces_and_removing_takes_away(case: Case, glisson: Glisson) -> None:
    given = read_labels(case.path(TUMOURS)).volume_ml("tumour1")
    code, said = glisson("structure", case.folder, "tumour1", "--seed-point", CLICK, "--technique", "contour")
    assert (code, said["technique"]) == (0, "contour"), said
    assert said["volume_before_ml"] == pytest.approx(given)
    assert said["volume_ml"] == pytest.approx(given, rel=0.2)
    marked = case.path(TUMOURS).read_bytes()
    code, said = glisson("structure", case.folder, "tumour1", "--remove")
    assert (code, said["volume_ml"]) == (0, 0.0)
    assert not (read_labels(case.path(TUMOURS)).voxels > 0).any()
    assert case.path("labels/previous-tumours.nii.gz").read_bytes() == marked
    code, said = glisson("structure", case.folder, "tumour1", "--remove")
    assert code == 2
    assert "no label 'tumour1'" in said["message"]


def test_a_wire_takes_its_voxels_from_the_duct_alone(case: Case, glisson: Glisson) -> None:
    volume, groups = images()
    voxels = np.array(volume.voxels)
    voxels[28:36, 18, 24] = 1500
    write_volume(case.path("images/ct.nii.gz"), type(volume)(voxels, GRID))
    x, y, z = GRID.points_from_indices([[32, 18, 24]])[0]
    duct = groups["structures"].mask("duct")
    code, said = glisson("structure", case.folder, "wire", "--seed-point", f"{x},{y},{z}")
    assert code == 0, said
    labels = read_labels(case.path(STRUCTURES))
    assert labels.mask("wire").sum() == 8
    np.testing.assert_array_equal(labels.mask("duct"), duct & ~labels.mask("wire"))
    assert any("duct" in note for note in said["notes"])


def test_what_another_label_has_is_left_to_it(case: Case, glisson: Glisson) -> None:
    """The first tumour's label covers half of it, so that the second can have the rest."""
    grid_x = GRID.points_from_indices(np.stack([np.arange(GRID.shape[0]), *np.zeros((2, GRID.shape[0]))], axis=1))[:, 0]
    tumour = read_labels(case.path(TUMOURS)).mask("tumour1")
    half = tumour & (grid_x < TUMOUR_MM[0])[:, None, None]
    write_labels(case.path(TUMOURS), LabelMap(half.astype(np.uint8), GRID, {1: "tumour1"}))
    code, said = glisson("structure", case.folder, "tumour2", "--seed-point", CLICK)
    assert code == 0, said
    assert any("tumour1" in note for note in said["notes"])
    labels = read_labels(case.path(TUMOURS))
    np.testing.assert_array_equal(labels.mask("tumour1"), half)
    assert (labels.mask("tumour2") & tumour & ~half).sum() > 0.7 * (tumour & ~half).sum()


def test_what_another_label_has_whole_is_refused(case: Case, glisson: Glisson) -> None:
    everything = LabelMap(np.ones(GRID.shape, dtype=np.uint8), GRID, {1: "tumour1"})
    write_labels(case.path(TUMOURS), everything)
    before = contents(case.folder)
    code, said = glisson("structure", case.folder, "tumour2", "--seed-point", CLICK)
    assert code == 2
    assert "tumour1 already" in said["message"]
    assert contents(case.folder) == before


@pytest.mark.parametrize(
    ("words", "code", "sentence"),
    [
        (["spleen", "--seed-point", "0,0,0"], 2, "tumour1, tumour2"),
        (["tumour1"], 2, "--seed-point"),
        (["tumour1", "--seed-point", "900,0,0"], 2, "outside the scan"),
        (["tumour1", "--seed-point", "1,2"], 2, "X,Y,Z"),
        (["tumour1", "--seed-point", CLICK, "--remove"], 2, "--remove"),
        (["tumour1", "--seed-point", CLICK, "--technique", "snake"], 2, "no structure-segmenter technique"),
        (["tumour1", "--seed-point", CLICK, "--reach-mm", "-3"], 2, "reach_mm"),
        (["tumour2", "--seed-point", "-30,0,0"], 1, "Nothing stands out"),
        (["wire", "--seed-point", "-30,0,0"], 1, "no metal"),
    ],
)
def test_what_cannot_be_is_one_sentence_and_changes_nothing(
    case: Case, glisson: Glisson, words: list[str], code: int, sentence: str
) -> None:
    before = contents(case.folder)
    ended, said = glisson("structure", case.folder, *words)
    assert ended == code, said
    assert sentence in said["message"]
    assert said["volume_ml"] is None
    assert contents(case.folder) == before
