"""The conclusion for people: sentences, the figures, and a table of the sweeps."""

from collections.abc import Mapping, Sequence
from typing import Any

from glisson.navigation.figures.picture import Picture
from glisson.studies.page import Page, Table, number, page_as_html


def as_lines(values: Mapping[str, Any]) -> list[str]:
    """What was found."""
    lines = [
        f"tracking  {values['noise_px']:.3f} px off the truth in a rendered video, {values['tracked_per_s']:.0f} "
        "frames per second (20 markers, 960 × 540, decoding among it)"
    ]
    if values["conventional_mm"] is not None:
        lines.append(
            f"breaths   conventional ventilation of 15 mm: {values['conventional_mm']:.1f} mm found, from pixels"
        )
    for name, words in (("simulated", "simulated tracks"), ("from_pixels", "from rendered pixels")):
        found = values["phase"][name]
        if found["failed"]:
            lines.append(f"breaths   {found['failed']} recordings, {words}, without an answer")
        if found["phase_worst"] is not None:
            phase, left = found["phase_worst"], found["residual_mm"]
            lines.append(
                f"breaths   {values['breaths'][name]} recordings of 20 mm, {words}: phase of the worst frame "
                f"{100.0 * phase['median']:.1f} % of a cycle (median), {100.0 * phase['p95']:.1f} (95th percentile), "
                f"{100.0 * phase['worst']:.1f} (worst); residual at the worst phase {left['median']:.2f}, "
                f"{left['p95']:.2f}, {left['worst']:.2f} mm"
            )
    if values["found_within"] is not None:
        error, counts, pixels = values["error_hz"], values["sweeps"], values["found_within_from_pixels"]
        lines += [
            f"plateau   {counts['simulated']} simulated sweeps and {counts['from_pixels']} from rendered pixels",
            f"plateau   within 0.3 Hz in {_percent(values['found_within'])} of {values['resolvable']} that can be "
            f"resolved (of those from pixels {_percent(pixels)})",
            f"plateau   off by {error['median']:.2f} Hz (median), {error['p95']:.2f} (95th percentile), "
            f"{error['worst']:.2f} (worst); the 90 % interval holds the truth in {_percent(values['interval_holds'])}",
            f"flags     {_percent(values['false_flags'])} of them flagged all the same; of {values['unresolvable']} "
            f"that can't be resolved, {values['silent_wrong']} not flagged and wrong",
        ]
        lines.append(
            f"flags     of single rates {_percent(values['rate_false_flags'])} of resolvable ones flagged, "
            f"{_percent(values['rate_missed_flags'])} of the others not"
        )
    lines += [f"failed    {message}" for message in values["failed"]]
    if values["unfinished"]:
        lines.append(f"note      {values['unfinished']} points are not done yet; run again to go on")
    return lines


def as_page(values: Mapping[str, Any], rows: Sequence[Mapping[str, Any]], shown: Sequence[Picture]) -> bytes:
    """The page."""
    columns = [
        "seed",
        "from pixels",
        "true (Hz)",
        "found (Hz)",
        "90 % interval",
        "resolvable",
        "pictures/s",
        "exposure (ms)",
    ]
    cells = [
        [
            str(row["seed"]),
            "yes" if row["from_pixels"] else "",
            number(row["true"]),
            number(row["found"]),
            "–" if row["interval"] is None else f"{row['interval'][0]:.2f} to {row['interval'][1]:.2f}",
            "yes" if row["resolvable"] else "no",
            number(row["frames_per_s"], 0),
            number(row["exposure_ms"], 1),
        ]
        for row in rows
    ]
    return page_as_html(
        Page("Breathing and ventilation", as_lines(values), shown, [Table("All sweeps.", columns, cells)])
    )


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100.0 * share:.1f} %"
