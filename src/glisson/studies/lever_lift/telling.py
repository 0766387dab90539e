"""What the lifts tell, for people: lines for the terminal, and a page with a table of all cases."""

from collections.abc import Mapping
from typing import Any

from glisson.studies.page import Page, Table, number, page_as_html

_WORDS = {
    "tumour_mm": ("tumour", "mm"),
    "plane_deg": ("plane by the rule", "°"),
    "removed_points": ("removed part", "percentage points"),
    "surface_mm": ("whole surface", "mm"),
    "rigid_mm": ("tumour after the best rigid motion", "mm"),
    "uncorrected_mm": ("tumour without correction", "mm"),
}


def as_lines(values: Mapping[str, Any]) -> list[str]:
    """How many, and how far off."""
    share = "–" if values["converged"] is None else f"{100.0 * values['converged']:.0f} %"
    lines = [f"cases     {values['cases']}, {values['calculix']} of them CalculiX's truths; {share} converged"]
    for name, (words, unit) in _WORDS.items():
        spread = values[name]
        if spread is not None:
            lines.append(
                f"error     {words}: median {spread['median']:.2f}, 95th {spread['p95']:.2f}, worst "
                f"{spread['worst']:.2f} {unit}"
            )
    if values["coverage90"] is not None:
        lines.append(
            f"sure      the region of 90 % holds the tumour in {100.0 * values['coverage90']:.0f} % of the cases"
        )
    lines += [f"failed    {message}" for message in values["failed"]]
    if values["unfinished"]:
        lines.append(f"note      {values['unfinished']} cases are not done yet; run again to go on")
    return lines


def as_page(values: Mapping[str, Any]) -> bytes:
    """The page."""
    names = ("tumour_mm", "plane_deg", "removed_points", "surface_p95_mm", "radius90_mm", "rigid_mm", "uncorrected_mm")
    rows = [
        [
            str(row["member"]),
            row["truth"],
            number(row["angle_deg"], 1),
            number(row["angle_off_deg"], 1),
            *(number(row[name]) for name in names),
            "; ".join(row["notes"]) or row["message"],
        ]
        for row in values["rows"]
    ]
    columns = [
        "liver", "truth", "lever (°)", "plan off by (°)", "tumour (mm)", "plane (°)", "removed (points)",
        "surface, 95th (mm)", "90 % radius (mm)", "rigid (mm)", "uncorrected (mm)", "found",
    ]  # fmt: skip
    table = Table("All cases.", columns, rows)
    return page_as_html(Page("Lever lifts, registered by the adjusted manoeuvre", as_lines(values), (), [table]))
