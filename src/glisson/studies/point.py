"""What a study is made of: points that are computed independently, and what came of each."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Any

from numpy.typing import NDArray

from glisson.core.status import Status
from glisson.framework.hashing import source_hash


@dataclass(frozen=True)
class Task:
    """What is done with a point.

    `function` is "module:name" of a function that takes a point's inputs and the folder of the study's
    points, and gives an `Outcome`; `packages` are those of ours on whose source the outcome rests.
    """

    function: str
    packages: tuple[str, ...]

    @property
    def source(self) -> str:
        """Hash of the source on which the outcome rests."""
        return source_hash(*self.packages)


@dataclass(frozen=True, eq=False)
class Point:
    """One computation of a study: a task with its inputs, plain JSON values.

    An outcome of another point is an input by that point's `key`. `cost` is what the point is expected to
    cost relative to the others; it only serves the forecast of the time.
    """

    task: Task
    inputs: Mapping[str, Any]
    cost: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "inputs", MappingProxyType(json.loads(_canonical(self.inputs))))

    @cached_property
    def key(self) -> str:
        """Hash of task, inputs and source: an outcome that is stored under it holds as long as none changes."""
        text = _canonical({"function": self.task.function, "inputs": dict(self.inputs), "source": self.task.source})
        return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


@dataclass(frozen=True, eq=False)
class Outcome:
    """What came of a point.

    `status` is None where the point failed in a way that has no name. `values` are plain JSON values,
    `arrays` what other points go on with. `seconds` is the time of the computation.
    """

    values: Mapping[str, Any] = field(default_factory=dict)
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    status: Status | None = Status.CONVERGED
    message: str = Status.CONVERGED.sentence
    seconds: float = 0.0

    @property
    def is_good(self) -> bool:
        """Whether its values may be used."""
        return self.status is not None and self.status.is_good


def _canonical(value: Any) -> str:
    plain = dict(value) if isinstance(value, MappingProxyType) else value
    return json.dumps(plain, sort_keys=True, separators=(",", ":"), allow_nan=False)
