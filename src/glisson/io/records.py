"""Typed reading of TOML and JSON tables; every complaint names its key path ("stages[1].friction")."""

import json
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from glisson.core import BadInput
from glisson.core.arrays import FloatArray, IntArray
from glisson.io.atomic import atomic_path
from glisson.io.decoding import check_file_size, decoding

_REQUIRED: Any = object()


class Record:
    """One table. Each getter checks the type; `finish` refuses the keys that nobody asked for."""

    def __init__(self, values: object, path: str = "") -> None:
        if not isinstance(values, Mapping):
            raise BadInput(f"{path or 'its content'} must be a table, not {_short(values)}.")
        self._values: Mapping[str, Any] = values
        self._path = path
        self._asked: set[str] = set()

    def where(self, key: str) -> str:
        """Key path of an entry."""
        return f"{self._path}.{key}" if self._path else key

    def has(self, key: str) -> bool:
        """Whether the key is there and not null."""
        self._asked.add(key)
        return self._values.get(key) is not None

    def value(self, key: str) -> Any:
        """Whatever is there."""
        return self._get(key, _REQUIRED)

    def text(self, key: str, default: str = _REQUIRED) -> str:
        """A text."""
        value = self._get(key, default)
        if not isinstance(value, str):
            raise self._wrong(key, "a text", value)
        return value

    def flag(self, key: str, default: bool = _REQUIRED) -> bool:
        """True or false."""
        value = self._get(key, default)
        if not isinstance(value, bool):
            raise self._wrong(key, "true or false", value)
        return value

    def number(self, key: str, default: float = _REQUIRED) -> float:
        """A finite number."""
        value = self._get(key, default)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not np.isfinite(value):
            raise self._wrong(key, "a finite number", value)
        return float(value)

    def number_or_nan(self, key: str) -> float:
        """A number; null is how files write one that is not finite."""
        return self.number(key) if self.has(key) else float("nan")

    def number_or_none(self, key: str) -> float | None:
        """A number, or None where it is null or absent."""
        return self.number(key) if self.has(key) else None

    def whole(self, key: str, default: int = _REQUIRED) -> int:
        """A whole number."""
        value = self._get(key, default)
        if isinstance(value, bool) or not isinstance(value, int):
            raise self._wrong(key, "a whole number", value)
        return value

    def texts(self, key: str, default: Sequence[str] = _REQUIRED) -> tuple[str, ...]:
        """A list of texts."""
        value = self._get(key, default)
        if not isinstance(value, (list, tuple)) or not all(isinstance(entry, str) for entry in value):
            raise self._wrong(key, "a list of texts", value)
        return tuple(value)

    def floats(self, key: str, *shape: int) -> FloatArray:
        """Numbers of the given shape; −1 stands for any length."""
        values: FloatArray = self._array(key, shape, "iuf").astype(np.float64)
        return values

    def vector_or_nan(self, key: str) -> tuple[float, float, float]:
        """Three numbers; null is how files write one that is not finite."""
        value = self._get(key, _REQUIRED)
        entries = value if isinstance(value, list) else []
        if len(entries) != 3 or not all(entry is None or isinstance(entry, (int, float)) for entry in entries):
            raise self._wrong(key, "three numbers", value)
        first, second, third = (float("nan") if entry is None else float(entry) for entry in entries)
        return first, second, third

    def wholes(self, key: str, *shape: int) -> IntArray:
        """Whole numbers of the given shape; −1 stands for any length."""
        values: IntArray = self._array(key, shape, "iu").astype(np.int64)
        return values

    def record(self, key: str) -> "Record":
        """A table within this one."""
        return Record(self._get(key, _REQUIRED), self.where(key))

    def records(self, key: str, default: Sequence[object] = _REQUIRED) -> list["Record"]:
        """A list of tables."""
        value = self._get(key, default)
        if not isinstance(value, (list, tuple)):
            raise self._wrong(key, "a list of tables", value)
        return [Record(entry, f"{self.where(key)}[{number}]") for number, entry in enumerate(value)]

    def named_records(self, key: str) -> dict[str, "Record"]:
        """A table whose entries are tables."""
        inner = self.record(key)
        return {name: Record(value, inner.where(name)) for name, value in inner._values.items()}

    def keys(self) -> tuple[str, ...]:
        """All keys, counted as asked for."""
        self._asked.update(self._values)
        return tuple(self._values)

    def check_schema(self, newest: int) -> None:
        """Refuse a file without `schema`, or of a newer Glisson.

        Raises:
            BadInput: the schema is absent, unknown or above `newest`.
        """
        schema = self.whole("schema")
        if schema > newest:
            raise BadInput(
                f"it was made by a newer Glisson (schema {schema}, this one reads up to {newest}); update Glisson."
            )
        if schema < 1:
            raise BadInput(f"schema must be 1 or more, not {schema}.")

    def finish(self) -> None:
        """Refuse keys that were not asked for.

        Raises:
            BadInput: there is an unknown key.
        """
        unknown = [self.where(key) for key in self._values if key not in self._asked]
        if unknown:
            known = ", ".join(sorted(self._asked))
            raise BadInput(f"unknown key {unknown[0]!r}; known here are {known}.")

    @contextmanager
    def building(self) -> Iterator[None]:
        """Put this table's path before a complaint of a core type that is made from it, then `finish`."""
        self_path = self._path
        try:
            yield
        except BadInput as error:
            sentence = str(error)
            prefixed = not self_path or sentence.startswith(self_path)
            raise BadInput(sentence if prefixed else f"{self_path}: {sentence}") from error
        self.finish()

    def _get(self, key: str, default: Any) -> Any:
        self._asked.add(key)
        value = self._values.get(key, default)
        if value is _REQUIRED:
            raise BadInput(f"{self.where(key)} is missing.")
        return value

    def _array(self, key: str, shape: tuple[int, ...], kinds: str) -> Any:
        value = self._get(key, _REQUIRED)
        wanted = " × ".join("n" if n < 0 else str(n) for n in shape)
        what = f"{'whole numbers' if 'f' not in kinds else 'numbers'} of shape {wanted}"
        try:
            array = np.array(value)
        except ValueError:
            raise self._wrong(key, what, value) from None
        if array.size == 0 and -1 in shape and isinstance(value, list):
            return np.zeros([max(n, 0) for n in shape])
        fits = array.ndim == len(shape) and all(n in (-1, have) for n, have in zip(shape, array.shape, strict=True))
        if not fits or array.dtype.kind not in kinds or not np.isfinite(array).all():
            raise self._wrong(key, what, value)
        return array

    def _wrong(self, key: str, wanted: str, value: object) -> BadInput:
        return BadInput(f"{self.where(key)} must be {wanted}, not {_short(value)}.")


