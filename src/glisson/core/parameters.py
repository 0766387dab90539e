"""Parameters of techniques: frozen dataclasses from which TOML tables, CLI options and help are made."""

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, Field, field, fields
from math import isfinite
from types import UnionType
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

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


def parameters_by_kind(
    kinds: Mapping[str, type[P]], tables: Sequence[Mapping[str, Any]], default: str, where: str
) -> tuple[P, ...]:
    """Parameter dataclasses from tables whose `kind` says which class each is, `default` where it is not said.

    Raises:
        BadInput: an unknown kind, or as `build_parameters`.
    """
    made = []
    for table in tables:
        kind = table.get("kind", default)
        if kind not in kinds:
            raise BadInput(f"{where}: kind must be one of {sorted(kinds)}, not {kind!r}.")
        made.append(build_parameters(kinds[kind], {k: v for k, v in table.items() if k != "kind"}, where))
    return tuple(made)


def _checked(item: "Field[Any]", hint: Any, value: Any, where: str) -> Any:
    kinds = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
    if value is None and type(None) in kinds:
        return None
    plain = next(k for k in kinds if k is not type(None))
    try:
        converted = _converted(plain, value)
    except (TypeError, ValueError, OverflowError):
        raise BadInput(f"{where}: {item.name} must be {_kind_name(plain)}, not {value!r}.") from None
    low, high = item.metadata.get("minimum"), item.metadata.get("maximum")
    for number in converted if isinstance(converted, tuple) else (converted,):
        if isinstance(number, (int, float)) and not isinstance(number, bool) and _is_outside(number, low, high):
            raise BadInput(f"{where}: {item.name} must {range_phrase(low, high)}, not {number}.")
    choices = item.metadata.get("choices", ())
    if choices and converted not in choices:
        raise BadInput(f"{where}: {item.name} must be one of {list(choices)}, not {converted!r}.")
    return converted


def range_phrase(minimum: float | None, maximum: float | None) -> str:
    """The allowed range in words, to follow "must": "lie between 0 and 1", "be at least 0", "be finite"."""
    if minimum is not None and maximum is not None:
        return f"lie between {minimum:g} and {maximum:g}"
    if minimum is not None:
        return f"be at least {minimum:g}"
    return "be finite" if maximum is None else f"be at most {maximum:g}"


def _is_outside(number: float, low: float | None, high: float | None) -> bool:
    return not isfinite(number) or (low is not None and number < low) or (high is not None and number > high)


def _converted(kind: Any, value: Any) -> Any:
    if get_origin(kind) is tuple:
        inner, *rest = get_args(kind)
        if isinstance(value, str) or (rest != [Ellipsis] and len(value) != 1 + len(rest)):
            raise TypeError
        return tuple(_converted(inner, entry) for entry in value)
    if kind is bool:
        if not isinstance(value, bool):
            raise TypeError
        return value
    if isinstance(value, bool) or (kind is int and int(value) != float(value)):
        raise TypeError
    if kind is str and not isinstance(value, str):
        raise TypeError
    return kind(value)


def _kind_name(kind: Any) -> str:
    if get_origin(kind) is tuple:
        inner, *rest = get_args(kind)
        length = "" if rest == [Ellipsis] else f" of {1 + len(rest)} entries"
        return f"a list{length}, each {_kind_name(inner)}"
    return {int: "a whole number", float: "a number", bool: "true or false", str: "a text"}.get(kind, str(kind))
