"""Techniques on the public sequences of a pulled liver, frame after frame, each begun from the last answer."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from glisson.core.errors import StageFailed
from glisson.core.protocols import Progress, Registration
from glisson.core.registered import Registered
from glisson.core.registry import make_technique
from glisson.framework.pipeline import Listener
from glisson.studies.registration.pulled_liver import HELD, PULLED, PulledLiver, read_pulled_liver

NEO_HOOKEAN, LINEAR = "neo-hookean-log", "linear-elastic"
_FORCES = {"held": HELD, "pulled": PULLED}
_FEW_LOADS = 10  # for T10, whose full solutions take long, and where it is quick


@dataclass(frozen=True)
class Trial:
    """A technique by name, with a material law and a kind of element, on the first `frames` of a sequence."""

    technique: str
    sequence: str
    law: str = NEO_HOOKEAN
    quadratic: bool = False
    parameters: Mapping[str, Any] = field(default_factory=dict)
    frames: int | None = None

    @property
    def words(self) -> str:
        """The technique, its law and its elements."""
        law = "neo-Hookean" if self.law == NEO_HOOKEAN else "linear"
        return f"{self.technique}, {law}, {'T10' if self.quadratic else 'T4'}"


def trials(quick: bool) -> list[Trial]:
    """What is measured: the technique `forces` on all, and others beside it."""
    if quick:
        return [Trial("forces", "neohookean-s1", parameters=_FORCES | {"loads": _FEW_LOADS}, frames=5)]
    neo = [f"neohookean-s{number}" for number in (1, 2, 3)]
    return [
        *(Trial("forces", sequence, parameters=_FORCES) for sequence in neo),
        Trial("forces", "linear-s1", LINEAR, parameters=_FORCES),
        *(Trial("forces", sequence, LINEAR, parameters=_FORCES) for sequence in neo),
        Trial("tractions", "neohookean-s3"),
        Trial("forces", "neohookean-s3", quadratic=True, parameters=_FORCES | {"loads": _FEW_LOADS}),
    ]


def measured(trial: Trial, folder: Path, listener: Listener) -> dict[str, Any]:
    """The row of one trial: errors of all nodes in mm, of the whole force in percent, and times.

    Raises:
        BadInput: the data is not there.
    """
    liver = read_pulled_liver(folder, trial.sequence, trial.law, trial.quadratic)
    made: Registration = make_technique("registration", trial.technique, trial.parameters, trial.technique)
    words = f"{trial.words} on {trial.sequence}"
    progress = listener.begun(words, "it was asked for")
    started = perf_counter()
    with threadpool_limits(1, user_api="blas"):  # small matrices: threads would wait for each other
        prepared = made.prepare(liver.model, None, progress)
        prepared.register(liver.observations[0])  # compiles what is not compiled yet
        set_up = perf_counter() - started
        found, milliseconds = _followed(prepared.register, liver, trial.frames, progress)
    listener.ended(words, perf_counter() - started)
    return _row(trial, liver, found, milliseconds) | {"set_up_seconds": set_up}


def _followed(
    register: Any, liver: PulledLiver, frames: int | None, progress: Progress
) -> tuple[list[Registered | None], list[float]]:
    """The answer to each frame, None where there is none, and the milliseconds it took."""
    found: list[Registered | None] = []
    milliseconds, last = [], None
    for number, observations in enumerate(liver.observations[:frames]):
        progress(number / len(liver.observations), f"frame {number + 1}")
        started = perf_counter()
        try:
            last = register(observations, last)
            found.append(last)
        except StageFailed:
            last = None
            found.append(None)
        milliseconds.append(1000.0 * (perf_counter() - started))
    return found, milliseconds


def _row(trial: Trial, liver: PulledLiver, found: list[Registered | None], milliseconds: list[float]) -> dict[str, Any]:
    errors, off = [], []
    for frame, answer in enumerate(found):
        if answer is None:
            continue
        errors.append(liver.errors_mm(answer.positions_mm, frame))
        true = liver.true_forces[frame]
        if answer.forces_mn is not None and true.any():
            off.append(float(np.linalg.norm(answer.forces_mn.sum(axis=0) - true) / np.linalg.norm(true)))
    pooled = np.array(errors)
    forces_are_known = off and not trial.sequence.startswith("linear")  # there E is not published
    return {
        "technique": trial.words,
        "set": f"mestdagh {trial.sequence}",
        "bin": None,
        "noise_mm": 0.0,
        "cases": len(found),
        "failed": sum(answer is None for answer in found),
        "flagged": sum(answer is not None and not answer.status.is_good for answer in found),
        "tre_mm": {
            "mean": float(pooled.mean()),
            "median": float(np.median(pooled)),
            "p95": float(np.percentile(pooled, 95)),
        },
        "force_percent": 100.0 * float(np.mean(off)) if forces_are_known else None,
        "milliseconds": {"median": float(np.median(milliseconds)), "p95": float(np.percentile(milliseconds, 95))},
        "tuned_on": trial.sequence in ("neohookean-s1", "neohookean-s2"),
    }
