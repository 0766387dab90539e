"""The benchmarks' runner with engines that only pretend, and the judges of the real ones against closed forms."""

import json
import os
import sys
import textwrap

import numpy as np
import pytest

import glisson as package
from conftest import ROOT
from glisson.cli.benchmark import _tables as tables
from glisson.core.errors import BadInput
from glisson.core.protocols import silent
from glisson.framework import benchmark
from glisson.framework.benchmark import RESULTS, Benchmark
from glisson.framework.benchmark_plot import PLOT, fitted_exponent
from glisson.framework.benchmark_scripts import benchmarks_folder, run_script
from glisson.framework.pipeline import Unheard

SCRIPTS = {
    "meshes.py": "import sys, pathlib; pathlib.Path(sys.argv[3]).write_text(sys.argv[1])",
    # The judge takes what the engine says of itself for its residual.
    "judge.py": """
        import json, pathlib, sys
        told = [float(pathlib.Path(name).read_text()) for name in sys.argv[3:]]
        found = [{"dofs": 12, "residual": value, "difference": value - min(told)} for value in told]
        pathlib.Path(sys.argv[2]).write_text(json.dumps(found))
    """,
    "engine.py": """
        import json, pathlib, sys
        from constant import ITERATIONS
        residual, mesh, out = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
        out.with_suffix(".npz").write_text(residual)
        values = dict(version="7", seconds=float(pathlib.Path(mesh).read_text()) ** 1.5, iterations=ITERATIONS,
                      memory_mb=100.0)
        out.with_suffix(".json").write_text(json.dumps(values))
    """,
    "broken.py": "raise RuntimeError('no such element')",
    "slow.py": "import time; time.sleep(60)",
    "engines.toml": """
        tolerance = 1e-6
        difference = "to the best"
        mesh_source = []
        [[problems]]
        element = "T4"
        elements = [4, 9, 100]
        quick = 9
        [[engines]]
        name = "exact"
        needs = "{python}"
        command = ["{python}", "{folder}/engine.py", "1e-9"]
        largest = { T4 = 50 }
        time_limit_s = 60
        [[engines]]
        name = "rough"
        needs = "{python}"
        command = ["{python}", "{folder}/engine.py", "1e-3"]
        largest = { T4 = 9 }
        time_limit_s = 60
        [[engines]]
        name = "absent"
        needs = "{root}/.venv-of-nobody/bin/python"
        command = ["{root}/.venv-of-nobody/bin/python"]
        largest = { T4 = 9 }
        time_limit_s = 60
        [[engines]]
        name = "broken"
        needs = "{python}"
        command = ["{python}", "{folder}/broken.py"]
        largest = { T4 = 9 }
        time_limit_s = 60
        [[engines]]
        name = "slow"
        needs = "{python}"
        command = ["{python}", "{folder}/slow.py"]
        largest = { T4 = 4 }
        time_limit_s = 0.2
    """,
}


@pytest.fixture
def pretended(tmp_path, monkeypatch):
    """Scripts of engines that only pretend, in the place of `benchmarks/solver`."""
    checkout = tmp_path / "checkout" / "benchmarks"
    folder = checkout / "solver"
    folder.mkdir(parents=True)
    (checkout / "shared").mkdir()
    (checkout / "shared" / "constant.py").write_text("ITERATIONS = 4")
    for name, text in SCRIPTS.items():
        (folder / name).write_text(textwrap.dedent(text))
    monkeypatch.setattr(benchmark, "benchmarks_folder", lambda name: checkout / name)
    return folder


@pytest.fixture
def scripts(monkeypatch):
    """Imports the real scripts of a benchmark."""

    def of(name):
        for folder in ("shared", name):
            monkeypatch.syspath_prepend(str(ROOT / "benchmarks" / folder))

    before = set(sys.modules)
    yield of
    for name in set(sys.modules) - before:
        if str(ROOT / "benchmarks") in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]


class Heard(Unheard):
    def __init__(self, stop_at="nothing"):
        self.run, self.kept, self._stop_at = [], [], stop_at

    def begun(self, stage, reason):
        if stage.startswith(self._stop_at):
            raise KeyboardInterrupt
        self.run.append(stage)
        return silent

    def skipped(self, stage, reason):
        self.kept.append(stage)


