"""What a stage is, and whether its result in a case still holds."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any, ClassVar

from glisson.core.errors import BadInput
from glisson.core.protocols import Progress
from glisson.framework.case import PROVENANCE, Case
from glisson.framework.hashing import content_hash
from glisson.framework.provenance import Basis, StageRecord, basis_of, read_record
from glisson.framework.settings import Settings


class Stage(ABC):
    """One step from the scan to the report. Paths are relative to the case folder.

    `packages` are those of ours on whose source the result rests. Where a person may make or correct the
    outputs by hand (`editable`), outputs that the stage did not make itself are kept, unless it
    `works_on_given` ones.
    """

    name: ClassVar[str]
    inputs: ClassVar[tuple[str, ...]]
    outputs: ClassVar[tuple[str, ...]]
    packages: ClassVar[tuple[str, ...]]
    editable: ClassVar[bool] = False

    def settings(self, settings: Settings) -> Mapping[str, Any]:
        """What the stage takes from the settings, as plain values."""
        return {}

    def techniques(self, settings: Settings) -> Sequence[tuple[str, str]]:
        """Kind and name of each technique that the stage uses."""
        return ()

    def works_on_given(self, settings: Settings) -> bool:
        """Whether outputs that a person gave are what the stage starts from, to check and clean them."""
        return False

    @abstractmethod
    def run(self, case: Case, settings: Settings, out: Path, progress: Progress) -> Mapping[str, Any]:
        """Read from the case, write the outputs below `out`, and return facts (plain JSON values).

        Raises:
            BadInput: what it reads cannot be used.
            StageFailed: it gave no result.
        """

    @property
    def record_name(self) -> str:
        """Where the stage's record lies."""
        return f"{PROVENANCE}/{self.name}.json"

    def basis(self, case: Case, settings: Settings) -> Basis:
        """What the result would rest on if the stage ran now.

        Raises:
            BadInput: a technique cannot be used.
        """
        return basis_of(
            case.folder,
            self.inputs,
            self.settings(settings),
            self.techniques(settings),
            ("glisson.core", "glisson.geometry", "glisson.io", *self.packages),
        )


class State(Enum):
    """Whether a stage's outputs in the case are good for its inputs."""

    CURRENT = "current"
    GIVEN = "given"
    STALE = "stale"
    MISSING = "missing"


@dataclass(frozen=True)
class StageState:
    """State of a stage, why in a few words, and the facts of the run that made its outputs."""

    state: State
    reason: str
    record: StageRecord | None = None


def stage_state(stage: Stage, case: Case, settings: Settings) -> StageState:
    """Whether a stage must run, judged by its own record and inputs (not by the stages before it)."""
    record = read_record(case.path(stage.record_name))
    made = {name: content_hash(case.path(name)) for name in stage.outputs if case.has(name)}
    if stage.editable and made and (record is None or made != record.outputs):
        return StageState(State.GIVEN, f"{' and '.join(made)} was given or corrected by hand")
    if record is None or set(made) != set(stage.outputs):
        return StageState(State.MISSING, "it has no result yet")
    if made != record.outputs:
        return StageState(State.STALE, "its result was changed by something else")
    try:
        reason = record.basis.difference(stage.basis(case, settings))
    except BadInput:
        reason = "a technique that it uses cannot be used any more"
    if reason is not None:
        return StageState(State.STALE, reason)
    return StageState(State.CURRENT, "nothing changed", record)


def outdated(stages: Sequence[Stage], case: Case, settings: Settings) -> dict[str, str]:
    """Stages whose outputs exist but rest on something that is no longer so: name → why."""
    reasons: dict[str, str] = {}
    maker_of_outdated: dict[str, str] = {}
    for stage in stages:
        found = stage_state(stage, case, settings)
        made_by = next((maker_of_outdated[name] for name in stage.inputs if name in maker_of_outdated), None)
        if found.state is State.GIVEN or (found.state is State.CURRENT and made_by is None):
            continue
        if any(case.has(name) for name in stage.outputs):
            rests = f"it rests on the stage {made_by}, which is out of date"
            reasons[stage.name] = rests if found.state is State.CURRENT else found.reason
        maker_of_outdated |= dict.fromkeys(stage.outputs, stage.name)
    return reasons
