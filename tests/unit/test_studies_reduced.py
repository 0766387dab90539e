"""The benchmark of the reduced model on an egg: what it draws, what it says, and that it goes on where it was."""

import json
from pathlib import Path

import numpy as np
import pytest

from glisson.cli.main import main
from glisson.mechanics.reduced.building import Sizes
from glisson.mechanics.reduced.full import FullModel
from glisson.mechanics.reduced.pressing import Pressing
from glisson.studies.reduced.benchmark import Plan, ReducedBenchmark
from glisson.studies.reduced.egg import egg
from glisson.studies.reduced.liver import HELD, TIP
from glisson.studies.reduced.loads import Draw
from glisson.studies.reduced.report import text_of, values_of

TINY = Plan(8, 20, 4, 5, 1, Sizes(12, 80, 12, 80, 1e-3), Sizes(20, 150, 40, 250, 1e-3), 1e3)


def test_the_egg_is_held_at_its_thick_end() -> None:
    model = egg(0.22)
    nodes, axis = model.mesh.nodes, int(np.ptp(model.mesh.nodes, axis=0).argmax())
    assert np.ptp(nodes, axis=0).max() == pytest.approx(220.0)
    held, tip = nodes[model.node_set(HELD)], nodes[model.node_set(TIP)[0]]
    assert np.abs(held[:, axis] - tip[axis]).min() > 150.0
    widths = [np.ptp(nodes[np.abs(nodes[:, axis] - place[axis]) < 40.0], axis=0).min() for place in (held[0], tip)]
    assert widths[0] > widths[1]


def test_loads_are_those_of_their_seed_and_bars_come_from_outside() -> None:
    model = egg(0.22)
    draw, full = Draw(model), FullModel(model, (HELD,))
    points = full.surface.positions(model.mesh.nodes)
    for number in range(9):
        load, again, other = draw.load(number, 3), draw.load(number, 3), draw.load(number, 4)
        assert np.array_equal(load.weight, again.weight)
        assert np.array_equal(load.forces, again.forces)
        assert not np.array_equal(load.weight, other.weight)
        assert (load.tool is None) == (number % 3 == 0)
        away, there = Pressing.of(load.part(0.0), full.cushion), Pressing.of(load, full.cushion)
        if away is not None and there is not None:
            assert there.gaps(points).min() < -1.0
            assert away.gaps(points).min() > there.gaps(points).min()


def test_the_benchmark_measures_and_goes_on_where_it_was(tmp_path: Path) -> None:
    first = ReducedBenchmark(egg(0.22), TINY, tmp_path, 0).run()
    values = values_of(first)
    assert values["loads"] == 5
    assert values["fallbacks"] <= 0.01  # where the organ jumps, no estimate matters
    assert 0.0 < values["error_mm"]["median"] <= values["error_mm"]["worst"]
    assert values["updates_per_s"] > 1.0
    assert 10.0 <= values["tip_mm"]["median"] <= values["tip_mm"]["worst"] <= 40.0 + 2.0 * values["error_mm"]["worst"]
    json.dumps(values, allow_nan=False)
    assert "times the error in the median" in text_of(values)
    assert min(first.seconds.values()) > 0.0
    second = ReducedBenchmark(egg(0.22), TINY, tmp_path, 0).run()
    assert max(second.seconds.values()) == 0.0
    assert np.array_equal(second.errors_mm, first.errors_mm)


def test_without_the_liver_there_is_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("GLISSON_SHARED_DATA", str(tmp_path))
    assert main(["benchmark", "reduced", "--out", str(tmp_path / "out")]) == 2
    assert "GLISSON_SHARED_DATA" in capsys.readouterr().err
