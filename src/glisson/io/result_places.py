"""Where results may go: never onto what they are made from, and with the ending of what they are."""

import os
from collections.abc import Iterable
from pathlib import Path

from glisson.core import BadInput


def result_place(place: str | Path, inputs: Iterable[str | Path | None], ending: str | None = None) -> Path:
    """A place for a result.

    Args:
        place: where it shall go.
        inputs: the files that are read; None where one was not given.
        ending: such as ".png"; None: any.

    Raises:
        BadInput: one of the files that are read is there, or the name has another ending.
    """
    target = Path(place)
    for given in inputs:
        if given is not None and os.path.realpath(given) == os.path.realpath(target):
            raise BadInput(f"{target} is read and would be overwritten; give the result another name.")
    if ending is not None and target.suffix.lower() != ending:
        raise BadInput(f"{target} is written as {ending[1:].upper()}; give it a name that ends in {ending}.")
    return target
