"""The twin's scores for people: the table that the challenge prints, in lines and on a page."""

from collections.abc import Mapping, Sequence
from typing import Any

from glisson.navigation.figures.picture import Picture
from glisson.studies.page import Page, Table, number, page_as_html
from glisson.studies.registration.rows import BIN_NAMES, SETS

_PARTS = (*BIN_NAMES, "noise 0 mm", "noise 2 mm", "outliers", *SETS, "all")


def as_lines(values: Mapping[str, Any]) -> list[str]:
    """A line for each technique: mean ± standard deviation over all targets, by what is seen."""
    lines = [
        f"cases     {values['cases']}; target error in mm, mean ± sd over the targets of all cases, by the share of "
        "the surface that is seen (%)",
        f"{'':22}" + "".join(f"{name:>13}" for name in _PARTS),
    ]
    for row in values["totals"]:
        lines.append(f"{row['technique']:22}" + "".join(f"{_cell(row['parts'][name]):>13}" for name in _PARTS))
    for row in values["totals"]:
        if row["milliseconds"] is not None:
            lines.append(
                f"time      {row['technique']}: median {row['milliseconds']['median']:.0f} ms, 95th "
                f"{row['milliseconds']['p95']:.0f} ms; {row['flagged']} of {row['cases']} with a status other than "
                "converged"
            )
    if (begun := values["starts"]) is not None:
        apart = begun["apart_mm"]
        lines.append(
            f"starts    {begun['cases']} cases from three starts up to 30 mm and 30° off each: answers at most "
            f"{apart['median']:.3g} mm apart in the median, {apart['worst']:.3g} mm in the worst case"
        )
    if values["redrawn"]:
        lines.append(f"redrawn   {values['redrawn']} packings under which the truth found no equilibrium")
    lines += [f"failed    {message}" for message in values["failed"]]
    if values["unfinished"]:
        lines.append(f"note      {values['unfinished']} points are not done yet; run again to go on")
    return lines


def as_page(values: Mapping[str, Any], shown: Sequence[Picture]) -> bytes:
    """The page."""
    cells = [
        [
            row["technique"],
            *(_cell(row["parts"][name]) for name in _PARTS),
            number((row["tre_mm"] or {}).get("p95")),
            number((row["milliseconds"] or {}).get("median"), 0),
        ]
        for row in values["totals"]
    ]
    errors = Table(
        "Target error (mm), mean ± standard deviation over all targets of all cases.",
        ["technique", *_PARTS, "95th", "median time (ms)"],
        cells,
    )
    lead = [
        f"{values['cases']} cases of livers of which 20 to 44 % of the surface is seen. They are a twin of the "
        "Sparse Data Challenge's, not its data: nothing here says how a technique would do there.",
        *(line for line in as_lines(values) if line.startswith(("starts", "redrawn", "failed", "note"))),
    ]
    return page_as_html(Page("Registration from sparse surface data", lead, shown, [errors]))


def _cell(spread: Mapping[str, float] | None) -> str:
    return "–" if spread is None else f"{spread['mean']:.2f} ± {spread['sd']:.2f}"
