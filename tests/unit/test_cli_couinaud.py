"""Segments and resections of a case, through the commands as a user runs them."""

import json

import numpy as np
import pytest

from couinaud_landmarks import true_landmarks
from glisson.cli.main import main
from glisson.framework.case import new_case
from glisson.framework.importing import write_images
from glisson.framework.settings import Settings
from glisson.io.images import read_labels
from glisson.io.markups import NamedPoints, write_points
from glisson.phantom.family import make_phantom


@pytest.fixture(scope="module")
def phantom():
    return make_phantom(33, (3.0, 3.0, 3.0))


@pytest.fixture
def case(tmp_path, phantom):
    with new_case(tmp_path / "case", Settings()) as making:
        write_images(making, phantom.volume, {"organ": phantom.organ, "structures": phantom.structures})
    return tmp_path / "case"


def _answer(words, capfd):
    code = main([*words, "--json"])
    return code, json.loads(capfd.readouterr().out)


def test_segments_by_given_landmarks_and_their_resections(tmp_path, case, phantom, capfd):
    marks = true_landmarks(phantom)
    write_points(tmp_path / "marks.mrk.json", NamedPoints(tuple(marks), np.array(list(marks.values()))))
    code, told = _answer(["couinaud", str(case), "--landmarks", str(tmp_path / "marks.mrk.json")], capfd)
    assert code == 0, told
    assert told["technique"] == "nearest-branch"
    assert not told["landmarks_proposed"]
    segments = read_labels(case / "labels" / "segments.nii.gz")
    assert list(segments.names.values()) == [f"segment {n}" for n in range(1, 9)]
    assert (case / "labels" / "segments.png").stat().st_size > 10_000
    code, table = _answer(["resections", str(case)], capfd)
    rows = {row["name"]: row for row in table["resections"]}
    whole = phantom.organ.volume_ml("liver")
    assert rows["left lobectomy"]["removed_ml"] + rows["left lobectomy"]["remnant_ml"] == pytest.approx(whole, rel=1e-9)
    assert rows["right liver resection"]["major"]
    assert code == 0


def test_without_landmarks_they_are_proposed_and_kept(case, phantom, capfd):
    code, told = _answer(["couinaud", str(case)], capfd)
    assert code == 0, told
    assert told["landmarks_proposed"]
    assert sum(told["volumes_ml"].values()) == pytest.approx(phantom.organ.volume_ml("liver"), rel=1e-9)
    code, told = _answer(["couinaud", str(case)], capfd)
    assert not told["landmarks_proposed"]  # those in the case are a person's to move


def test_resections_without_segments_are_refused(case, capfd):
    code, told = _answer(["resections", str(case)], capfd)
    assert code == 2
    assert "glisson couinaud" in told["message"]
