"""The case: a folder that holds one patient's scan, labels, model, scenario and results.

A case knows where things lie in the folder and whether the folder can be used; what the files hold
is the business of `glisson.io`, what is computed from them that of the stages.
"""

import os
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from glisson.core.errors import BadInput
from glisson.framework.settings import SCHEMA, Settings
from glisson.framework.settings_file import settings_from_table, settings_text
from glisson.io.atomic import atomic_folder

SETTINGS = "case.toml"
SCAN = "images/ct.nii.gz"
ARTEFACTS = "images/artefacts.json"
ARTEFACTS_PICTURE = "images/artefacts.png"
LOST = "images/lost.nii.gz"
ORGAN = "labels/organ.nii.gz"
TUMOURS = "labels/tumours.nii.gz"
STRUCTURES = "labels/structures.nii.gz"
VESSELS = "labels/vessels.nii.gz"
VESSEL_TREES = "labels/vessels.json"
MODEL = "mesh"
SCENARIO = "scenario.toml"
OBSERVATIONS = "observations.json"
TRUTH = "truth"
RESULTS = "results"
GUIDANCE = "results/results.json"
PARTS = "results/parts.nii.gz"
LANDMARKS = "labels/landmarks.mrk.json"
SEGMENTS = "labels/segments.nii.gz"
SEGMENTS_PICTURE = "labels/segments.png"
REPORT = "results/report.html"
PROVENANCE = "results/provenance"
STALE = "results/STALE.txt"


@dataclass(frozen=True)
class Case:
    """A case folder that was checked: it has a scan and a `case.toml` of a schema that is understood."""

    folder: Path

    def path(self, name: str) -> Path:
        """Where the part `name` (a constant of this module, relative to the folder) lies."""
        return self.folder / name

    def has(self, name: str) -> bool:
        """Whether the part `name` exists."""
        return self.path(name).exists()

    def settings(self) -> Settings:
        """What `case.toml` says.

        Raises:
            BadInput: it cannot be read, or holds an unknown key or a value out of range.
        """
        return settings_from_table(_read_toml(self.path(SETTINGS)), str(self.path(SETTINGS)))

    def check_writable(self) -> None:
        """Raise BadInput when nothing can be written into the folder."""
        if not os.access(self.folder, os.W_OK | os.X_OK):
            raise BadInput(f"The case folder {self.folder} is read-only; copy it to a place where you may write.")


def open_case(folder: str | Path) -> Case:
    """A case folder, checked.

    Raises:
        BadInput: there is none, it is not a case, is incomplete, or was written by a newer Glisson.
    """
    path = Path(folder)
    if not path.is_dir():
        raise BadInput(f"There is no case folder at {path}; make one with: glisson new {path} --ct SCAN.")
    if not (path / SETTINGS).is_file():
        raise BadInput(f"{path} is not a case folder, it has no {SETTINGS}; make one with: glisson new CASE --ct SCAN.")
    _check_schema(_read_toml(path / SETTINGS), path)
    if not (path / SCAN).is_file():
        raise BadInput(f"The case {path} is incomplete, its scan {SCAN} is missing; make it again with: glisson new.")
    return Case(path)


@contextmanager
def new_case(folder: str | Path, settings: Settings) -> Iterator[Path]:
    """A temporary folder with `case.toml`, to be filled; it becomes the case folder when the block ends well.

    Raises:
        BadInput: something lies at `folder` already, or nothing can be written there.
    """
    path = Path(folder)
    if path.exists() and (not path.is_dir() or any(path.iterdir())):
        raise BadInput(f"{path} exists already; choose another folder for the new case or remove it first.")
    with atomic_folder(path) as making:
        (making / SETTINGS).write_text(settings_text(settings), encoding="utf-8")
        yield making


def _check_schema(table: dict[str, Any], folder: Path) -> None:
    schema = table.get("schema")
    if not isinstance(schema, int) or isinstance(schema, bool) or schema < 1:
        raise BadInput(f"{folder / SETTINGS} needs a line 'schema = {SCHEMA}'; it is damaged or not of Glisson.")
    if schema > SCHEMA:
        raise BadInput(
            f"The case {folder} has schema {schema} and was written by a newer Glisson; "
            f"this one reads up to {SCHEMA}, update it."
        )


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise BadInput(f"{path} is half-written or damaged ({error}); correct it or restore a copy.") from error
    except OSError as error:
        raise BadInput(f"{path} cannot be read: {error.strerror}.") from error
