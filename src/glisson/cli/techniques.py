"""`glisson techniques`: what can be used for each step."""

import argparse
from dataclasses import asdict

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.progress import StageLines
from glisson.core.registry import Listing, list_techniques


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    pass


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    listings = list_techniques()
    rows = [asdict(listing) | {"available": listing.is_available} for listing in listings]
    width = max(len(listing.name) for listing in listings)
    kinds = max(len(listing.kind) for listing in listings)
    text = [
        f"{listing.kind:{kinds}s}  {listing.name:{width}s}  {listing.package}: {_state(listing)}"
        for listing in listings
    ]
    return Answer({"techniques": rows}, "\n".join(text))


def _state(listing: Listing) -> str:
    if listing.broken is not None:
        return f"does not load ({listing.broken})"
    return f"needs {', '.join(listing.missing)}" if listing.missing else listing.summary


COMMAND = Command(
    "techniques",
    "  glisson techniques\n  glisson techniques --json",
    _add_arguments,
    _run,
    ("techniques",),
)
