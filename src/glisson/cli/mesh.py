"""`glisson mesh`: the organ's model."""

import argparse

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.progress import StageLines
from glisson.cli.running import add_run_arguments, run_to, seconds_text


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    add_run_arguments(parser, ("surface", "mesh"), ())


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    result = run_to("mesh", arguments, lines)
    facts = {name: value for name, value in result.facts["mesh"].items() if name != "tetrahedra_from"}
    text = (
        f"{facts['elements']} tetrahedra, {facts['nodes']} nodes, {facts['volume_ml']:.0f} ml "
        f"({100.0 * facts['volume_error']:+.2f} % of the mask), dihedral angles from "
        f"{facts['smallest_dihedral_deg']:.1f}°"
    )
    notes = [f"note      {note}" for note in facts["notes"]]
    values = facts | {"seconds": result.seconds}
    return Answer(values, "\n".join([text, *notes, seconds_text(result.seconds)]))


COMMAND = Command(
    "mesh",
    "  glisson mesh liver\n  glisson mesh liver --mesh.edge-length-mm 5",
    _add_arguments,
    _run,
    ("elements", "nodes", "volume_ml", "volume_error", "smallest_dihedral_deg", "seconds"),
)
