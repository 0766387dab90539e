import tomllib
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import pytest

from glisson.core.errors import BadInput
from glisson.core.model import Material
from glisson.core.parameters import parameter
from glisson.framework import settings_file
from glisson.framework.settings import CapsuleSettings, PlaneSettings, RodSettings, SegmentSettings, Settings
from glisson.framework.settings_file import settings_from_table, settings_text
from glisson.preoperative.model.attachments import BoxAttachment, DirectionAttachment, LigamentAttachment
from glisson.preoperative.model.material_presets import PRESETS
from glisson.preoperative.model.refinements import BallRefinement, TumourRefinement
from glisson.preoperative.scenario.lever_placement import LeverLiftParameters


@dataclass(frozen=True)
class Options:
    edge_length_mm: float = parameter(8.0, "Mean edge length.", 1.0, 50.0)
    quality: str = parameter("good", "How good.", choices=("good", "best"))


@pytest.fixture(autouse=True)
def _any_technique(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(settings_file, "technique_class", lambda kind, name: SimpleNamespace(Parameters=Options))


def parsed(text: str) -> Settings:
    return settings_from_table(tomllib.loads(text), "case.toml")


MANY = replace(
    Settings(seed=7, target="tumour2", materials={"liver": Material("neo-hookean-log", 12.0, 0.3)}),
    segment=SegmentSettings(((1.0, 2.0, 3.0),)),
    attachments=(
        DirectionAttachment(directions=("superior",), reach=0.2),
        BoxAttachment((0.0, -10.0, 5.0), (1.0, 2.0, 30.0), "ligament", 4.0),
        LigamentAttachment("falciform", 0.5),
    ),
    refinements=(TumourRefinement(4.0, 3.0), BallRefinement((1.0, 2.0, 3.0))),
    capsule=CapsuleSettings(900.0, 0.2),
    rod=RodSettings(12.5, friction=0.2),
    scenario=LeverLiftParameters(angle_deg=30.0, gas_pressure_kpa=1.6),
    plane=PlaneSettings(7.5, ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))),
).choosing("mesh", "netgen", {"edge_length_mm": 5.0})


@pytest.mark.parametrize("settings", [Settings(), MANY])
def test_what_is_written_is_read_back(settings: Settings) -> None:
    assert parsed(settings_text(settings)) == settings


def test_the_written_file_explains_the_defaults() -> None:
    text = settings_text(Settings())
    assert "# Mean edge length. Must lie between 1 and 50.\n# edge_length_mm = 8.0\n" in text
    assert "One of good, best." in text
    uncommented = text.replace("# edge_length_mm = 8.0", "edge_length_mm = 9.0")
    assert parsed(uncommented).choices["mesh"].parameters == {"edge_length_mm": 9.0}


def test_a_change_touches_only_its_line_and_keeps_a_persons_comments() -> None:
    before = settings_text(Settings()).replace("seed = 0", "seed = 0  # as in the paper") + "\n# my note\n"
    after = settings_text(replace(Settings(), segment=SegmentSettings(((1.0, 2.0, 3.0),))), before)
    added = [line for line in after.splitlines() if line not in before.splitlines()]
    assert added == ["seed_points_mm = [[1.0, 2.0, 3.0]]"]
    assert [line for line in before.splitlines() if line not in after.splitlines()] == []


def test_a_preset_is_where_a_material_begins() -> None:
    """Stiffnesses of the dissertation's sections 1.4 and 4.3; it cites 6 and 13 kPa and computes with 700."""
    stiffness = {"human-liver": 7.0, "cadaver-liver": 6.0, "pig-liver": 13.0, "dissertation": 700.0}
    assert {name: preset.material.young_modulus_kpa for name, preset in PRESETS.items()} == stiffness
    pig = parsed("[materials.liver]\npreset = 'pig-liver'\npoisson_ratio = 0.49").materials["liver"]
    assert (pig.young_modulus_kpa, pig.poisson_ratio, pig.density_kg_m3) == (13.0, 0.49, 1150.0)
    text = settings_text(Settings())
    assert parsed(text.replace('preset = "human-liver"', 'preset = "pig-liver"')).materials["liver"] == replace(
        Settings().materials["liver"], young_modulus_kpa=13.0
    )


def test_another_technique_does_not_inherit_parameters() -> None:
    changed = MANY.choosing("mesh", "mmg", {})
    assert changed.choices["mesh"].parameters == {}
    assert MANY.choosing("mesh", None, {"quality": "best"}).choices["mesh"].parameters == {
        "edge_length_mm": 5.0,
        "quality": "best",
    }


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("patient_name = 'Doe'", ["patient_name", "does not know"]),
        ("[plane]\ndistanse_mm = 3", ["case.toml: plane", "distanse_mm"]),
        ("[plane]\ndistance_mm = -1", ["plane", "between 0 and 100"]),
        ("[plane]\npoints_mm = [[0, 0, 0], [1, 0, 0]]", ["points_mm", "list of 3"]),
        ("plane = 3", ["plane", "[plane]"]),
        ("[segment]\nseed_points_mm = [[1, 2]]", ["segment", "seed_points_mm"]),
        ("[mesh]\ntechnique = 4", ["mesh.technique"]),
        ("[materials.liver]\nyoung_modulus_kpa = 0", ["materials.liver", "positive"]),
        ("[materials.liver]\npoisson_ratio = 0.5", ["materials.liver", "below 0.5"]),
        ("[materials.liver]\nyoung = 3", ["materials.liver", "young"]),
        ("[materials]\nliver = 3", ["materials.liver", "table"]),
        ("[materials.liver]\npreset = 'cow'", ["materials.liver", "pig-liver", "cow"]),
        ("[[attachments]]\nkind = 'ligament'\nname = 'round'", ["attachments", "falciform", "round"]),
        ("attachments = 3", ["attachments", "[[attachments]]"]),
        ("[[attachments]]\nkind = 'ring'", ["attachments", "ring"]),
        ("[[attachments]]\nreech = 0.2", ["attachments", "reech"]),
        ("[[refinements]]\nkind = 'ball'", ["refinements", "centre_mm"]),
        ("[scenario]\nangle_deg = 90", ["scenario", "angle_deg"]),
        ("seed = -1", ["seed"]),
        ("target = 2", ["target"]),
    ],
)
def test_an_unusable_entry_is_refused_with_its_path(text: str, words: list[str]) -> None:
    with pytest.raises(BadInput) as caught:
        parsed(text)
    sentence = str(caught.value)
    assert sentence.startswith("case.toml")
    assert all(word in sentence for word in words), sentence


def test_parameters_are_checked_when_the_technique_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    from glisson.framework import settings as settings_module

    def known(kind: str, name: str) -> Any:
        return SimpleNamespace(Parameters=Options)

    monkeypatch.setattr(settings_module, "technique_class", known)
    with pytest.raises(BadInput, match=r"case\.toml: mesh \(mmg\).*edge_lenght"):
        parsed("[mesh]\nedge_lenght_mm = 3").choices["mesh"].all_parameters("case.toml", 0)
