"""`glisson doctor`: checks the installation."""

import argparse
from dataclasses import asdict
from pathlib import Path

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.progress import StageLines
from glisson.framework.checkup import Finding, check_installation


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    pass


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    findings = list(check_installation(Path.cwd()))
    troubles = [finding for finding in findings if finding.needed and not finding.is_good]
    text = [f"{_mark(finding)}  {finding.name}: {finding.detail}" for finding in findings]
    text.append("Glisson is ready." if not troubles else f"Not ready: {', '.join(f.name for f in troubles)}.")
    values = {"ready": not troubles, "findings": [asdict(finding) for finding in findings]}
    return Answer(values, "\n".join(text), 1 if troubles else 0)


def _mark(finding: Finding) -> str:
    if finding.is_good:
        return "good   "
    return "MISSING" if finding.needed else "without"


COMMAND = Command(
    "doctor",
    "  glisson doctor",
    _add_arguments,
    _run,
    ("ready", "findings"),
)
