"""A benchmark: one problem on several meshes, every engine in a process of its own, one neutral judge.

What is run stands in `benchmarks/NAME/engines.toml`, beside the scripts. An engine's answer is kept until the benchmark
has come to its end, so that an interrupted one goes on where it was; a finished one is measured anew.
"""

import json
import os
import shutil
import sys
import time
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from hashlib import blake2b
from pathlib import Path
from typing import Any

from glisson.core.errors import StageFailed
from glisson.core.status import Status
from glisson.framework.benchmark_scripts import benchmarks_folder, run_script
from glisson.framework.hashing import content_hash, source_hash
from glisson.framework.lock import exclusive
from glisson.framework.pipeline import Listener, Unheard
from glisson.io.atomic import atomic_path

RESULTS = "benchmark.json"
_RUNS, _MESHES = "runs", "meshes"
_SET_UP_LIMIT_S = 1800.0


@dataclass(frozen=True)
class Engine:
    """A program that solves the problem; `largest` is the most elements it is given, for each kind of element."""

    name: str
    needs: str
    command: tuple[str, ...]
    largest: Mapping[str, int]
    time_limit_s: float


@dataclass(frozen=True)
class Row:
    """One engine on one mesh of (about) `elements`; where it gave no answer `seconds` is None and `reason` says why.

    `memory_mb` is the most that the process had, `memory_before_mb` what it had before the solve. `residual` and
    `difference` are the neutral judge's, which also tells how far a lift has moved the tumour, and the Dice of a mask.
    `element` is what there are so many of: elements of a kind, or pixels or voxels.
    """

    engine: str
    element: str
    elements: int
    version: str | None = None
    dofs: int | None = None
    seconds: float | None = None
    iterations: int | None = None
    memory_mb: float | None = None
    memory_before_mb: float | None = None
    residual: float | None = None
    difference: float | None = None
    moved_mm: float | None = None
    dice: float | None = None
    reason: str | None = None


@dataclass(frozen=True)
class _Plan:
    """The problems as (element, elements), the engines, the residual an answer may have, and more of `engines.toml`.

    Without a `tolerance` every answer counts.
    """

    problems: tuple[tuple[str, int], ...]
    engines: tuple[Engine, ...]
    tolerance: float | None
    difference: str
    mesh_source: tuple[str, ...]


