"""The figures on the public sequences, for people."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

_ANCHORS = (
    "beside    Mestdagh and Cotin's own code on their linear sequences: 830 to 1660 ms a frame, force error 6.3 %; a "
    "linear model on the neo-Hookean ones: 1.3 to 1.9 mm"
)
_HEADING = f"{'technique':34}{'mean':>6}{'median':>8}{'p95':>6} mm{'force':>9}{'median':>9}{'p95':>6} ms{'set-up':>9}"


def sequence_lines(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """A line for each technique and sequence, those that it was tuned on apart."""
    for tuned, words in ((True, "tuned on"), (False, "not tuned on")):
        chosen = [row for row in rows if row["tuned_on"] == tuned]
        if chosen:
            yield f"{words:24}{_HEADING}"
            yield from (_line(row) for row in chosen)
    yield _ANCHORS


def _line(row: Mapping[str, Any]) -> str:
    tre, spent, force = row["tre_mm"], row["milliseconds"], row["force_percent"]
    off = "–" if force is None else f"{force:.1f} %"
    failed = f"; {row['failed']} frames without an answer" if row["failed"] else ""
    return (
        f"{row['set']:24}{row['technique']:34}{tre['mean']:6.2f}{tre['median']:8.2f}{tre['p95']:6.2f}   {off:>9}"
        f"{spent['median']:9.0f}{spent['p95']:6.0f}   {row['set_up_seconds']:7.0f} s{failed}"
    )
