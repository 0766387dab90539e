"""What the commands that run stages of a case share."""

import argparse
from collections.abc import Mapping, Sequence
from typing import Any

from glisson.cli.console import Answer
from glisson.cli.options import add_case, add_section_options, add_seed, add_technique_options, changed_settings
from glisson.cli.progress import StageLines
from glisson.framework.case import REPORT, open_case
from glisson.framework.pipeline import RunResult
from glisson.framework.stages import PIPELINE

RESULT_KEYS = (
    "status", "message", "tumours", "tumour", "plane", "volume", "wire", "margin_mm", "elements", "seconds",
)  # fmt: skip
"""Keys of `results.json` (design, section 5)."""


def add_run_arguments(parser: argparse.ArgumentParser, techniques: Sequence[str], sections: Sequence[str]) -> None:
    """The case, and the options of what runs."""
    add_case(parser)
    add_seed(parser)
    add_technique_options(parser, techniques)
    add_section_options(parser, sections)


def run_to(last: str, arguments: argparse.Namespace, lines: StageLines, replace: bool = False) -> RunResult:
    """Bring the stages of the case up to `last` up to date with the options that were given."""
    case = open_case(arguments.case)
    return PIPELINE.run(case, last, changed_settings(case.settings(), arguments), replace, lines)


def results_answer(result: RunResult, folder: Any) -> Answer:
    """What `run`, `navigate` and `demo` say: the guidance, and the seconds of this run."""
    values = dict(result.facts["navigate"]) | {"seconds": result.seconds, "case": str(folder)}
    return Answer(values, guidance_text(values))


def guidance_text(results: Mapping[str, Any]) -> str:
    """The guidance in lines for people."""
    lines = [f"status    {results['status']}: {results['message']}"]
    for tumour in results["tumours"]:
        target = " (target)" if tumour is not None and tumour == results["tumour"] else ""
        error = "" if tumour["error_mm"] is None else f", {tumour['error_mm']:.2f} mm off the truth"
        lines.append(
            f"{tumour['name']:9s} {_point(tumour['before_mm'])} → {_point(tumour['after_mm'])} mm{error}{target}"
        )
    for name, plane in results["plane"].items():
        if plane is not None:
            off = "" if plane["error_deg"] is None else f", {plane['error_deg']:.2f}° off the truth"
            lines.append(f"plane     {name}: turned by {plane['angle_deg']:.1f}°{off}")
    volume = results["volume"]
    if volume and volume["removed_before"] is not None:
        before, after = 100.0 * volume["removed_before"], 100.0 * volume["removed_after"]
        lines.append(f"volume    {volume['liver_ml']:.0f} ml, removed {before:.1f} % before, {after:.1f} % after")
    if results["wire"]:
        wire = results["wire"]
        lines.append(f"wire      slid {wire['slide_mm']:.1f} mm, tip {wire['distance_mm']:.1f} mm from the target")
    if results["margin_mm"] is not None:
        lines.append(f"margin    {results['margin_mm']:.1f} mm between target and plane")
    lines += [f"note      {note}" for note in results["notes"]]
    return "\n".join(lines)


def seconds_text(seconds: Mapping[str, float]) -> str:
    """Seconds of each stage and in all."""
    stages = ", ".join(f"{name} {value:.1f}" for name, value in seconds.items())
    return f"seconds   {stages}; {sum(seconds.values()):.1f} in all"


def report_text(folder: Any) -> str:
    """Where the report is."""
    return f"report    {folder}/{REPORT}"


def _point(point: Sequence[float]) -> str:
    return "(" + ", ".join(f"{value:.1f}" for value in point) + ")"
