"""Named arrays in one file (`.npz`) that says what it is and of which version."""

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glisson.core import BadInput
from glisson.io.atomic import atomic_path
from glisson.io.decoding import decoding

_KIND, _SCHEMA = "glisson kind", "glisson schema"
_MAX_BYTES = 2**31


def write_arrays(path: str | Path, kind: str, schema: int, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write arrays of numbers or text; atomic.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    values: dict[str, Any] = {**arrays, _KIND: np.array(kind), _SCHEMA: np.array(schema)}
    with atomic_path(Path(path)) as temporary, temporary.open("wb") as stream:
        np.savez(stream, **values)


def read_arrays(path: str | Path, kind: str, schema: int) -> dict[str, NDArray[Any]]:
    """Read what `write_arrays` wrote; `kind` has no article ("reduced model").

    Raises:
        BadInput: absent, damaged, of another kind, of a newer Glisson, or huge.
    """
    source = Path(path)
    with decoding(source, f"a {kind}"):
        with zipfile.ZipFile(source) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > _MAX_BYTES:
                raise BadInput("it would unpack to more than 2 GiB.")
        with np.load(source, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        found, version = str(arrays.pop(_KIND, "")), int(arrays.pop(_SCHEMA, 0))
        if found != kind:
            raise BadInput(f"it is no {kind}.")
        if version > schema:
            raise BadInput(f"it was written by a newer Glisson (layout {version}, this one reads up to {schema}).")
        return arrays
