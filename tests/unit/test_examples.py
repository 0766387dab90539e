"""The tutorials in `examples/` and the snippet in the README do what they say."""

import re
import runpy
import shutil
from pathlib import Path

import pytest

from glisson.io.images import write_labels, write_volume
from small_case import images, offer_bending

ROOT = Path(__file__).resolve().parents[2]


def test_the_hanging_column_grows_as_the_closed_form_says() -> None:
    grown, known = runpy.run_path(str(ROOT / "examples/hanging_column.py"))["main"]()
    assert grown == pytest.approx(known, rel=1e-3)


def test_a_breath_is_followed_to_a_fraction_of_what_it_moves() -> None:
    errors, still = runpy.run_path(str(ROOT / "examples/following_a_breath.py"))["main"]()
    assert max(errors) < 0.2 * max(still)


def test_two_materials_leaves_the_tetrahedra_and_solves_twice(
    meshed_small_case: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    offer_bending(monkeypatch)
    case = Path(shutil.copytree(meshed_small_case, tmp_path / "case"))
    mesh = (case / "mesh/model.vtu").read_bytes()
    ways = runpy.run_path(str(ROOT / "examples/two_materials.py"))["main"](case)
    # The solver of the tests moves the tumour by 20 mm · 30 / 75 whatever the material.
    assert ways == pytest.approx({6.0: 8.0, 12.0: 8.0}, abs=0.05)
    assert (case / "mesh/model.vtu").read_bytes() == mesh
    assert "young_modulus_kpa = 12.0" in (case / "case.toml").read_text()


def test_the_snippet_of_the_readme_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from glisson.framework import settings
    from small_case import small_settings

    offer_bending(monkeypatch)
    chosen = {name: choice.technique for name, choice in small_settings().choices.items()}
    monkeypatch.setattr(settings, "DEFAULT_TECHNIQUES", chosen)
    volume, groups = images()
    write_volume(tmp_path / "scan.nii.gz", volume)
    (tmp_path / "masks").mkdir()
    for group in groups.values():
        for name in group.names.values():
            write_labels(tmp_path / "masks" / f"{name}.nii.gz", group)
    monkeypatch.chdir(tmp_path)
    (snippet,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    exec(compile(snippet, "README.md", "exec"), {})
    assert (tmp_path / "liver/results/report.html").is_file()