def test_every_engine_has_a_row_and_whoever_gave_no_answer_says_why(pretended, tmp_path):
    rows = Benchmark("solver", tmp_path / "out", quick=False).run()
    assert [(row.engine, row.elements) for row in rows] == [
        *((name, 4) for name in ("exact", "rough", "absent", "broken", "slow")),
        *((name, 9) for name in ("exact", "rough", "absent", "broken")),
    ]
    found = {row.engine: row for row in rows if row.elements == 4}
    exact = found["exact"]
    assert (exact.version, exact.seconds, exact.iterations, exact.memory_mb) == ("7", 8.0, 4, 100.0)
    assert (exact.dofs, exact.residual, exact.difference, exact.reason) == (12, 1e-9, 0.0, None)
    assert all(row.seconds is None for name, row in found.items() if name != "exact")
    assert "residual is 1.0e-03" in found["rough"].reason
    assert "not installed; run make bench" in found["absent"].reason
    assert "RuntimeError: no such element" in found["broken"].reason
    assert found["slow"].reason == "no answer within 0.2 s"
    assert json.loads((tmp_path / "out" / RESULTS).read_text())["rows"][0]["seconds"] == 8.0


def test_an_interrupted_benchmark_goes_on_and_a_finished_one_begins_anew(pretended, tmp_path):
    out = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        Benchmark("solver", out, True, Heard(stop_at="rough")).run()
    assert not (out / RESULTS).exists()
    heard = Heard()
    Benchmark("solver", out, True, heard).run()
    assert heard.kept == ["exact, 9 T4"]
    assert "rough, 9 T4" in heard.run
    assert not any(words.startswith("mesh") for words in heard.run)
    heard = Heard()
    Benchmark("solver", out, True, heard).run()
    assert heard.kept == []


