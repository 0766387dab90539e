"""`glisson benchmark`: measures Glisson beside others; the scripts are in a checkout's `benchmarks/`."""

import argparse
import os
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from itertools import groupby
from pathlib import Path

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.progress import StageLines
from glisson.cli.study import study_answer, whole_number
from glisson.core.errors import BadInput
from glisson.framework.benchmark import RESULTS, Benchmark, Row
from glisson.framework.benchmark_plot import PLOT, draw_cost
from glisson.io.records import write_json
from glisson.studies.local_pool import LocalPool
from glisson.studies.reduced.benchmark import ReducedBenchmark
from glisson.studies.reduced.plans import plan_and_model
from glisson.studies.reduced.report import text_of, values_of
from glisson.studies.registration.sequences import measured, trials
from glisson.studies.registration.sequences_text import sequence_lines
from glisson.studies.registration.study import SparseDataTwin

_OURS = "Glisson"
_REDUCED, _REGISTRATION = "reduced", "registration"
_SHARED_DATA = "GLISSON_SHARED_DATA"
_PULLED_LIVER = Path("open") / "mestdagh-liver-sequences"
_FRAMES = "frames"
_VIDEO_HEADING = "  engine                       seconds  ratio frames/s     MB  px off"
_MASK_HEADING = "  engine                       seconds  ratio  its     MB    Dice  difference"
_HEADING = "  engine                  seconds  ratio  its     MB  residual difference  moved (mm)"


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "benchmark",
        choices=("solver", "lift", "segmentation", "tracking", _REDUCED, _REGISTRATION),
        help="solver: the same hyperelastic problem on the same meshes by Glisson and by other engines; "
        "lift: the two-stage lever lift with friction; segmentation: the liver of a phantom by contours; "
        "tracking: 20 markers through a video of 960 × 540; reduced: the reduced model of a liver under loads that it "
        "has never seen, against full solutions; registration: the study "
        "sparse-data",
    )
    parser.add_argument("--quick", action="store_true", help="one small problem instead of all; some minutes")
    parser.add_argument("--seed", metavar="N", help="seed of the cases (reduced, registration; default 0)")
    parser.add_argument(
        "--sequences",
        metavar="DIR",
        nargs="?",
        const="",
        help="registration: on the public sequences of a pulled liver instead (by default in the shared data)",
    )
    parser.add_argument("--out", metavar="DIR", help="where results go (default: studies/benchmark-NAME)")


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    out = Path(arguments.out or f"studies/benchmark-{arguments.benchmark}")
    if arguments.seed is not None and arguments.benchmark not in (_REDUCED, _REGISTRATION):
        raise BadInput(f"The benchmark {arguments.benchmark} draws no cases, so it has no --seed.")
    seed = whole_number(arguments.seed, "--seed", 0) or 0
    if arguments.benchmark == _REDUCED:
        return _reduced(out, arguments.quick, seed, lines)
    if arguments.sequences is not None:
        if arguments.benchmark != _REGISTRATION or arguments.seed is not None:
            raise BadInput("--sequences belongs to the benchmark registration, and draws nothing that needs a --seed.")
        return _sequences(out, arguments.sequences, arguments.quick, lines)
    if arguments.benchmark == _REGISTRATION:
        return study_answer(SparseDataTwin.of(arguments.quick, seed), out, LocalPool(), lines, arguments.quick)
    benchmark = Benchmark(arguments.benchmark, out, arguments.quick, lines)
    rows = benchmark.run()
    draw_cost(rows, out / PLOT)
    text = [*_tables(rows), f"difference: {benchmark.difference}", f"results   {out / RESULTS} and {out / PLOT}"]
    return Answer({"rows": [asdict(row) for row in rows]}, "\n".join(text))


def _reduced(out: Path, quick: bool, seed: int, lines: StageLines) -> Answer:
    plan, model = plan_and_model(quick, Path(os.environ.get(_SHARED_DATA, "../shared/data")))
    values = values_of(ReducedBenchmark(model, plan, out, seed, lines).run())
    write_json(out / RESULTS, values)
    return Answer(values, text_of(values) + f"\nresults   {out / RESULTS}")


def _sequences(out: Path, folder: str, quick: bool, lines: StageLines) -> Answer:
    place = Path(folder) if folder else Path(os.environ.get(_SHARED_DATA, "../shared/data")) / _PULLED_LIVER
    rows = [measured(trial, place, lines) for trial in trials(quick)]
    out.mkdir(parents=True, exist_ok=True)
    write_json(out / RESULTS, {"rows": rows})
    return Answer({"rows": rows}, "\n".join([*sequence_lines(rows), f"results   {out / RESULTS}"]))


def _tables(rows: Sequence[Row]) -> Iterator[str]:
    """A table for each mesh, fastest first; ratios are to the fastest engine that is not Glisson."""
    for (element, elements), group in groupby(rows, lambda row: (row.element, row.elements)):
        measured = sorted(group, key=lambda row: (row.seconds is None, row.seconds or 0.0))
        peers = [row.seconds for row in measured if row.seconds is not None and not row.engine.startswith(_OURS)]
        yield f"{elements:,} {element}"
        yield _heading(measured)
        yield from (f"  {_line(row, peers[0] if peers else None)}" for row in measured)


def _heading(rows: Sequence[Row]) -> str:
    if rows[0].element == _FRAMES:
        return _VIDEO_HEADING
    return _HEADING if all(row.dice is None for row in rows) else _MASK_HEADING


def _line(row: Row, fastest: float | None) -> str:
    if row.seconds is None:
        return f"{row.engine:22s} {'–':>8s}  {row.reason}"
    ratio = "–" if fastest is None else f"{row.seconds / fastest:.2f}"
    memory, residual, difference = row.memory_mb or 0.0, row.residual or 0.0, row.difference or 0.0
    if row.element == _FRAMES:
        off = "–" if row.difference is None else f"{row.difference:.3f}"
        return (
            f"{row.engine:27s} {row.seconds:8.2f} {ratio:>6s} {row.elements / row.seconds:8.0f} {memory:6.0f} {off:>7s}"
        )
    if row.dice is not None:
        return (
            f"{row.engine:27s} {row.seconds:8.2f} {ratio:>6s} {row.iterations or '–':>4} {memory:6.0f} "
            f"{row.dice:7.4f} {difference:11.2f}"
        )
    moved = "" if row.moved_mm is None else f"{row.moved_mm:11.2f}"
    return (
        f"{row.engine:22s} {row.seconds:8.2f} {ratio:>6s} {row.iterations or '–':>4} {memory:6.0f} "
        f"{residual:9.1e} {difference:10.1e} {moved}"
    ).rstrip()


COMMAND = Command(
    "benchmark",
    "  glisson benchmark solver --quick\n  glisson benchmark lift --json > lift.json",
    _add_arguments,
    _run,
    ("rows", "updates_per_s", "error_mm", "bound_violations", "effectivity", "fallbacks", "loads"),
)
