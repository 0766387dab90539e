"""Parameters of techniques: frozen dataclasses from which TOML tables, CLI options and help are made."""

from collections.abc import Mapping
from dataclasses import MISSING, Field, field, fields
from types import UnionType
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from glisson.core.errors import BadInput

P = TypeVar("P")


def parameter(
    default: Any,
    help: str,  # the field's own word: argparse and click call it the same
    minimum: float | None = None,
    maximum: float | None = None,
    choices: tuple[str, ...] = (),
) -> Any:
    """A dataclass field with what people need to know: a sentence, a range or the choices."""
    metadata = {"help": help, "minimum": minimum, "maximum": maximum, "choices": choices}
    return field(default=default, metadata=metadata)


def build_parameters(kind: type[P], values: Mapping[str, Any], where: str) -> P:
    """Make a parameter dataclass from a mapping (a TOML table, CLI options), checking every entry.

    Raises:
        BadInput: an unknown name, a wrong type or a value outside its range; the sentence says `where`.
    """
    known = {item.name: item for item in fields(kind)}  # type: ignore[arg-type]  # any dataclass
    unknown = set(values) - set(known)
    if unknown:
        raise BadInput(f"{where} does not know {sorted(unknown)}; it has {sorted(known)}.")
    hints = get_type_hints(kind)
    made = {name: _checked(known[name], hints[name], value, where) for name, value in values.items()}
    missing = [n for n, f in known.items() if n not in made and f.default is MISSING and f.default_factory is MISSING]
    if missing:
        raise BadInput(f"{where} needs {missing}.")
    return kind(**made)


def _checked(item: "Field[Any]", hint: Any, value: Any, where: str) -> Any:
    kinds = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
    if value is None and type(None) in kinds:
        return None
    plain = next(k for k in kinds if k is not type(None))
    try:
        converted = _converted(plain, value)
    except (TypeError, ValueError):
        raise BadInput(f"{where}: {item.name} must be {_kind_name(plain)}, not {value!r}.") from None
    low, high = item.metadata.get("minimum"), item.metadata.get("maximum")
    if isinstance(converted, (int, float)) and not isinstance(converted, bool):
        outside = (low is not None and converted < low) or (high is not None and converted > high)
        if outside or not np.isfinite(converted):
            raise BadInput(f"{where}: {item.name} must lie between {low} and {high}, not {converted}.")
    choices = item.metadata.get("choices", ())
    if choices and converted not in choices:
        raise BadInput(f"{where}: {item.name} must be one of {list(choices)}, not {converted!r}.")
    return converted


def _converted(kind: Any, value: Any) -> Any:
    if get_origin(kind) is tuple:
        inner = get_args(kind)[0]
        if isinstance(value, str):
            raise TypeError
        return tuple(_converted(inner, entry) for entry in value)
    if kind is bool:
        if not isinstance(value, bool):
            raise TypeError
        return value
    if kind is int and (isinstance(value, bool) or int(value) != float(value)):
        raise TypeError
    if kind is str and not isinstance(value, str):
        raise TypeError
    return kind(value)


def _kind_name(kind: Any) -> str:
    if get_origin(kind) is tuple:
        return "a list"
    return {int: "a whole number", float: "a number", bool: "true or false", str: "a text"}.get(kind, str(kind))
