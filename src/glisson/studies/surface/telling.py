"""The conclusion for people: sentences, a chart beside the printed tables, and tables."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from glisson.navigation.figures.colours import BLACK, BLUE, ORANGE
from glisson.navigation.figures.picture import Picture, new_figure, picture
from glisson.studies.page import Page, Table, number, page_as_html

_WORDS = {"half": "1-4, half a breath", "full": "1-4, a full breath"}


def as_lines(values: Mapping[str, Any]) -> list[str]:
    """The noise, and for each pair what both ways give."""
    noise = values["noise"]
    lines = [
        f"noise     fitted: position {noise['position_mm']:.3f} mm, direction {noise['direction_deg']:.3f}°, roll "
        f"{noise['roll_deg']:.3f}°, touched point {noise['touched_mm']:.3f} mm ({values['noise_factor']:.4f} of "
        f"what is stated of the trocar); tip {noise['tip_px']:g}, landmark {noise['landmark_px']:g}, feature "
        f"{noise['feature_px']:g} px; construction at 1-2 in the fit {values['fit_mm']:.2f} mm in the mean"
    ]
    lines += [_line("fitted", name, row) for name, row in (values["pairs"] | values["breathing"]).items()]
    lines.append(_line("fitted", "ten views", values["ten_views"]))
    lines += [_line("stated", name, row) for name, row in values["stated"].items()]
    for name, row in values["rendered"].items():
        if row["joint_mm"] is not None:
            lines.append(
                f"rendered  {name:18} joint {_spread(row['joint_mm'])} over {row['draws']} draws; "
                f"{row['features']:.0f} features, {row['feature_px']:.2f} px off, "
                f"{100.0 * row['feature_outliers']:.0f} % of them more than 1 px; tip {row['tip_px']:.1f} px off"
            )
        lines += [f"rendered  {name:18} {message}" for message in row["messages"]]
    lines += [f"failed    {message}" for message in values["failed"]]
    if values["unfinished"]:
        lines.append(f"note      {values['unfinished']} points are not done yet; run again to go on")
    return lines


def _line(run: str, name: str, row: Mapping[str, Any]) -> str:
    told = [f"{run:9} {_WORDS.get(name, name):18} {row['angle_deg']:5.2f}°"]
    if row["classic_mm"] is not None:
        printed = ""
        if row["percentile"] is not None and run == "fitted":
            printed = f" (printed mean {row['printed_mm']:.2f}: percentile {row['percentile']:.0f})"
        told.append(f"construction {_spread(row['classic_mm'])}{printed}, refused {_percent(row['classic_refused'])}")
    if row["joint_mm"] is not None:
        told.append(
            f"joint {_spread(row['joint_mm'])}, {_percent(row['coverage90'])} in 90 % ellipsoids, flagged "
            f"{_percent(row['flagged'])}"
        )
    return "; ".join(told)


def _spread(spread: Mapping[str, float]) -> str:
    return f"median {spread['median']:.2f}, 95th {spread['p95']:.2f} mm"


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100.0 * share:.1f} %"


def draw_errors(values: Mapping[str, Any]) -> Picture:
    """Median and 95th percentile of both ways beside the printed means."""
    rows = {**values["pairs"], **values["breathing"], "ten": values["ten_views"]}
    figure = new_figure(820, 440)
    axes = figure.subplots()
    for shift, what, colour, words in (
        (-0.17, "classic_mm", ORANGE, "construction"),
        (0.17, "joint_mm", BLUE, "joint adjustment"),
    ):
        shown = [(at, row[what]) for at, row in enumerate(rows.values()) if row[what] is not None]
        places, medians = [at + shift for at, _ in shown], np.array([spread["median"] for _, spread in shown])
        tails = np.array([spread["p95"] for _, spread in shown])
        axes.bar(places, medians, 0.32, color=colour, label=f"{words}: median, and line to the 95th percentile")
        axes.errorbar(places, medians, [0.0 * medians, tails - medians], fmt="none", ecolor=BLACK, capsize=4)
    printed = [(at - 0.17, row["printed_mm"]) for at, row in enumerate(rows.values()) if row["printed_mm"] is not None]
    axes.plot(*zip(*printed, strict=True), "D", color=BLACK, label="printed in the dissertation")
    labels = [
        f"{_WORDS.get(name, name).replace(', ', ',' + chr(10))}\n{row['angle_deg']:.1f}°" for name, row in rows.items()
    ]
    axes.set_xticks(range(len(rows)), labels)
    axes.set(ylabel="mean error of six points (mm)")
    axes.grid(alpha=0.3, axis="y")
    axes.legend(frameon=False, fontsize=11)
    figure.subplots_adjust(left=0.08, right=0.98, bottom=0.17, top=0.97)
    return picture(
        figure, "Errors of both ways for each pair of views.", "Mean error of the six points with the fitted noise."
    )


def as_page(values: Mapping[str, Any], shown: Picture) -> bytes:
    """The page."""
    columns = [
        "views", "angle (°)", "construction (mm)", "95th", "printed (mm)", "percentile", "90 % ellipsoids hold",
        "joint (mm)", "95th", "90 % ellipsoids hold", "flagged", "joint no worse",
    ]  # fmt: skip

    def cells(name: str, row: Mapping[str, Any]) -> list[str]:
        classic, joint = (row[what] or {} for what in ("classic_mm", "joint_mm"))
        return [
            _WORDS.get(name, name), number(row["angle_deg"]), number(classic.get("median")), number(classic.get("p95")),
            number(row["printed_mm"]), number(row["percentile"], 0), _percent(row["classic_coverage90"]),
            number(joint.get("median")), number(joint.get("p95")), _percent(row["coverage90"]),
            _percent(row["flagged"]), _percent(row["joint_no_worse"]),
        ]  # fmt: skip

    fitted = {**values["pairs"], **values["breathing"], "ten views": values["ten_views"]}
    tables = [
        Table("With the fitted noise.", columns, [cells(name, row) for name, row in fitted.items()]),
        Table("With the trocar's stated 1 mm and 2°.", columns, [cells(*one) for one in values["stated"].items()]),
    ]
    return page_as_html(Page("Two-view reconstruction", as_lines(values), (shown,), tables))
