from dataclasses import dataclass
from importlib.metadata import EntryPoint
from typing import Any, ClassVar

import pytest

from glisson.core import registry
from glisson.core.errors import BadInput


@dataclass(frozen=True)
class Options:
    radius_mm: float = 1.0


class Good:
    name: ClassVar[str] = "good"
    summary: ClassVar[str] = "A good one."
    Parameters: ClassVar[type[Any]] = Options
    missing: ClassVar[tuple[str, ...]] = ()

    def __init__(self, parameters: Options) -> None:
        self.parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        return cls.missing

    def mesh(self, surface: Any, progress: Any = None) -> None:
        """Nothing."""


class NoMesher(Good):
    name: ClassVar[str] = "idle"
    mesh = None


class Lacking(Good):
    name: ClassVar[str] = "lacking"
    missing: ClassVar[tuple[str, ...]] = ("torch>=2",)


class NotATechnique:
    name: ClassVar[str] = "odd"


HERE = __name__


@pytest.fixture
def offered(monkeypatch: pytest.MonkeyPatch) -> None:
    points = [
        EntryPoint("good", f"{HERE}:Good", "glisson.meshers"),
        EntryPoint("lacking", f"{HERE}:Lacking", "glisson.meshers"),
        EntryPoint("idle", f"{HERE}:NoMesher", "glisson.meshers"),
        EntryPoint("odd", f"{HERE}:NotATechnique", "glisson.meshers"),
        EntryPoint("renamed", f"{HERE}:Good", "glisson.meshers"),
        EntryPoint("gone", "a_package_that_is_not_there:X", "glisson.meshers"),
        EntryPoint("twice", f"{HERE}:Good", "glisson.meshers"),
        EntryPoint("twice", f"{HERE}:Lacking", "glisson.meshers"),
    ]
    monkeypatch.setattr(registry, "entry_points", lambda group: [p for p in points if p.group == group])


@pytest.mark.usefixtures("offered")
def test_a_technique_is_made_with_checked_parameters() -> None:
    made = registry.make_technique("mesher", "good", {"radius_mm": 2}, "case.toml: mesh")
    assert made.parameters == Options(2.0)


@pytest.mark.usefixtures("offered")
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("absent", ["no mesher technique 'absent'", "good"]),
        ("lacking", ["needs torch>=2", "install"]),
        ("idle", ["does not load", "it lacks mesh, see glisson.core.protocols.Mesher"]),
        ("odd", ["does not load", "Parameters"]),
        ("renamed", ["does not load", "'renamed'"]),
        ("gone", ["does not load", "a_package_that_is_not_there"]),
        ("twice", ["uninstall all but one"]),
    ],
)
def test_what_cannot_be_used_is_one_sentence(name: str, words: list[str]) -> None:
    with pytest.raises(BadInput) as caught:
        registry.technique_class("mesher", name)
    assert all(word in str(caught.value) for word in words), caught.value


def test_an_unknown_kind_is_refused() -> None:
    with pytest.raises(BadInput, match="known are"):
        registry.technique_class("painter", "x")


@pytest.mark.usefixtures("offered")
def test_broken_plug_ins_are_listed_and_hide_no_others() -> None:
    listed = {listing.name: listing for listing in registry.list_techniques()}
    assert listed["good"].is_available
    assert listed["lacking"].missing == ("torch>=2",)
    assert not listed["lacking"].is_available
    assert "a_package_that_is_not_there" in (listed["gone"].broken or "")
    assert not listed["odd"].is_available


def test_what_glisson_ships_is_registered_by_glisson() -> None:
    assert registry.technique_package("solver", "quasi-static") == "glisson"
