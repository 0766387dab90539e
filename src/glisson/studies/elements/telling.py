"""The conclusion for people: error over seconds as a plot, and a table."""

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from glisson.navigation.figures.colours import BLUE, ORANGE
from glisson.navigation.figures.picture import Picture, new_figure, picture
from glisson.studies.page import Page, Table, number, page_as_html

_COLOURS = {"T4": ORANGE, "T10": BLUE}


def as_lines(values: Mapping[str, Any]) -> list[str]:
    """What T4 would have to be forgiven in the time of each T10 solution."""
    lines = [
        f"ν {found['poisson_ratio']:<6g} after {found['seconds']:6.1f} s: T4 {found['t4_mm']:.3f} mm, "
        f"T10 {found['t10_mm']:.3f} mm, {found['t4_mm'] / found['t10_mm']:.1f} times less"
        for found in values["advantage"]
    ]
    if values["unfinished"]:
        lines.append(f"note      {values['unfinished']} points are not done yet; run again to go on")
    return lines


def draw_errors(rows: Sequence[Mapping[str, Any]]) -> Picture:
    """Panels by Poisson's ratio: root mean square error of the whole block over the seconds of the solve."""
    ratios = sorted({row["poisson_ratio"] for row in rows})
    figure = new_figure(430 * max(len(ratios), 1) + 60, 430)
    panels = figure.subplots(1, max(len(ratios), 1), sharey=True, squeeze=False)[0]
    for axes, ratio in zip(panels, ratios, strict=False):
        for element, colour in _COLOURS.items():
            shown = [
                row
                for row in rows
                if (row["element"], row["poisson_ratio"]) == (element, ratio) and row["whole_mm"] is not None
            ]
            times, errors = [row["solve_seconds"] for row in shown], [row["whole_mm"] for row in shown]
            axes.plot(times, errors, "o-", color=colour, label=element)
            for row, time, error in zip(shown, times, errors, strict=True):
                axes.annotate(f"{row['elements']:,}", (time, error), (4, 4), textcoords="offset points", fontsize=9)
        axes.set(xscale="log", yscale="log", title=f"ν = {ratio:g}")
        axes.margins(x=0.2)
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.set_major_formatter(StrMethodFormatter("{x:g}"))
            axis.set_minor_formatter(NullFormatter())
        axes.set_xlabel("seconds of the solve", fontsize=11.5)
        axes.grid(alpha=0.3, which="both")
        axes.legend(frameon=False, fontsize=11)
    panels[0].set_ylabel("error (mm)", fontsize=11.5)
    figure.subplots_adjust(left=0.09, right=0.97, bottom=0.13, top=0.91, wspace=0.06)
    return picture(
        figure,
        "Error over seconds for T4 and T10 elements.",
        "Root mean square error of the displacement against a fine T10 mesh, over the seconds of the solve; beside "
        "each point the number of elements.",
    )


def as_page(values: Mapping[str, Any], shown: Picture) -> bytes:
    """The page."""
    columns = ["element", "ν", "elements", "unknowns", "seconds", "target (mm)", "whole (mm)", "status"]
    rows = [
        [
            row["element"],
            f"{row['poisson_ratio']:g}",
            str(row["elements"]),
            str(row["unknowns"]),
            number(row["solve_seconds"]),
            number(row["target_mm"], 3),
            number(row["whole_mm"], 3),
            str(row["status"]),
        ]
        for row in values["rows"]
    ]
    return page_as_html(Page("Error per second", as_lines(values), (shown,), [Table("All solutions.", columns, rows)]))
