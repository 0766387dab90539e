"""Command-line options made from the parameter dataclasses of techniques, and what they change in the settings."""

import argparse
from collections.abc import Sequence
from dataclasses import asdict, fields, replace
from math import isfinite
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from glisson.core.errors import BadInput
from glisson.core.parameters import build_parameters, range_phrase
from glisson.core.registry import list_techniques, technique_class
from glisson.framework.settings import KINDS, SECTIONS, SegmentSettings, Settings


def add_case(parser: argparse.ArgumentParser) -> None:
    """The case folder."""
    parser.add_argument("case", metavar="CASE", help="the case folder")


def add_seed(parser: argparse.ArgumentParser) -> None:
    """The seed of random numbers."""
    parser.add_argument("--seed", metavar="N", help="seed of random numbers, a whole number")


def add_seed_points(parser: argparse.ArgumentParser) -> None:
    """Clicks inside the organ."""
    parser.add_argument(
        "--seed-point", metavar="X,Y,Z", action="append", help="a click inside the liver in LPS mm; may be repeated"
    )


def add_technique_options(parser: argparse.ArgumentParser, sections: Sequence[str]) -> None:
    """For each section of the settings `--SECTION.technique` and the parameters of all techniques it may take.

    A parameter that several techniques have appears once.
    """
    listings = [made for made in list_techniques([KINDS[section] for section in sections]) if made.is_available]
    for section in sections:
        named = [listing.name for listing in listings if listing.kind == KINDS[section]]
        group = parser.add_argument_group(f"{section} (kept in case.toml)")
        group.add_argument(f"--{section}.technique", metavar="NAME", help=f"one of {', '.join(named)}")
        explained: dict[str, dict[str, list[str]]] = {}
        for name in named:
            for field in fields(technique_class(KINDS[section], name).Parameters):
                explained.setdefault(field.name, {}).setdefault(_explanation(field), []).append(name)
        for parameter, meanings in explained.items():
            flag = f"--{section}.{parameter.replace('_', '-')}"
            sentences = [f"{words} ({', '.join(techniques)})" for words, techniques in meanings.items()]
            group.add_argument(flag, dest=f"{section}.{parameter}", metavar="VALUE", help="; ".join(sentences))


def add_section_options(parser: argparse.ArgumentParser, sections: Sequence[str]) -> None:
    """For each section of the settings that is ours the values that one word can give."""
    for section in sections:
        group = parser.add_argument_group(f"{section} (kept in case.toml)")
        hints = get_type_hints(SECTIONS[section])
        for field in fields(SECTIONS[section]):
            if hints[field.name] in (float, int, str, bool):
                flag = f"--{section}.{field.name.replace('_', '-')}"
                group.add_argument(flag, dest=f"{section}.{field.name}", metavar="VALUE", help=_explanation(field))


def changed_settings(settings: Settings, arguments: argparse.Namespace) -> Settings:
    """The settings with what the command line says put in.

    Raises:
        BadInput: an option does not fit the technique, or its value is unusable.
    """
    given = {name: value for name, value in vars(arguments).items() if value is not None}
    for section in KINDS:
        technique = given.get(f"{section}.technique")
        texts = {
            name.partition(".")[2]: value
            for name, value in given.items()
            if name.startswith(f"{section}.") and name != f"{section}.technique"
        }
        if technique is not None or texts:
            name = technique or settings.choices[section].technique
            settings = settings.choosing(section, technique, _parameters(section, name, texts))
    for section, kind in SECTIONS.items():
        texts = {n.partition(".")[2]: v for n, v in given.items() if n.startswith(f"{section}.")}
        if section not in KINDS and texts:
            made = build_parameters(kind, asdict(getattr(settings, section)) | _plain(kind, texts), f"--{section}")
            settings = replace(settings, **{section: made})
    if "seed" in given:
        settings = replace(settings, seed=_seed(given["seed"]))
    if "seed_point" in given:
        points = tuple(point_from_text(text) for text in given["seed_point"])
        settings = replace(settings, segment=SegmentSettings(seed_points_mm=points))
    for name in ("portal", "hepatic"):
        if name in given:
            clicks = {f"{name}_mm": tuple(point_from_text(text) for text in given[name])}
            settings = replace(settings, vessels=replace(settings.vessels, **clicks))
    return settings


def point_from_text(text: str) -> tuple[float, float, float]:
    """A point from "X,Y,Z".

    Raises:
        BadInput: these are not three finite numbers.
    """
    try:
        x, y, z = (float(number) for number in text.split(","))
    except ValueError:
        raise BadInput(f"A point is written X,Y,Z in LPS mm, for example -30,12.5,140, not {text!r}.") from None
    if not all(map(isfinite, (x, y, z))):
        raise BadInput(f"A point needs three finite numbers, not {text!r}.")
    return x, y, z


def positive_from_text(text: str, option: str) -> float:
    """A positive number.

    Raises:
        BadInput: it is none.
    """
    try:
        number = float(text)
    except ValueError:
        number = -1.0
    if not (isfinite(number) and number > 0.0):
        raise BadInput(f"{option} must be a positive number, not {text!r}.")
    return number


def pixel_from_text(text: str) -> tuple[float, float]:
    """A place in an image from "U,V".

    Raises:
        BadInput: these are not two finite numbers.
    """
    try:
        u, v = (float(number) for number in text.split(","))
    except ValueError:
        raise BadInput(f"A place in an image is written U,V in px, for example 312,200.5, not {text!r}.") from None
    if not (isfinite(u) and isfinite(v)):
        raise BadInput(f"A place in an image needs two finite numbers, not {text!r}.")
    return u, v


def _plain(kind: type[Any], texts: dict[str, str]) -> dict[str, Any]:
    hints = get_type_hints(kind)
    return {name: _from_text(hints.get(name, str), text) for name, text in texts.items()}


def _parameters(section: str, technique: str, texts: dict[str, str]) -> dict[str, Any]:
    kind = technique_class(KINDS[section], technique).Parameters
    made = build_parameters(kind, _plain(kind, texts), f"--{section} ({technique})")
    return {name: getattr(made, name) for name in texts}


def _from_text(hint: Any, text: str) -> Any:
    """What a text stands for where the text itself is not enough: true, false, and lists."""
    kinds = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
    plain = next(kind for kind in kinds if kind is not type(None))
    if plain is bool:
        return {"true": True, "false": False}.get(text.lower(), text)
    return text.split(",") if get_origin(plain) is tuple else text


def _seed(text: str) -> int:
    if not text.isdecimal():
        raise BadInput(f"--seed must be a whole number of at least 0, not {text!r}.")
    return int(text)


def _explanation(field: Any) -> str:
    about = field.metadata
    low, high = about.get("minimum"), about.get("maximum")
    limits = f", must {range_phrase(low, high)}" if low is not None or high is not None else ""
    choices = f", one of {', '.join(about['choices'])}" if about.get("choices") else ""
    sentence = str(about.get("help", field.name)).rstrip(".")
    # argparse formats its help with "%".
    return f"{sentence}{limits}{choices}, default {field.default}".replace("%", "%%")
