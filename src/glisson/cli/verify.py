"""`glisson verify`: the verification suite of the tissue mechanics, with its report."""

import argparse
import time
from collections.abc import Sequence
from pathlib import Path

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.progress import StageLines
from glisson.core.errors import BadInput
from glisson.verification.check import Check
from glisson.verification.record import check_record, order_records
from glisson.verification.report import write_report
from glisson.verification.suite import chosen_cases, run_cases

_REPORT = "report.html"


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--only", metavar="PREFIX", help="run only the checks whose names begin so, such as mms")
    parser.add_argument(
        "--out", metavar="DIR", default="studies/verify", help="where the report goes (default: studies/verify)"
    )


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    cases = chosen_cases(arguments.only)
    report = _made_folder(arguments.out) / _REPORT
    started = time.perf_counter()
    lines.begun("verify", f"{len(cases)} cases were asked for")
    outcomes = run_cases(cases, lines)
    seconds = time.perf_counter() - started
    lines.ended("verify", seconds)
    write_report(report, outcomes, seconds)
    checks = [check for outcome in outcomes for check in outcome.checks]
    failed = [check for check in checks if not check.passed]
    values = {
        "checks": [check_record(check) for check in checks],
        "orders": order_records(checks),
        "passed": len(checks) - len(failed),
        "failed": len(failed),
        "seconds": seconds,
        "report": str(report),
    }
    return Answer(values, _text(checks, failed, report), 1 if failed else 0)


def _made_folder(name: str) -> Path:
    """The report's folder, made before the work begins, so that nothing is computed for a place that takes no file."""
    folder = Path(name)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as trouble:
        raise BadInput(
            f"The report cannot go to {name} ({trouble.strerror}); give another folder with --out."
        ) from None
    return folder


def _text(checks: Sequence[Check], failed: Sequence[Check], report: Path) -> str:
    wide = max(len(check.name) for check in checks)
    lines = [f"{'good' if check.passed else 'BAD '}  {check.name:{wide}s}  {_figures(check)}" for check in checks]
    told = "All checks passed" if not failed else f"{len(failed)} of {len(checks)} checks failed"
    return "\n".join([*lines, f"{told}. Report: {report}"])


def _figures(check: Check) -> str:
    if check.value is None or check.expected is None or check.tolerance is None:
        return check.reason
    unit = f" {check.unit}" if check.unit else ""
    return f"{check.value:.6g}, expected {check.expected:.6g} ± {check.tolerance:.2g}{unit}"


COMMAND = Command(
    "verify",
    "  glisson verify\n  glisson verify --only closed-form\n  glisson verify --out /tmp/verify --json",
    _add_arguments,
    _run,
    ("checks", "orders"),
)
