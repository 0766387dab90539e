"""The study of segmentation: injected failures do what they say and are flagged, and the conclusion sums up."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import ndimage

from glisson.cli import study as command
from glisson.core import Grid
from glisson.preoperative.liver.intensity_prior import IntensityPrior
from glisson.preoperative.liver.slice_flags import suspicious_slices
from glisson.studies.point import Outcome
from glisson.studies.segmentation.failures import KINDS, Surroundings, spoilt
from glisson.studies.segmentation.study import SegmentationStudy
from preoperative_shapes import ellipsoid, mask_of
from studies_in_process import InThisProcess

GRID = Grid((60, 50, 40), [2.5, 2.5, 3.0], [-75.0, -62.0, -60.0])
PRIOR = IntensityPrior(110.0, 4.0)


@pytest.fixture(scope="module")
def scene() -> tuple[np.ndarray, np.ndarray, Surroundings]:
    """A liver of 110 HU with a tumour of 65 HU under its surface, beside a stomach of 30 HU, in fat; with noise."""
    liver = mask_of(ellipsoid((-10.0, 0.0, 0.0), (50.0, 42.0, 48.0)), GRID)
    stomach = mask_of(ellipsoid((55.0, 0.0, 0.0), (25.0, 30.0, 35.0)), GRID) & ~liver
    tumour = mask_of(ellipsoid((-44.0, 0.0, 0.0), (12.0, 12.0, 12.0)), GRID) & liver
    clean = np.select([tumour, liver, stomach], [65.0, 110.0, 30.0], -90.0)
    smooth = clean + np.random.default_rng(0).normal(0.0, 4.0, GRID.shape)
    return liver, smooth.astype(np.float32), Surroundings([stomach], [tumour], GRID.spacing_mm)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_failures_are_flagged_and_good_slices_are_not(scene, kind: str, seed: int) -> None:
    liver, smooth, around = scene
    failure = spoilt(kind, liver, around, np.random.default_rng(seed))
    assert failure is not None
    flagged = {k for k, why in suspicious_slices(failure.mask, smooth, PRIOR, GRID.spacing_mm).items() if why}
    assert len(failure.failed & flagged) >= 0.75 * len(failure.failed)
    assert len(failure.good & flagged) <= 0.1 * len(failure.good)


def test_a_good_mask_has_no_flags_and_an_empty_one_is_not_judged(scene) -> None:
    liver, smooth, _ = scene
    assert not suspicious_slices(liver, smooth, PRIOR, GRID.spacing_mm)
    assert not suspicious_slices(np.zeros_like(liver), smooth, PRIOR, GRID.spacing_mm)


def test_failures_are_what_they_say(scene) -> None:
    liver, _, around = scene
    made = {kind: spoilt(kind, liver, around, np.random.default_rng(5)) for kind in KINDS}
    for kind, failure in made.items():
        assert failure is not None, kind
        apart = (failure.mask ^ liver).any(axis=(0, 1))
        assert failure.failed <= set(np.flatnonzero(apart).tolist())
        assert not failure.good & set(np.flatnonzero(apart).tolist())
    assert (made["leak"].mask & ~liver <= around.neighbours[0]).all()
    assert (made["leak"].mask >= liver).all()
    depth = ndimage.distance_transform_edt(liver, sampling=GRID.spacing_mm)
    assert depth[liver & ~made["shrunken"].mask].max() <= 10.0
    assert not (made["missing tumour"].mask & around.tumours[0]).any()
    (shifted,) = made["shifted"].failed
    (empty,) = made["empty"].failed
    assert made["shifted"].mask[:, :, shifted].sum() == liver[:, :, shifted].sum()
    assert not made["empty"].mask[:, :, empty].any()


def test_what_the_organs_middle_does_not_reach_is_told() -> None:
    """A neighbour as bright as the organ that touches it from top to bottom: only the region knows where that ends."""
    whole = np.zeros(GRID.shape, dtype=bool)
    whole[10:50, 10:40, 5:35] = True
    region = whole.copy()
    region[38:] = False
    smooth = np.where(whole, PRIOR.mean, -90.0).astype(np.float32)
    assert not suspicious_slices(whole, smooth, PRIOR, GRID.spacing_mm, whole)
    reasons = suspicious_slices(whole, smooth, PRIOR, GRID.spacing_mm, region)
    assert set(reasons) == set(range(5, 35))
    assert all("narrow passage" in why for (why,) in reasons.values())


def test_where_there_is_no_place_for_a_failure_there_is_none(scene) -> None:
    liver, _, around = scene
    alone = Surroundings([np.zeros_like(liver)], [], around.spacing_mm)
    for kind in ("leak", "missing tumour"):
        assert spoilt(kind, liver, alone, np.random.default_rng(0)) is None


def test_the_conclusion_has_distributions_and_recall() -> None:
    study = SegmentationStudy(cts=2, mrs=1)
    points = study.points({})
    run = {"asd_mm": 1.0, "hd95_mm": 3.0, "seconds": 9.0, "slices": 80, "flagged": 4, "message": ""}
    flags = {"failure": "leak", "failed": 4, "failed_flagged": 3, "good": 70, "good_flagged": 7}
    first = {"runs": [{"start": "no click", "dice": 0.97, **run}, {"start": "one click", "dice": 0.99, **run}]}
    second = {"runs": [{"start": "no click", "message": "No organ."}, {"start": "one click", "dice": 0.95, **run}]}
    outcomes = [Outcome(first | {"flags": [flags]}), Outcome(second | {"flags": [flags | {"failed_flagged": 0}]})]
    done = dict(zip([point.key for point in points], outcomes, strict=False))
    conclusion = study.conclude({}, done)
    values = conclusion.values
    assert values["scores"][0]["dice"] == {"median": 0.97, "p5": 0.97, "worst": 0.97}
    assert values["scores"][1]["dice"] == {"median": 0.97, "p5": pytest.approx(0.952), "worst": 0.95}
    assert values["scores"][2]["dice"] is None
    leak, everything = values["flags"][0], values["flags"][-1]
    assert (leak["recall"], leak["noticed"], leak["good_flagged_share"]) == (0.375, 1, 0.1)
    assert everything == leak | {"failure": "all"}
    assert values["flagged_share"] == 0.05
    assert [row["message"] for row in values["failed"]] == ["No organ."]
    assert values["unfinished"] == 1
    assert b"No organ" in conclusion.files["report.html"]


def test_the_command_examines_a_scan(
    glisson: Callable[..., tuple[int, dict[str, Any]]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(command, "LocalPool", InThisProcess)
    monkeypatch.setattr("glisson.studies.segmentation.study.QUICK_CTS", 1)
    monkeypatch.setattr("glisson.studies.segmentation.study.QUICK_MRS", 0)
    code, said = glisson("study", "segmentation", "--quick", "--out", tmp_path)
    assert code == 0, said["message"]
    assert said["failed"] == []
    assert {row["start"] for row in said["rows"]} == {"no click", "one click"}
    # A click on any voxel may hit a vessel or the border: what comes of it is told, and not asked for here.
    assert next(row["dice"] for row in said["rows"] if row["start"] == "no click") >= 0.93
    assert said["flags"][-1]["recall"] >= 0.75
    assert said["flags"][-1]["good_flagged_share"] <= 0.15
    assert (tmp_path / "scores.png").exists()