def test_a_changed_engine_is_measured_anew(pretended, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        Benchmark("solver", tmp_path / "out", True, Heard(stop_at="rough")).run()
    (pretended / "engine.py").write_text((pretended / "engine.py").read_text() + "\n# changed\n")
    heard = Heard()
    Benchmark("solver", tmp_path / "out", True, heard).run()
    assert heard.kept == []


def test_an_interruption_ends_the_process_too(tmp_path):
    script = "import os, time; print(os.getpid(), flush=True); time.sleep(60)"
    log = tmp_path / "log"

    def interrupt(fraction, message):
        if log.read_text().endswith("\n"):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_script([sys.executable, "-c", script], log, 60.0, interrupt, "running", {})
    with pytest.raises(ProcessLookupError):
        os.kill(int(log.read_text()), 0)


def test_a_program_that_cannot_be_started_is_a_reason(tmp_path):
    reason = run_script([str(tmp_path / "nothing")], tmp_path / "log", 1.0, silent, "running", {})
    assert "could not be started: No such file" in reason


def test_command_line(pretended, tmp_path, glisson):
    code, values = glisson("benchmark", "solver", "--quick", "--out", tmp_path / "out")
    assert code == 0
    assert [row["engine"] for row in values["rows"]] == ["exact", "rough", "absent", "broken"]
    assert values["rows"][0]["seconds"] == 27.0
    assert (tmp_path / "out" / PLOT).stat().st_size > 10_000
    code, values = glisson("benchmark", "painting")
    assert (code, values["status"]) == (2, "bad_input")


def test_from_a_wheel_there_is_no_benchmark(monkeypatch, tmp_path, glisson):
    monkeypatch.setattr(package, "__file__", str(tmp_path / "lib" / "site" / "glisson" / "a.py"))
    with pytest.raises(BadInput, match="scripts in a checkout"):
        benchmarks_folder("solver")
    code, values = glisson("benchmark", "solver", "--quick", "--out", tmp_path / "out")
    assert (code, values["rows"]) == (2, None)
    assert "clone the repository" in values["message"]
    assert not (tmp_path / "out").exists()


def test_exponent_of_a_power_law():
    sizes = [1e3, 1e4, 3e5]
    assert fitted_exponent(sizes, [0.2 * n**1.15 for n in sizes]) == pytest.approx(1.15)
    assert fitted_exponent([1e3], [1.0]) is None


def _lateral_stretch(stretch, shear, bulk):
    """(lateral stretch, nominal stress) of W = µ/2 (Ī1 − 3) + κ/2 (J − 1)² in uniaxial tension, by bisection."""

    def stresses(lateral):
        volume = stretch * lateral**2
        mean, scaled = (stretch**2 + 2 * lateral**2) / 3, shear * volume ** (-2 / 3)
        pressure = bulk * (volume - 1) * volume
        return (scaled * (stretch**2 - mean) + pressure) / stretch, (scaled * (lateral**2 - mean) + pressure) / lateral

    low, high = 0.5, 1.5
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (middle, high) if stresses(middle)[1] < 0 else (low, middle)
    return low, stresses(low)[0]


@pytest.mark.parametrize("order", [1, 2])
def test_judge_against_uniaxial_stretch_and_weight(scripts, order):
    scripts("solver")
    from adapter import tiny_problem
    from judge import TISSUE
    from law import forces
    from problem import BULK_KPA, SHEAR_KPA, WEIGHT_MN_MM3

    problem = tiny_problem(order)
    stretch = 1.3
    lateral, stress = _lateral_stretch(stretch, SHEAR_KPA, BULK_KPA)
    displacement = problem.nodes * (np.array([stretch, lateral, lateral]) - 1.0)
    found = forces(TISSUE, problem.nodes, problem.tetrahedra, displacement, problem.nodes)
    internal, external = found.internal, found.external
    assert found.least_volume_ratio == pytest.approx(stretch * lateral**2)
    end = problem.nodes[:, 0] == problem.nodes[:, 0].max()
    between = (problem.nodes[:, 0] > 0.0) & ~end
    scale = stress * 20.0**2
    assert internal[end].sum(axis=0) == pytest.approx([scale, 0.0, 0.0], abs=1e-9 * scale)
    np.testing.assert_allclose(internal[between], 0.0, atol=1e-9 * scale)
    assert external.sum(axis=0) == pytest.approx([0.0, 0.0, -WEIGHT_MN_MM3 * 100.0 * 20.0**2])


@pytest.mark.parametrize("order", [1, 2])
def test_glisson_as_an_engine_satisfies_the_judge(scripts, order):
    scripts("solver")
    from adapter import tiny_problem
    from glisson_engine import _read, _solve
    from judge import judge

    problem = tiny_problem(order)
    solution = _solve(problem, _read(problem))
    assert solution.displacement[problem.carried] == pytest.approx(np.tile([0.0, 0.0, 30.0], (len(problem.carried), 1)))
    wrong = solution.displacement + 0.01 * problem.free[:, None]
    good, bad, nothing = judge(problem, [solution.displacement, wrong, np.full_like(wrong, np.nan)])
    assert good["residual"] <= 1e-6
    assert (good["difference"], good["dofs"]) == (0.0, 3 * int(problem.free.sum()))
    assert bad["residual"] > 1e-4
    assert bad["difference"] > 0.0
    assert nothing["residual"] is None


def test_meshes_are_the_same_everywhere(scripts):
    scripts("solver")
    from meshes import LATTICES, ellipsoid_mesh, held_nodes
    from problem import SEMI_AXES_MM

    for elements in (8_057, 19_482):
        mesh = ellipsoid_mesh(*LATTICES[elements])
        assert len(mesh.tetrahedra) == elements
        assert mesh.volume_mm3 == pytest.approx(4.0 / 3.0 * np.pi * np.prod(SEMI_AXES_MM), rel=0.015)
        clamped, carried = held_nodes(mesh)
        assert len(clamped) > 100
        assert len(carried) > 10


@pytest.mark.parametrize(("element", "elements"), [("T4", 2_000), ("T10", 1_000)])
def test_a_lift_satisfies_its_judge_and_a_wrong_one_does_not(scripts, tmp_path, element, elements):
    scripts("lift")
    from glisson_engine import _solve
    from judge import judge
    from meshes import main
    from problem import load_problem

    main(elements, element, tmp_path / "mesh.npz")
    problem = load_problem(tmp_path / "mesh.npz")
    lifted = _solve("quasi-static", element, problem.corner_mesh).displacement
    wrong, inverted = lifted.copy(), lifted.copy()
    wrong[problem.inside[0]] += 1.0
    inverted[problem.inside[0]] += 100.0
    good, bad, none = judge(problem, [lifted, wrong, inverted])
    assert good["residual"] <= 1e-6
    assert good["moved_mm"] > 10.0
    assert (good["difference"], none["residual"]) == (0.0, None)
    assert bad["residual"] > 1e-3


def test_masks_without_a_tolerance_are_told_with_their_dice(pretended, tmp_path):
    text = (pretended / "engines.toml").read_text().replace("tolerance = 1e-6", "")
    (pretended / "engines.toml").write_text(text.replace("T4", "pixels"))
    (pretended / "judge.py").write_text(
        "import json, pathlib, sys\n"
        "pathlib.Path(sys.argv[2]).write_text(json.dumps([{'dice': 0.9, 'difference': 1.5}] * len(sys.argv[3:])))"
    )
    rows = Benchmark("solver", tmp_path / "out", quick=True).run()
    assert [(row.engine, row.dice, row.difference, row.seconds) for row in rows][:2] == [
        ("exact", 0.9, 1.5, 27.0),
        ("rough", 0.9, 1.5, 27.0),
    ]
    assert "Dice" in "\n".join(tables(rows))


def test_engines_find_the_liver_of_a_small_slice(scripts, tmp_path):
    """All but SimpleITK's geodesic contour, which leaks here, come nearer to the liver than the start."""
    scripts("segmentation")
    from glisson_engine import localized
    from judge import judge
    from meshes import main
    from problem import ITERATIONS, load_problem
    from simpleitk_engine import geodesic, threshold
    from skimage_engine import global_chan_vese, morphological_geodesic, morphological_global

    main(128 * 128, "pixels", tmp_path / "slice.npz")
    problem = load_problem(tmp_path / "slice.npz")
    (start, far) = judge(problem, [problem.start, np.zeros_like(problem.truth)])
    assert (far["dice"], far["difference"]) == (0.0, None)
    ours = judge(problem, [localized(problem, "uniform").mask])[0]["dice"]
    assert ours >= 0.95
    for method in (global_chan_vese, morphological_global, morphological_geodesic, threshold):
        found = judge(problem, [method(problem).mask])[0]
        assert found["dice"] > start["dice"], method.__name__
    leaked = geodesic(problem)
    assert (leaked.mask >= problem.start).all()
    assert 0 < leaked.iterations <= ITERATIONS


def test_the_judge_of_masks_against_a_disc(scripts):
    """A disc within a disc: Dice is 2 a / (a + b) of their areas; another part far away does not count."""
    scripts("segmentation")
    from adapter import tiny_problem
    from judge import judge

    problem = tiny_problem(2)
    found = problem.start.copy()
    found[0, 0] = True
    (scores,) = judge(problem, [found])
    inner, outer = problem.start.sum(), problem.truth.sum()
    assert scores["dice"] == pytest.approx(2.0 * inner / (inner + outer))
    assert scores["difference"] == pytest.approx(6.0, abs=0.75)
    assert judge(problem, [problem.truth])[0] == {"dice": 1.0, "difference": 0.0}


def test_trackers_follow_the_video_of_the_benchmark(scripts, tmp_path):
    """Ours stays with every mark that is not covered; OpenCV's flow alone loses those that once were."""
    scripts("tracking")
    from glisson_engine import follow
    from judge import judge
    from meshes import main
    from opencv_engine import decode, flow

    main(60, tmp_path / "video.npz")
    truth = np.load(tmp_path / "video.npz")
    marks, visible = truth["marks"], truth["visible"]
    video = tmp_path / "video.avi"
    ours, theirs = follow(video, marks[0], None), flow(video, marks[0], None)
    assert ours.shape == theirs.shape == (60, 20, 2)
    assert judge(marks, visible, ours) < 0.05
    assert decode(video, marks[0], 5) is None
    shifted = marks + [3.0, 4.0]
    assert judge(marks, visible, shifted) == pytest.approx(5.0)
    assert judge(marks, visible, np.full_like(marks, np.nan)) is None
    assert judge(marks, visible, np.zeros((0, 0, 2))) is None


def test_a_video_is_told_in_frames_per_second():
    rows = [benchmark.Row("Glisson, lucas-kanade", "frames", 150, seconds=1.5, memory_mb=200.0, difference=0.0254)]
    heading, line = list(tables(rows))[1:]
    assert "frames/s" in heading
    assert line.split()[-3:] == ["100", "200", "0.025"]
