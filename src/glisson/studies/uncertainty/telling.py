"""The conclusion for people: sentences, calibration curve and predicted against actual error, and a table."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.stats import chi2

from glisson.navigation.figures.colours import BLACK, BLUE, ORANGE
from glisson.navigation.figures.picture import Picture, new_figure, picture
from glisson.studies.page import Page, Table, number, page_as_html
from glisson.studies.uncertainty.scores import LEVELS, Row

_COLOURS = {"packed": BLUE, "closed-form": ORANGE}


def as_lines(values: Mapping[str, Any]) -> list[str]:
    """What holds, how well the error is predicted, and what a touch is worth."""
    lines = [f"cases     {values['cases']} of {values['livers']} livers, {values['flagged']} flagged"]
    lines += [
        f"coverage  {level} % regions hold {_share(values[f'coverage{level}'])} of the targets" for level in LEVELS
    ]
    if values["predicted_mm"] is not None:
        lines.append(
            f"error     predicted {values['predicted_mm']:.2f} mm, actual {values['actual_mm']:.2f} mm; apart by "
            f"{values['difference_mm']:.2f} mm in the mean, r = {number(values['correlation'])}"
        )
    lines.append(
        f"inflation {values['inflation']:g}; {number(values['tuning']['inflation'])} would do on the "
        f"{values['tuning']['cases']} cases of {values['tuning']['livers']} tuning livers"
    )
    lines += [
        f"touch     {told['cases']} cases of which {words} is seen: the tumour is off by {told['before_mm']:.2f} mm, "
        f"after the proposed touch by {told['proposed_mm']:.2f} mm, after any other by {told['random_mm']:.2f} mm: "
        f"a gain of {told['gain_percent']:.1f} %, p = {'–' if told['p'] is None else format(told['p'], '.2g')}"
        for told, words in ((values["touch"], "little"), (values["touch_denser"], "more"))
        if told["cases"]
    ]
    lines += [f"failed    {message}" for message in values["failed"]]
    if values["unfinished"]:
        lines.append(f"note      {values['unfinished']} livers are not done yet; run again to go on")
    return lines


def draw_calibration(rows: Sequence[Row]) -> Picture:
    """How many targets regions of each level hold, and the predicted error of each case against the actual one."""
    figure = new_figure(1000, 470)
    left, right = figure.subplots(1, 2)
    levels = np.linspace(0.01, 0.99, 99)
    for origin, colour in _COLOURS.items():
        own = [row for row in rows if row["origin"] == origin and row["squares"]]
        if not own:
            continue
        squares = np.sort(np.concatenate([row["squares"] for row in own]))
        held = np.searchsorted(squares, chi2.ppf(levels, 3)) / len(squares)
        left.plot(100.0 * levels, 100.0 * held, color=colour, linewidth=2.0, label=f"{origin}, {len(own)} cases")
        predicted, actual = ([row[name] for row in own] for name in ("predicted_mm", "actual_mm"))
        right.scatter(predicted, actual, s=9, color=colour, alpha=0.55, linewidths=0.0, label=origin)
    left.plot([0, 100], [0, 100], color=BLACK, linewidth=0.8, linestyle="--")
    left.set(xlabel="level of the region (%)", ylabel="targets within (%)", xlim=(0, 100), ylim=(0, 100))
    largest = max([1.0, *(row[name] for row in rows if row["squares"] for name in ("predicted_mm", "actual_mm"))])
    right.plot([0, largest], [0, largest], color=BLACK, linewidth=0.8, linestyle="--")
    right.set(xlabel="predicted mean error (mm)", ylabel="actual mean error (mm)", xlim=(0, None), ylim=(0, None))
    for axes in (left, right):
        axes.grid(alpha=0.3)
        axes.legend(frameon=False, fontsize=11)
    figure.subplots_adjust(left=0.07, right=0.985, bottom=0.13, top=0.97, wspace=0.2)
    return picture(
        figure,
        "Calibration curve of the targets' regions, and predicted against actual error of each case.",
        "Left: share of the targets within regions of each level. Right: a dot for each case; on the dashed line the "
        "error is as predicted.",
    )


def as_page(values: Mapping[str, Any], shown: Picture) -> bytes:
    """The page."""
    columns = [
        "",
        "cases",
        *(f"{level} % regions hold" for level in LEVELS),
        "predicted (mm)",
        "actual (mm)",
        "apart",
        "r",
    ]
    named = {"all": values, **values["parts"], "tuning livers": values["tuning"]}
    cells = [[name, *_cells(part)] for name, part in named.items()]
    table = Table("Targets within their regions, with the interval of a bootstrap over livers.", columns, cells)
    return page_as_html(Page("Uncertainty of registration", as_lines(values), (shown,), [table]))


def _cells(part: Mapping[str, Any]) -> list[str]:
    figures = (number(part[name]) for name in ("predicted_mm", "actual_mm", "difference_mm", "correlation"))
    return [str(part["cases"]), *(_share(part[f"coverage{level}"]) for level in LEVELS), *figures]


def _share(found: Mapping[str, float] | None) -> str:
    if found is None:
        return "–"
    return f"{100.0 * found['share']:.1f} % ({100.0 * found['low']:.1f} to {100.0 * found['high']:.1f})"
