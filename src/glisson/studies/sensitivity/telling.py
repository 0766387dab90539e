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
    for effect in _known(values["effects"]):
        lines.append(
            f"error     {_truth_name(effect)}: {_parameter(effect)} {effect['level']}: {effect['median_mm']:.2f} mm "
            f"({effect['median_mm'] / MILLIMETRES_PER_PIXEL:.1f} px), median of {effect['rows']}"
        )
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
        [_truth_name(e), _parameter(e), str(e["level"]), number(e["median_mm"]), str(e["rows"])]
        for e in _known(values["effects"])
    ]
    columns = ["truth", "parameter", "level", "median error (mm)", "models"]
    effects = Table("What each parameter does: over all models that have it, whatever the others.", columns, shown)
    rows = [
        [*(str(row[name]) for name in _COLUMNS), number(row["tumour_mm"]), *_pixels(row), str(row["status"])]
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


def _known(effects: Iterable[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    return [effect for effect in effects if effect["median_mm"] is not None]


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
