"""The conclusion for people: sentences, a chart of the Dice of all scans, and tables."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from glisson.navigation.figures.colours import BLUE, GREEN, ORANGE
from glisson.navigation.figures.picture import Picture, new_figure, picture
from glisson.studies.page import Page, Table, number, page_as_html

_NAMES = {"dice": ("Dice", 3), "asd_mm": ("ASD (mm)", 2), "hd95_mm": ("HD95 (mm)", 2), "seconds": ("seconds", 1)}
_COLOURS = {("CT", "no click"): ORANGE, ("CT", "one click"): BLUE, ("MR", "one click"): GREEN}


def as_lines(values: Mapping[str, Any]) -> list[str]:
    """Distributions of the scores, recall of each kind of failure, and what failed."""
    lines = []
    for group in values["scores"]:
        for name, (words, digits) in _NAMES.items():
            if (spread := group[name]) is not None:
                words_of_tail, tail = ("5th", "p5") if name == "dice" else ("95th", "p95")
                lines.append(
                    f"{group['modality']}, {group['start']:9} {words:10} median {spread['median']:.{digits}f}, "
                    f"{words_of_tail} percentile {spread[tail]:.{digits}f}, worst {spread['worst']:.{digits}f}"
                )
    lines += [
        f"flags     {found['failure']:15} {100.0 * found['recall']:.1f} % of {found['failed_slices']} failed slices, "
        f"{found['noticed']} of {found['failures']} failures; {100.0 * found['good_flagged_share']:.1f} % of good ones"
        for found in values["flags"]
        if found["recall"] is not None and found["good_flagged_share"] is not None
    ]
    if values["flagged_share"] is not None:
        lines.append(f"flags     of the segmentations as they are: {100.0 * values['flagged_share']:.1f} % of slices")
    lines += [f"failed    {row['modality']} {row['member']}: {row['message']}" for row in values["failed"]]
    if values["unfinished"]:
        lines.append(f"note      {values['unfinished']} points are not done yet; run again to go on")
    return lines


def draw_scores(values: Mapping[str, Any]) -> Picture:
    """Dice of all segmentations, sorted, by modality and start."""
    figure = new_figure(760, 430)
    axes = figure.subplots()
    for (modality, start), colour in _COLOURS.items():
        found = sorted(
            row["dice"]
            for row in values["rows"]
            if (row["modality"], row["start"]) == (modality, start) and row["dice"] is not None
        )
        if found:
            shares = (np.arange(len(found)) + 0.5) / len(found)
            axes.plot(100.0 * shares, found, "o-", color=colour, label=f"{modality}, {start}", markersize=4.0)
    axes.set(xlabel="% of scans that are not better", ylabel="Dice", xlim=(0.0, 100.0))
    axes.grid(alpha=0.3)
    if axes.lines:
        axes.legend(frameon=False, fontsize=11)
    figure.subplots_adjust(left=0.11, right=0.97, bottom=0.13, top=0.95)
    return picture(
        figure, "Dice of all scans, sorted.", "Dice against the phantom's own liver, from the worst scan to the best."
    )


def as_page(values: Mapping[str, Any], shown: Picture) -> bytes:
    """The page."""
    columns = [
        "modality",
        "member",
        "start",
        "phase",
        "noise",
        "metal",
        "gas",
        *(words for words, _ in _NAMES.values()),
    ]
    cases = [
        [
            *(str(row[name]) for name in ("modality", "member", "start", "phase")),
            *(number(row[name], 1) for name in ("noise", "metal", "gas")),
            *(number(row[name], digits) for name, (_, digits) in _NAMES.items()),
            str(row["flagged"]),
            str(row["slices"]),
        ]
        for row in values["rows"]
    ]
    flags = [
        [str(row[name]) for name in ("member", "failure", "failed", "failed_flagged", "good", "good_flagged")]
        for row in values["flag_rows"]
    ]
    tables: Sequence[Table] = [
        Table("All segmentations.", [*columns, "flagged", "slices"], cases),
        Table("All failures, in slices.", ["member", "failure", "failed", "flagged", "good", "flagged"], flags),
    ]
    return page_as_html(Page("Segmentation of the liver", as_lines(values), (shown,), tables))