class Benchmark:
    """Measures every engine on every mesh that it can take.

    Args:
        name: its folder in `benchmarks`.
        out: folder of the results; meshes are kept there too.
        quick: only the one problem that is quickly done.

    Raises:
        BadInput: this Glisson has no benchmarks.
    """

    def __init__(self, name: str, out: Path, quick: bool, listener: Listener | None = None) -> None:
        self._folder, self._shared = benchmarks_folder(name), benchmarks_folder("shared")
        self._out, self._listener = out, listener or Unheard()
        self._plan = _read_plan(self._folder, quick)

    @property
    def difference(self) -> str:
        """What the rows' `difference` means."""
        return self._plan.difference

    def run(self) -> list[Row]:
        """All rows, which are also written to `benchmark.json`."""
        self._out.mkdir(parents=True, exist_ok=True)
        with exclusive(self._out):
            rows = [row for element, elements in self._plan.problems for row in self._on_mesh(element, elements)]
            values = {"rows": [asdict(row) for row in rows]}
            with atomic_path(self._out / RESULTS) as path:
                path.write_text(json.dumps(values, indent=1) + "\n", encoding="utf-8")
            shutil.rmtree(self._out / _RUNS, ignore_errors=True)
        return rows

    def _on_mesh(self, element: str, elements: int) -> Iterator[Row]:
        """Rows of all engines on one mesh, judged together."""
        engines = [engine for engine in self._plan.engines if elements <= engine.largest.get(element, 0)]
        mesh = self._mesh(element, elements)
        rows = [self._measured(engine, Row(engine.name, element, elements), mesh) for engine in engines]
        answers = [self._answer(row) for row in rows if row.seconds is not None]
        judged = iter(self._judged(mesh, answers))
        return (row if row.seconds is None else self._accepted(replace(row, **next(judged))) for row in rows)

    def _mesh(self, element: str, elements: int) -> Path:
        path = self._out / _MESHES / f"{elements}-{element}-{self._source(*self._plan.mesh_source)}.npz"
        words = f"mesh of {elements:,} {element}"
        if not path.exists():
            path.parent.mkdir(exist_ok=True)
            script = str(self._folder / "meshes.py")
            reason = self._timed(
                words, "it was not made yet", [sys.executable, script, str(elements), element, str(path)],
                path.with_suffix(".log"), _SET_UP_LIMIT_S,
            )  # fmt: skip
            if reason is not None:
                raise StageFailed(f"The {words} could not be made: {reason}.", Status.STAGNATED)
        return path

    def _measured(self, engine: Engine, row: Row, mesh: Path) -> Row:
        """What an engine's process says of itself."""
        missing = self._filled(engine.needs)
        if shutil.which(missing) is None:
            return replace(row, reason=f"{missing} is not installed; run make bench, or see benchmarks/README.md")
        out = self._answer(row)
        words = f"{engine.name}, {row.elements:,} {row.element}"
        out.parent.mkdir(exist_ok=True)
        if out.with_suffix(".json").exists():
            self._listener.skipped(words, "it was measured before the interruption")
        else:
            command = [*(self._filled(word) for word in engine.command), str(mesh), str(out)]
            reason = self._timed(words, "it is its turn", command, out.with_suffix(".log"), engine.time_limit_s)
            if reason is not None:
                return replace(row, reason=reason)
        return replace(row, **json.loads(out.with_suffix(".json").read_text(encoding="utf-8")))

    def _judged(self, mesh: Path, answers: Sequence[Path]) -> list[dict[str, Any]]:
        """What the neutral judge finds of the engines' displacements."""
        if not answers:
            return []
        out = self._out / _RUNS / "judged.json"
        command = [sys.executable, str(self._folder / "judge.py"), str(mesh), str(out)]
        command += [str(answer.with_suffix(".npz")) for answer in answers]
        reason = self._timed("judge", "the answers are there", command, out.with_suffix(".log"), _SET_UP_LIMIT_S)
        if reason is not None:
            raise StageFailed(f"The answers could not be judged: {reason}.", Status.STAGNATED)
        found: list[dict[str, Any]] = json.loads(out.read_text(encoding="utf-8"))
        return found

    def _accepted(self, row: Row) -> Row:
        """The row without its seconds where the answer is not one."""
        if self._plan.tolerance is None or (row.residual is not None and row.residual <= self._plan.tolerance):
            return row
        found = "not a number" if row.residual is None else f"{row.residual:.1e}"
        reason = f"its answer's residual is {found}, which is more than {self._plan.tolerance:.0e}"
        return replace(row, seconds=None, reason=reason)

    def _timed(self, words: str, why: str, command: Sequence[str], log: Path, limit_s: float) -> str | None:
        progress = self._listener.begun(words, why)
        start = time.monotonic()
        reason = run_script(command, log, limit_s, progress, "running", {"PYTHONPATH": str(self._shared)})
        self._listener.ended(words, time.monotonic() - start)
        return reason

    def _answer(self, row: Row) -> Path:
        """Where an engine's answer on a mesh is, without a suffix; scripts that changed have other answers."""
        key = f"{row.engine} {row.element} {row.elements} {self._source('glisson')}"
        return self._out / _RUNS / blake2b(key.encode(), digest_size=8).hexdigest()

    def _source(self, *packages: str) -> str:
        text = content_hash(self._folder) + content_hash(self._shared) + source_hash(*packages)
        return blake2b(text.encode(), digest_size=4).hexdigest()

    def _filled(self, word: str) -> str:
        places = {"folder": self._folder, "root": self._folder.parent.parent, "python": sys.executable}
        return word.format(**places, cores=os.cpu_count())


def _read_plan(folder: Path, quick: bool) -> _Plan:
    values = tomllib.loads((folder / "engines.toml").read_text(encoding="utf-8"))
    problems = [
        (problem["element"], elements)
        for problem in values["problems"]
        for elements in problem["elements"]
        if not quick or elements == problem.get("quick")
    ]
    engines = [Engine(**(engine | {"command": tuple(engine["command"])})) for engine in values["engines"]]
    return _Plan(
        tuple(problems), tuple(engines), values.get("tolerance"), values["difference"], tuple(values["mesh_source"])
    )
