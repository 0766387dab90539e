"""A lab's own segmenter, in a package of its own, is found and used; Glisson's source is not touched."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from glisson.io.images import write_labels
from small_case import images, make_small_case, small_settings

PLUGIN = Path(__file__).resolve().parents[2] / "examples" / "plugin"


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The plug-in built and installed into a folder."""
    target = tmp_path_factory.mktemp("site")
    options = ["--quiet", "--no-deps", "--no-build-isolation", "--no-index", "--disable-pip-version-check"]
    command = [sys.executable, "-m", "pip", "install", *options, "--target", str(target), str(PLUGIN)]
    subprocess.run(command, check=True, capture_output=True)
    return target


def glisson(installed: Path, *words: str) -> tuple[int, dict[str, Any]]:
    environment = os.environ | {"PYTHONPATH": str(installed)}
    command = [sys.executable, "-m", "glisson.cli.main", *words, "--json"]
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert "Traceback" not in ended.stderr
    return ended.returncode, json.loads(ended.stdout)


def test_it_is_listed_with_its_package(installed: Path) -> None:
    _, said = glisson(installed, "techniques")
    row = next(row for row in said["techniques"] if row["name"] == "threshold")
    assert row["kind"] == "segmenter"
    assert row["package"] == "glisson-threshold"
    assert row["available"] is True


def test_it_segments_with_its_own_options(installed: Path, tmp_path: Path) -> None:
    settings = small_settings().choosing("segment", "seeded-contour", {}).choosing("simulate", "quasi-static", {})
    case = make_small_case(tmp_path / "case", settings)
    _, groups = images()
    case.path("labels/organ.nii.gz").rename(tmp_path / "truth.nii.gz")
    choice = ["--segment.technique", "threshold", "--segment.lowest-hu", "20", "--seed-point", "-30,0,0"]
    code, said = glisson(installed, "segment", str(case.folder), *choice, "--reference", str(tmp_path / "truth.nii.gz"))
    assert code == 0, said
    assert said["dice"] > 0.97
    assert said["volume_ml"] == pytest.approx(groups["organ"].volume_ml("liver"), rel=0.06)
    text = case.path("case.toml").read_text()
    assert 'technique = "threshold"' in text
    assert "lowest_hu = 20.0" in text
    # Without the plug-in the case says what is missing.
    ended = subprocess.run(
        [sys.executable, "-m", "glisson.cli.main", "segment", str(case.folder)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 2
    assert "no segmenter technique 'threshold'" in ended.stdout + ended.stderr


def test_what_it_refuses_is_one_sentence(installed: Path, tmp_path: Path) -> None:
    case = make_small_case(tmp_path / "case", small_settings().choosing("simulate", "quasi-static", {}))
    write_labels(tmp_path / "organ.nii.gz", images()[1]["organ"])
    choice = ["--segment.technique", "threshold", "--segment.lowest-hu", "190"]
    code, said = glisson(installed, "segment", str(case.folder), *choice)
    assert code == 2
    assert "lowest_hu must lie below" in said["message"]
