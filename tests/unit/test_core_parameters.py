from dataclasses import dataclass

import pytest

from glisson.core.errors import BadInput
from glisson.core.parameters import build_parameters, parameter, range_phrase


@dataclass(frozen=True)
class Wanted:
    radius_mm: float = parameter(15.0, "Radius.", 1.0, 50.0)
    steps: int = parameter(10, "Steps.", 1)
    mode: str = parameter("fast", "Mode.", choices=("fast", "exact"))
    smooth: bool = parameter(True, "Smooth.")
    target: str | None = parameter(None, "Target.")
    point_mm: tuple[float, float, float] = parameter((0.0, 0.0, 0.0), "Point.")
    weights: tuple[float, ...] = parameter((), "Weights.", 0.0, 1.0)


def test_values_are_converted_and_defaults_kept() -> None:
    made = build_parameters(Wanted, {"radius_mm": 20, "point_mm": [1, 2, 3], "weights": [0, 1]}, "mesh")
    assert made == Wanted(radius_mm=20.0, point_mm=(1.0, 2.0, 3.0), weights=(0.0, 1.0))
    assert isinstance(made.radius_mm, float)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"radius": 1.0}, ["does not know", "radius", "radius_mm"]),
        ({"radius_mm": 0.5}, ["radius_mm", "between 1 and 50"]),
        ({"radius_mm": float("nan")}, ["radius_mm"]),
        ({"radius_mm": "wide"}, ["a number", "wide"]),
        ({"radius_mm": True}, ["a number"]),
        ({"steps": 2.5}, ["whole number"]),
        ({"steps": 0}, ["at least 1"]),
        ({"steps": float("inf")}, ["whole number"]),
        ({"steps": True}, ["whole number"]),
        ({"mode": "slow"}, ["one of", "exact"]),
        ({"mode": 3}, ["a text"]),
        ({"smooth": 1}, ["true or false"]),
        ({"point_mm": [1.0, 2.0]}, ["list of 3"]),
        ({"point_mm": 1.0}, ["list of 3"]),
        ({"point_mm": [1.0, 2.0, float("inf")]}, ["finite"]),
        ({"weights": [0.5, 2.0]}, ["weights", "between 0 and 1", "2.0"]),
    ],
)
def test_a_wrong_value_is_one_sentence_that_says_where(values: dict[str, object], words: list[str]) -> None:
    with pytest.raises(BadInput) as caught:
        build_parameters(Wanted, values, "case.toml: mesh")
    sentence = str(caught.value)
    assert sentence.startswith("case.toml: mesh")
    assert all(word in sentence for word in words), sentence


def test_a_parameter_without_default_is_asked_for() -> None:
    @dataclass(frozen=True)
    class Needs:
        path: str

    with pytest.raises(BadInput, match="needs"):
        build_parameters(Needs, {}, "x")


def test_ranges_in_words() -> None:
    assert range_phrase(0.0, 2.5) == "lie between 0 and 2.5"
    assert range_phrase(None, 2.0) == "be at most 2"
