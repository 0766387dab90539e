"""Where outcomes are kept: a file for each point, named by its key, written whole or not at all."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from glisson.core.errors import BadInput
from glisson.core.status import Status
from glisson.framework.hashing import package_version
from glisson.framework.interruptions import interruptions_held
from glisson.framework.lock import Claim, try_claim
from glisson.framework.provenance import KEY_PACKAGES
from glisson.io.atomic import atomic_paths
from glisson.studies.point import Outcome, Point


@dataclass(frozen=True)
class PointStore:
    """The points of a study in a folder: `KEY.json`, and `KEY.npz` where a point has arrays.

    A file that cannot be understood is as good as none. Several processes may work in one folder.
    """

    folder: Path

    def prepare(self) -> None:
        """Make the folder.

        Raises:
            BadInput: nothing can be written there.
        """
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise self._refusal(error) from error

    def outcome(self, point: Point) -> Outcome | None:
        """What came of a point, without its arrays; None where it has not been done."""
        path = self._path(point)
        try:
            stored = json.loads(path.read_text(encoding="utf-8"))
            status = None if stored["status"] is None else Status(stored["status"])
            found = Outcome(dict(stored["values"]), {}, status, str(stored["message"]), float(stored["seconds"]))
            has_arrays = bool(stored["arrays"])
        except (OSError, ValueError, TypeError, KeyError):
            return None
        return None if has_arrays and not path.with_suffix(".npz").is_file() else found

    def keep(self, point: Point, outcome: Outcome) -> None:
        """Write what came of a point.

        Raises:
            WriteFailed: the disk is full or failing.
        """
        record = {
            "task": asdict(point.task) | {"source": point.task.source},
            "inputs": dict(point.inputs),
            "status": outcome.status,
            "message": outcome.message,
            "values": dict(outcome.values),
            "arrays": sorted(outcome.arrays),
            "seconds": outcome.seconds,
            "finished": datetime.now(UTC).isoformat(timespec="seconds"),
            "versions": {name: package_version(name) for name in KEY_PACKAGES},
        }
        text = json.dumps(record, indent=1, allow_nan=False, ensure_ascii=False) + "\n"
        path = self._path(point)
        places = [path.with_suffix(".npz"), path] if outcome.arrays else [path]
        # An interruption while NumPy packs arrays would come out as an error of its own.
        with interruptions_held(), atomic_paths(*places) as made:
            made[-1].write_text(text, encoding="utf-8")
            if outcome.arrays:
                with made[0].open("wb") as stream:
                    np.savez_compressed(stream, **dict(outcome.arrays))  # type: ignore[arg-type]  # numpy's own keywords

    def claim(self, point: Point) -> Claim | None:
        """The right to compute a point, until it is released; None where another process has it.

        Raises:
            BadInput: the folder cannot be written to.
        """
        try:
            return try_claim(self.folder / f".{point.key}.lock")
        except OSError as error:
            raise self._refusal(error) from error

    def _refusal(self, error: OSError) -> BadInput:
        return BadInput(f"{self.folder} cannot be written ({error.strerror}); name another folder with --out.")

    def _path(self, point: Point) -> Path:
        return self.folder / f"{point.key}.json"


def read_arrays(folder: Path, key: str) -> Mapping[str, NDArray[Any]]:
    """Arrays of the point of that key.

    Raises:
        OSError: the file is missing or damaged.
    """
    path = folder / f"{key}.npz"
    try:
        with np.load(path, allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}
    except (ValueError, BadZipFile) as error:
        raise OSError(f"{path} is damaged; remove it and its .json file, and run again") from error