@contextmanager
def read_record(path: Path, kind: str, newest_schema: int) -> Iterator[Record]:
    """The top table of a `.toml` or `.json` file; complaints inside the block get the path, then `finish`.

    Raises:
        BadInput: absent, damaged, of a newer Glisson, or anything refused inside the block.
    """
    with decoding(path, kind):
        check_file_size(path)
        toml = path.suffix == ".toml"
        values = tomllib.loads(path.read_bytes().decode("utf-8")) if toml else load_json(path)
        record = Record(values)
        record.check_schema(newest_schema)
        yield record
        record.finish()


def load_json(path: Path) -> Any:
    """Content of a JSON file. Run inside `decoding`."""
    return json.loads(path.read_bytes().decode("utf-8"))


def write_json(path: Path, values: Mapping[str, Any]) -> None:
    """Write a JSON file; atomic. Numbers keep all their digits.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    with atomic_path(path) as temporary:
        temporary.write_text(json_text(values), encoding="utf-8")


def write_toml(path: str | Path, table: Mapping[str, Any]) -> None:
    """Write a TOML file; atomic. Numbers keep all their digits.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    with atomic_path(path) as temporary:
        temporary.write_text(tomli_w.dumps(table), encoding="utf-8")


def json_text(values: Mapping[str, Any]) -> str:
    """JSON of plain values and arrays; numbers that are not finite become null."""
    return json.dumps(_plain(values), ensure_ascii=False, allow_nan=False) + "\n"


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "…"
