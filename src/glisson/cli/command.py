"""What each command of `glisson` consists of."""

import argparse
from collections.abc import Callable
from dataclasses import dataclass

from glisson.cli.console import Answer
from glisson.cli.progress import StageLines


@dataclass(frozen=True)
class Command:
    """A command: its name, examples, arguments, and what it does.

    `keys` are those of its JSON object; where it fails they are all there, as null.
    """

    name: str
    examples: str
    add_arguments: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace, StageLines], Answer]
    keys: tuple[str, ...] = ()
