"""The conclusion for people: lines for the terminal, and a page with all lifts."""

from collections.abc import Mapping
from typing import Any

from glisson.studies.page import Page, Table, number, page_as_html


def as_lines(values: Mapping[str, Any]) -> list[str]:
    """Counts, and what failed."""
    lines = [f"cases     {values['cases']}"]
    if values["cases"]:
        converged = values["cases"] - len(values["failed"])
        lines.append(
            f"converged {converged} ({100.0 * values['converged']:.1f} %), {values['slipped_off']} of them slipped "
            f"off the lever; {values['inverted']} with inverted elements, {values['penetrated']} with penetration"
        )
    lines += [f"impossible {_words(row)}: {row['message']}" for row in values["impossible"]]
    lines += [f"failed    {_words(row)}: {row['message']}" for row in values["failed"]]
    if values["unfinished"]:
        lines.append(f"note      {values['unfinished']} points are not done yet; run again to go on")
    return lines


def as_page(values: Mapping[str, Any]) -> bytes:
    """The page."""
    columns = [
        "member",
        "angle",
        "E (kPa)",
        "ν",
        "µ",
        "c (kPa)",
        "status",
        "slipped off",
        "iterations",
        "least gap (mm)",
    ]
    rows = [
        [
            str(row["member"]),
            f"{row['angle_deg']:.1f}°",
            f"{row['young_modulus_kpa']:.3g}",
            number(row["poisson_ratio"], 3),
            number(row["friction"]),
            number(row["cohesion_kpa"], 0),
            str(row["status"]),
            "yes" if row["slipped_off"] else "",
            str(row["iterations"]),
            number(row["least_gap_mm"], 4),
        ]
        for row in values["rows"]
    ]
    return page_as_html(
        Page("Robustness of the lever lift", as_lines(values), (), [Table("All lifts.", columns, rows)])
    )


def _words(row: Mapping[str, Any]) -> str:
    return (
        f"member {row['member']}, {row['angle_deg']:.0f}°, E {row['young_modulus_kpa']:.3g} kPa, "
        f"ν {row['poisson_ratio']:.3f}, µ {row['friction']:.2f}, c {row['cohesion_kpa']:g} kPa"
    )
