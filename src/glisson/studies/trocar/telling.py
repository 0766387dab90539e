"""The conclusion for people: sentences, a chart of the tip's error, and tables."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from glisson.navigation.figures.colours import BLACK, BLUE, GREEN, ORANGE
from glisson.navigation.figures.picture import Picture, new_figure, picture
from glisson.studies.page import Page, Table, number, page_as_html

PRINTED_MM, PRINTED_DEG = 1.0, 2.0
"""What the dissertation states of its trocar (section 5.2)."""

_TOOL_TIP_MM = 300.0 * np.deg2rad(PRINTED_DEG)
_COLOURS = {"2": ORANGE, "3": BLUE, "5 or more": GREEN}


def as_lines(values: Mapping[str, Any]) -> list[str]:
    """All views, then by the number of crosses that are whole in them, then the database of guesses."""
    lines = [
        f"views     {values['views']}, {values['rendered']} of them rendered; {values['silent_wrong']} silently wrong",
        f"flagged   {_percent(values['flagged'])} of the views of the recommended layout with three or more crosses",
    ]
    lines += [
        f"{words:9} {_spread(values[name], digits, unit)}{printed}"
        for words, name, digits, unit, printed in (
            ("position", "position_mm", 2, " mm", f"; dissertation {PRINTED_MM:g} mm"),
            ("angle", "angle_deg", 3, "°", f"; dissertation {PRINTED_DEG:g}°"),
            ("tip", "tip_mm", 2, " mm", f" at 300 mm; by the dissertation's angle {_TOOL_TIP_MM:.1f} mm"),
        )
        if values[name] is not None
    ]
    lines.append(f"coverage  {_percent(values['coverage90'])} of the positions in 90 % ellipsoids, recommended layout")
    for source, spread in values["milliseconds"].items():
        if spread is not None:
            lines.append(f"time      from {source}: median {spread['median']:.2f} ms, 95 % {spread['p95']:.2f} ms")
    lines += [_group(group) for group in values["groups"] if group["views"]]
    database = values["database"]
    if database["position_mm"] is not None:
        lines.append(
            f"database  {database['views']} rendered views: position {_spread(database['position_mm'], 2, ' mm')}, tip "
            f"{_spread(database['tip_mm'], 2, ' mm')}, flagged {_percent(database['flagged'])}, silently wrong "
            f"{database['silent_wrong']}"
        )
    lines += _instruments(values["recognition"])
    lines += [f"failed    {message}" for message in values["failed"]]
    if values["unfinished"]:
        lines.append(f"note      {values['unfinished']} blocks of views are not done yet; run again to go on")
    return lines


def _instruments(found: Mapping[str, Any]) -> list[str]:
    """Names, and how far the tip is off in the trocar's frame and, by the crosses of the same picture, in the room."""
    if not found["views"]:
        return []
    lines = [
        f"tools     {found['right']} of {found['views']} instruments recognised, {found['flagged']} flagged, "
        f"{found['wrong']} with a wrong name; of wheels taken for wider ones by a quarter "
        f"{_percent(found['other_size_flagged'])} flagged"
    ]
    for words, name, digits, unit in (
        ("tip from the trocar", "tip_mm", 2, " mm"), ("axis", "axis_deg", 3, "°"),
        ("tip in the room", "room_tip_mm", 2, " mm"), ("time", "milliseconds", 0, " ms"),
    ):  # fmt: skip
        if found[name] is not None:
            lines.append(f"tools     {words}: {_spread(found[name], digits, unit)}")
    lines.append(
        f"coverage  {_percent(found['coverage90'])} of the tips in 90 % ellipsoids, in the room "
        f"{_percent(found['room_coverage90'])} of {found['placed']}"
    )
    return lines


def _group(group: Mapping[str, Any]) -> str:
    told = f"{group['layout']:11} {group['source']:7} {group['crosses']:9} {group['views']:5d} views, flagged "
    told += f"{_percent(group['flagged'])}, silently wrong {group['silent_wrong']}"
    if group["position_mm"] is not None:
        told += f", position {_spread(group['position_mm'], 2, ' mm')}, tip {_spread(group['tip_mm'], 2, ' mm')}"
    return told


def draw_tips(rows: Sequence[Mapping[str, Any]]) -> Picture:
    """Errors of the tip, sorted, by the number of crosses."""
    figure = new_figure(760, 430)
    axes = figure.subplots()
    best = [row for row in rows if row["layout"] == "recommended" and row["status"] == "converged"]
    for words, colour in _COLOURS.items():
        low, high = (5, 99) if words.startswith("5") else (int(words), int(words))
        found = sorted(row["tip_mm"] for row in best if low <= row["visible"] <= high)
        if found:
            axes.plot(
                found, 100.0 * (np.arange(len(found)) + 0.5) / len(found), color=colour, lw=2, label=f"{words} crosses"
            )
    axes.axvline(_TOOL_TIP_MM, color=BLACK, ls="--", lw=1, label="2° of the dissertation")
    axes.set(xlabel="error of the tip, mm", ylabel="% of views that are not worse", xscale="log", ylim=(0.0, 100.0))
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, fontsize=11)
    figure.subplots_adjust(left=0.1, right=0.97, bottom=0.14, top=0.95)
    return picture(
        figure, "Errors of the tip, sorted.",
        "Error of the tip of a 300 mm tool, recommended layout, by the number of crosses that are whole in the view.",
    )  # fmt: skip


def as_page(values: Mapping[str, Any], shown: Picture) -> bytes:
    """The page."""
    columns = ["layout", "from", "crosses", "views", "flagged", "silently wrong", "in 90 %", "position (mm)",
               "angle (°)", "tip (mm)"]  # fmt: skip
    cells = [
        [
            group["layout"], group["source"], group["crosses"], str(group["views"]), _percent(group["flagged"]),
            str(group["silent_wrong"]), _percent(group["coverage90"]),
            *(_cell(group[name], digits) for name, digits in (("position_mm", 2), ("angle_deg", 3), ("tip_mm", 2))),
        ]
        for group in values["groups"]
    ]  # fmt: skip
    table = Table("By the number of crosses; median, 95th percentile, worst of what is not flagged.", columns, cells)
    return page_as_html(Page("Trocar poses", as_lines(values), (shown,), [table]))


def _cell(spread: Mapping[str, float] | None, digits: int) -> str:
    return "–" if spread is None else ", ".join(number(spread[name], digits) for name in ("median", "p95", "worst"))


def _spread(spread: Mapping[str, float], digits: int, unit: str) -> str:
    return (
        f"median {spread['median']:.{digits}f}, 95th percentile {spread['p95']:.{digits}f}, worst "
        f"{spread['worst']:.{digits}f}{unit}"
    )


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100.0 * share:.1f} %"
