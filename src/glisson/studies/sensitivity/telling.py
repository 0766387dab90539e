"""The conclusion for people: lines for the terminal, and a page with charts and tables."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from glisson.navigation.figures.picture import Picture
from glisson.studies.page import Page, Table, number, page_as_html
from glisson.studies.sensitivity.rows import MILLIMETRES_PER_PIXEL, Row

_COLUMNS = {
    "truth": "truth",
    "truth_young_modulus_kpa": "its E (kPa)",
    "elements": "elements",
    "model": "law",
    "young_modulus_kpa": "E (kPa)",
    "poisson_ratio": "ν",
    "friction": "µ",
    "cohesion_kpa": "c (kPa)",
}


def as_text(values: Mapping[str, Any]) -> str:
    """Truths, effects, and what failed."""
    lines = [f"truth     {sentence}" for sentence in _truth_sentences(values["truths"])]
    lines += [f"error     {sentence}" for sentence in _effect_sentences(values["effects"])]
    lines += [f"failed    {sentence}" for sentence in _failures(values["rows"])]
    if values["unfinished"]:
        lines.append(f"note      {_unfinished(values)}")
    return "\n".join(lines)


def as_page(values: Mapping[str, Any], charts: Sequence[Picture]) -> bytes:
    """The page."""
    lead = [
        f"{values['cases']} models of one liver, lifted by a lever. The error is the distance between the tumour's "
        "centroid as simulated and as in the truth, after the manoeuvre."
    ]
    lead += _truth_sentences(values["truths"])
    if values["unfinished"]:
        lead.append(_unfinished(values))
    shown = [
        [
            _truth_name(e),
            _parameter(e),
            _level(e["level"]),
            number(e["own_mm"]),
            number(e["matched_mm"]),
            str(e["matched"]),
        ]
        for e in values["effects"]
    ]
    columns = ["truth", "parameter", "level", "own (mm)", "matched (mm)", "models matched"]
    effects = Table(
        "What each parameter does. Own: median over the meshes, all other parameters those of the truth (the charts' "
        "bars). Matched: median over all models that are there with every level of the parameter.",
        columns,
        shown,
    )
    rows = [
        [*(_level(row[name]) for name in _COLUMNS), number(row["tumour_mm"]), *_pixels(row), str(row["status"])]
        for row in values["rows"]
    ]
    models = Table("All models.", [*_COLUMNS.values(), "error (mm)", "error (px)", "status"], rows)
    return page_as_html(Page("Sensitivity of the tumour's place", lead, charts, [effects, models]))


def _truth_sentences(truths: Iterable[Mapping[str, Any]]) -> list[str]:
    found = []
    for truth in truths:
        name = f"{truth['truth']}, {truth['young_modulus_kpa']:g} kPa"
        if truth["uncorrected_mm"] is None:
            found.append(f"{name}: no truth ({truth['message']})")
        else:
            found.append(
                f"{name}: the tumour moves {truth['uncorrected_mm']:.1f} mm, the error without any correction; "
                f"{truth['rigid_mm']:.1f} mm remain after the best rigid motion."
            )
    return found


def _effect_sentences(effects: Iterable[Mapping[str, Any]]) -> list[str]:
    """For each truth and parameter the errors of its levels, all other parameters being the truth's."""
    found: dict[str, list[str]] = {}
    for effect in effects:
        if effect["own_mm"] is not None:
            pixels = effect["own_mm"] / MILLIMETRES_PER_PIXEL
            words = f"{_level(effect['level'])}: {effect['own_mm']:.2f} mm ({pixels:.1f} px)"
            found.setdefault(f"{_truth_name(effect)}: {_parameter(effect)}", []).append(words)
    return [f"{name} {', '.join(levels)}" for name, levels in found.items()]


def _level(level: Any) -> str:
    return level if isinstance(level, str) else f"{level:g}"


def _truth_name(row: Mapping[str, Any]) -> str:
    return f"{row['truth']}, {row['truth_young_modulus_kpa']:g} kPa"


def _parameter(effect: Mapping[str, Any]) -> str:
    name: str = effect["parameter"]
    return name.removesuffix("_kpa").replace("_", " ")


def _pixels(row: Row) -> list[str]:
    error = row["tumour_mm"]
    return [number(None if error is None else error / MILLIMETRES_PER_PIXEL, 1)]


def _failures(rows: Iterable[Row]) -> list[str]:
    return sorted({row["message"] for row in rows if row["status"] != "converged"})


def _unfinished(values: Mapping[str, Any]) -> str:
    return f"{values['unfinished']} points are not done yet; run again to go on."
