"""Where a result came from: what a stage read, its settings, the code and versions that made it, how long it took.

The record is what decides whether a stage must run again: it is current as long as its inputs, settings,
techniques and Glisson's own source are the same as they were, and its outputs are still those it made.
"""

import json
import platform
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from glisson.core.registry import technique_class, technique_package
from glisson.framework.hashing import content_hash, package_version, source_hash

KEY_PACKAGES = (
    "glisson", "numpy", "scipy", "numba", "scikit-image", "nibabel", "pydicom", "mmgpy", "mkl",
)  # fmt: skip
"""Packages whose versions are recorded because they can change a number."""


@dataclass(frozen=True)
class Basis:
    """What a stage's result depends on: content hashes by path, settings, techniques with their code, our code."""

    inputs: Mapping[str, str]
    settings: Mapping[str, Any]
    techniques: Mapping[str, Mapping[str, str | None]]
    source: str

    def difference(self, other: "Basis") -> str | None:
        """What differs, in a few words for people; None when nothing does."""
        changed = sorted(
            name for name in set(self.inputs) | set(other.inputs) if self.inputs.get(name) != other.inputs.get(name)
        )
        if changed:
            return f"{' and '.join(changed)} changed"
        for part, words in (
            ("settings", "its settings changed"),
            ("techniques", "the technique's code or version changed"),
            ("source", "Glisson itself changed"),
        ):
            if getattr(self, part) != getattr(other, part):
                return words
        return None


@dataclass(frozen=True)
class StageRecord:
    """One run of a stage that ended well. `facts` are the stage's own numbers, plain JSON values."""

    stage: str
    basis: Basis
    outputs: Mapping[str, str]
    facts: Mapping[str, Any]
    seconds: float
    seed: int
    finished: str
    versions: Mapping[str, str | None]

    def summary(self) -> dict[str, Any]:
        """What a report shows of it: techniques, settings, hashes, code, versions, time."""
        shown = asdict(self.basis) | {"outputs": dict(self.outputs), "versions": dict(self.versions)}
        return shown | {"seed": self.seed, "seconds": self.seconds, "finished": self.finished}

    def text(self) -> str:
        """The record as JSON."""
        return json.dumps(asdict(self), indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def record_of(
    stage: str, basis: Basis, outputs: Mapping[str, str], facts: Mapping[str, Any], seconds: float, seed: int
) -> StageRecord:
    """A record of a run that ended now, with the versions in use."""
    versions = {"python": platform.python_version(), **{name: package_version(name) for name in KEY_PACKAGES}}
    finished = datetime.now(UTC).isoformat(timespec="seconds")
    return StageRecord(stage, basis, outputs, facts, round(seconds, 3), seed, finished, versions)


def read_record(path: Path) -> StageRecord | None:
    """A record that was written before; None where there is none or it cannot be understood.

    A damaged record is as good as none: the stage then runs again.
    """
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
        values["basis"] = Basis(**values["basis"])
        return StageRecord(**{field.name: values[field.name] for field in fields(StageRecord)})
    except (OSError, ValueError, TypeError, KeyError):
        return None


def basis_of(
    folder: Path,
    inputs: Sequence[str],
    settings: Mapping[str, Any],
    techniques: Sequence[tuple[str, str]],
    packages: Sequence[str],
) -> Basis:
    """What a stage would rest on if it ran now; inputs that are absent in `folder` are left out.

    Args:
        folder: the case folder.
        inputs: files and folders that are read, relative to it.
        settings: what the stage takes from the settings, plain values.
        techniques: kind and name of each technique that is used.
        packages: our packages on whose source the stage rests, by import name.

    Raises:
        BadInput: a technique cannot be used.
    """
    hashes = {name: content_hash(folder / name) for name in inputs if (folder / name).exists()}
    used = {f"{kind} {name}": _technique(kind, name) for kind, name in techniques}
    # The detour through JSON makes tuples lists, as they are when a record is read back.
    return Basis(hashes, json.loads(json.dumps(settings)), used, source_hash(*packages))


def _technique(kind: str, name: str) -> dict[str, str | None]:
    made = technique_class(kind, name)
    package = technique_package(kind, name)
    # A plug-in may spread over its package; ours is one module, so that a change to one leaves others current.
    source = made.__module__ if package == "glisson" else made.__module__.partition(".")[0]
    return {"package": package, "version": package_version(package), "source": source_hash(source)}
