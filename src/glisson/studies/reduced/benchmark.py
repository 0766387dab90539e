"""`glisson benchmark reduced`: builds the model, calibrates its bound, and follows loads that it has never seen.

Full solutions and the model are kept in the folder of results, so that an interrupted run goes on where it was.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from hashlib import blake2b
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.model import Model
from glisson.core.protocols import Progress
from glisson.framework.hashing import source_hash
from glisson.framework.lock import exclusive
from glisson.framework.pipeline import Listener, Unheard
from glisson.io.array_files import read_arrays, write_arrays
from glisson.mechanics.reduced.building import Sizes, build_reduced
from glisson.mechanics.reduced.full import FullModel
from glisson.mechanics.reduced.live import LiveModel
from glisson.mechanics.reduced.load import Load
from glisson.mechanics.reduced.model import ReducedModel
from glisson.mechanics.reduced.packing import KIND, SCHEMA, pack, unpack
from glisson.mechanics.reduced.training import from_reduced, from_rest
from glisson.studies.reduced.following import Followed, follow, joined
from glisson.studies.reduced.liver import HELD, TIP
from glisson.studies.reduced.loads import Draw

_SOLUTIONS, _SOLUTIONS_SCHEMA = "set of full solutions", 1
_BATCH = 50
_LOADS_SOURCES = (
    *(f"glisson.mechanics.{name}" for name in ("materials", "elasticity", "elements", "contact_law", "cylinder")),
    *(f"glisson.mechanics.reduced.{name}" for name in ("full", "load", "minimise", "pressing")),
    *(f"glisson.studies.reduced.{name}" for name in ("liver", "loads")),
)
_MODEL_SOURCES = (
    *_LOADS_SOURCES,
    *(
        f"glisson.mechanics.reduced.{name}"
        for name in ("basis", "building", "contact", "cubature", "estimate", "local")
    ),
    *(f"glisson.mechanics.reduced.{name}" for name in ("model", "packing", "points", "potential", "training")),
)
_TRAINING_SEED, _CALIBRATION_SEED = 1_000_003, 1_000_033  # apart from those of reported loads
_TIP_MM = (10.0, 40.0)
_MOST_DRAWS = 4  # for each load whose tip moves as far as wanted


@dataclass(frozen=True)
class Plan:
    """How many loads serve for what, the sizes of models, and the estimate in mm above which the full model answers.

    `pulls` come on from rest, `training` ones from a first reduced model, `checked` ones both ways.
    """

    pulls: int
    training: int
    calibration: int
    loads: int
    checked: int
    first: Sizes
    sizes: Sizes
    largest_mm: float


@dataclass(frozen=True, eq=False)
class Result:
    """What was measured; `seconds` of every stage are 0 where it was kept."""

    followed: Followed
    errors_mm: FloatArray
    tip_mm: FloatArray
    touching: NDArray[np.bool_]
    reduced: ReducedModel
    elements: int
    apart_mm: FloatArray
    full_seconds: FloatArray
    seconds: dict[str, float]


class ReducedBenchmark:
    """Measures the reduced model of an organ.

    Args:
        model: the organ, as `liver_model` makes it.
        plan: how much.
        out: folder of what is kept.
        seed: of the unseen loads.
    """

    def __init__(self, model: Model, plan: Plan, out: Path, seed: int, listener: Listener | None = None) -> None:
        self._full, self._draw, self._plan = FullModel(model, (HELD,)), Draw(model), plan
        self._out, self._seed, self._listener = out, seed, listener or Unheard()
        self._tip = int(model.node_set(TIP)[0])
        self._seconds: dict[str, float] = {}
        self._nodes = model.mesh.nodes.tobytes()

    def run(self) -> Result:
        """Everything that is not kept from an earlier run."""
        self._out.mkdir(parents=True, exist_ok=True)
        # Small matrices: more threads wait for each other for longer than they work.
        with exclusive(self._out), threadpool_limits(1, user_api="blas"):
            reduced = self._reduced()
            calibration, errors, _ = self._judged(reduced, _CALIBRATION_SEED, self._plan.calibration, "calibration")
            reduced = replace(reduced, estimate=reduced.estimate.calibrated(calibration.raw_mm, errors))
            followed, errors, loads = self._judged(reduced, self._seed, self._plan.loads, "unseen loads")
            moved = np.linalg.norm(followed.positions[:, self._tip] - self._full.rest[self._tip], axis=1)
            touching = np.array([load.tool is not None for load in loads])
            apart, seconds = self._from_rest(loads, followed.positions)
            return Result(
                followed,
                errors,
                moved,
                touching,
                reduced,
                len(self._full.model.mesh.tetrahedra),
                apart,
                seconds,
                self._seconds,
            )

    def _reduced(self) -> ReducedModel:
        full, plan = self._full, self._plan

        reach = self._draw.reach

        def pull(progress: Progress) -> dict[str, NDArray[Any]]:
            loads = [self._draw.load(3 * number, _TRAINING_SEED) for number in range(plan.pulls)]
            return {"displacements": from_rest(full, loads, progress)}

        def train(progress: Progress) -> dict[str, NDArray[Any]]:
            loads = [self._draw.load(number, _TRAINING_SEED + 1) for number in range(plan.training)]
            progress(None, "a first reduced model")
            first = build_reduced(full, pulled, reach, plan.first)
            return {"displacements": from_reduced(full, first, loads, progress)[1]}

        def build(progress: Progress) -> dict[str, NDArray[Any]]:
            progress(None, "choosing modes and elements")
            return pack(build_reduced(full, np.concatenate([pulled, trained]), reach, plan.sizes))

        by = f"{source_hash(*_LOADS_SOURCES)} {plan.pulls}"
        pulled = self._kept("pulls", by, _SOLUTIONS, _SOLUTIONS_SCHEMA, pull)["displacements"]
        by += f" {plan.training}"
        trained = self._kept("training", by, _SOLUTIONS, _SOLUTIONS_SCHEMA, train)["displacements"]
        by = f"{source_hash(*_MODEL_SOURCES)} {plan.pulls} {plan.training} {plan.sizes}"
        return unpack(self._kept("model", by, KIND, SCHEMA, build))

    def _judged(
        self, reduced: ReducedModel, seed: int, count: int, words: str
    ) -> tuple[Followed, FloatArray, list[Load]]:
        """Answers to so many loads, their largest errors (k,) in mm, and the loads."""
        live = LiveModel(reduced, self._full, self._plan.largest_mm)
        parts: list[Followed] = []
        errors: list[FloatArray] = []
        loads: list[Load] = []
        size = min(count, _BATCH)
        for first in range(0, _MOST_DRAWS * count, size):
            drawn = [self._draw.load(number, seed) for number in range(first, first + size)]
            followed = follow(live, drawn)
            truths = self._truths(f"{words} {first}-{first + size - 1} of seed {seed}", drawn, followed)
            moved = np.linalg.norm(truths[:, self._tip] - self._full.rest[self._tip], axis=1)
            chosen = (moved >= _TIP_MM[0]) & (moved <= _TIP_MM[1])
            parts.append(followed.part(chosen))
            errors.append(np.linalg.norm(parts[-1].positions - truths[chosen], axis=2).max(axis=1))
            loads += [load for load, wanted in zip(drawn, chosen, strict=True) if wanted]
            if len(loads) >= count:
                break
        wanted = np.arange(len(loads)) < count
        return joined(parts).part(wanted), np.concatenate(errors)[wanted], loads[:count]

    def _truths(self, words: str, loads: Sequence[Load], followed: Followed) -> FloatArray:
        """Full solutions (k, n, 3) next to live answers; NaN where there is none."""

        def make(progress: Progress) -> dict[str, NDArray[Any]]:
            found = np.full(followed.positions.shape, np.nan)
            for number, (load, start) in enumerate(zip(loads, followed.positions, strict=True)):
                progress(number / len(loads), f"load {number + 1} of {len(loads)}")
                try:
                    found[number] = self._full.solve(load, start)
                except StageFailed:
                    continue
            return {"positions": found}

        return self._kept(words, source_hash(*_LOADS_SOURCES), _SOLUTIONS, _SOLUTIONS_SCHEMA, make)["positions"]

    def _from_rest(self, loads: Sequence[Load], positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        """How far (mm) full solutions on the way from rest are from live answers, and the seconds that they take."""
        apart, seconds = [], []
        for load, live in zip(loads[: self._plan.checked], positions, strict=False):
            start = time.perf_counter()
            found = self._full.path(load)[-1]
            seconds.append(time.perf_counter() - start)
            apart.append(float(np.linalg.norm(found - live, axis=1).max()))
        return np.array(apart), np.array(seconds)

    def _kept(
        self, words: str, made_by: str, kind: str, schema: int, make: Callable[[Progress], dict[str, NDArray[Any]]]
    ) -> dict[str, NDArray[Any]]:
        """What an earlier run has made by the same means, or what is made now."""
        key = blake2b(made_by.encode() + self._nodes, digest_size=6).hexdigest()
        path = self._out / f"{words.replace(' ', '-')}-{key}.npz"
        if path.exists():
            self._seconds[words] = 0.0
            return read_arrays(path, kind, schema)
        progress = self._listener.begun(words, "it is not there yet")
        start = time.monotonic()
        made = make(progress)
        write_arrays(path, kind, schema, made)
        self._seconds[words] = time.monotonic() - start
        self._listener.ended(words, self._seconds[words])
        return made
