"""Who hears what: machines read one JSON object on stdout, people read stderr, libraries are kept off stdout."""

import json
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, TextIO


@dataclass(frozen=True)
class Answer:
    """What a command has to say: `values` for machines, `text` for people, and the exit code.

    `is_error`: the text is no result but says why there is none.
    """

    values: Mapping[str, Any]
    text: str = ""
    exit_code: int = 0
    is_error: bool = False

    def line(self) -> str:
        """The values as one line of JSON.

        Raises:
            ValueError: a number is not finite.
        """
        return json.dumps(self.values, allow_nan=False, ensure_ascii=False) + "\n"


@contextmanager
def private_stdout() -> Iterator[TextIO]:
    """The real stdout for the answer; whatever else writes to stdout meanwhile goes to stderr.

    This holds for C++ libraries too: it is the file descriptor that is turned round.
    """
    if sys.stdout is None:  # started with stdout closed: nobody reads, and no other file may take its number
        with open(os.devnull, "w", encoding="utf-8") as nowhere:
            yield nowhere
        return
    sys.stdout.flush()
    kept = os.dup(1)
    previous = sys.stdout
    os.dup2(2, 1)
    with os.fdopen(kept, "w", encoding="utf-8", errors="backslashreplace") as answers:
        try:
            sys.stdout = sys.stderr
            with _whether_read_or_not(answers):
                yield answers
        finally:
            sys.stdout = previous
            with suppress(OSError):
                os.dup2(answers.fileno(), 1)


@contextmanager
def _whether_read_or_not(stream: TextIO) -> Iterator[None]:
    """Nobody may be reading any more (`glisson techniques | head -1`): that is no trouble of ours."""
    try:
        yield
        stream.flush()
    except BrokenPipeError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


def tell(answer: Answer, as_json: bool, stdout: TextIO) -> None:
    """Print an answer: with `as_json` one object on `stdout` and the text on stderr, else a result on `stdout`."""
    if as_json:
        stdout.write(answer.line())
    if answer.text:
        (sys.stderr if as_json or answer.is_error else stdout).write(answer.text.rstrip("\n") + "\n")
