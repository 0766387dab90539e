"""Entry point of `glisson`: reads the command line, runs a command, and turns every outcome into an exit code.

Exit codes: 0 good; 1 a stage failed or did not converge; 2 bad usage or bad input; 130 interrupted.
"""

import argparse
import os
import re
import signal
import sys
import traceback
import warnings
from collections.abc import Sequence
from contextlib import redirect_stdout, suppress
from importlib import import_module
from typing import NoReturn, TextIO

import glisson
from glisson.cli.command import Command
from glisson.cli.console import Answer, private_stdout, tell
from glisson.cli.progress import StageLines
from glisson.core.errors import BadInput, GlissonError, StageFailed
from glisson.core.status import Status
from glisson.framework.interruptions import interruptions_held

COMMANDS = {
    "demo": "run the whole way on the phantom that ships with Glisson",
    "new": "make a case folder from a scan and label maps; nothing that identifies the patient is copied",
    "artefacts": "lessen the streaks of metal and gas in a CT, and tell what is lost beside them",
    "segment": "find the liver in the scan, or check and clean a label map that was given",
    "vessels": "find portal and hepatic veins inside the liver, tell them apart, and follow them from their roots",
    "correct": "correct the liver's mask by clicks into what is missing or too much",
    "structure": "mark a tumour, the gallbladder, a guide wire or a stent by clicks into it",
    "mesh": "build the liver's model: surface, tetrahedra, materials, attachments, structures",
    "simulate": "compute what scenario.toml does to the liver (runs the stages before it where they are out of date)",
    "navigate": "tell where tumours, planes and volumes are now (runs the stages before it where they are out of date)",
    "report": "write the report (runs the stages before it where they are out of date)",
    "run": "bring a case up to date, from the scan to the report",
    "couinaud": "divide the liver into Couinaud's segments by its veins and named landmarks",
    "resections": "list what each liver resection would take of the segments, and what would remain",
    "calibrate": "calibrate a camera, hand and eye, a tool's tip or a scope's geometry",
    "reconstruct": "find surface points from two or more laparoscope views and one touched point",
    "register": "find the liver as it is now from sparse observations, and tell how sure that is",
    "export": "write the labels of a case as one segmentation for other programs (3D Slicer, DICOM)",
    "deidentify": "copy DICOM files without what tells who the patient is (the standard's basic profile)",
    "layout": "propose where crosses should hang in a room, or measure where they do",
    "localize": "tell where a trocar is, from an image of its camera that shows crosses of known place",
    "instruments": "keep a library of instruments, recognise them in a trocar's camera, and tell when they were in use",
    "pointer": "tell points, distances, strokes and a resection plane that an instrument's tip has drawn",
    "markers": "write wheels, crosses and calibration boards as PDF to print at true scale",
    "track": "follow markers through a laparoscope's video",
    "breathing": "tell breaths in markers' motion and take breathing away; compare rates of ventilation",
    "benchmark": "measure Glisson beside other engines (in a checkout; make bench installs them)",
    "study": "compute many points, each once, and tell what they say together",
    "verify": "compare the tissue mechanics with closed forms, published figures and another engine",
    "techniques": "list the techniques of each kind, with the package that offers them",
    "doctor": "check the installation and say what is missing",
}
"""Name of each command, in a module of that name → what it does."""

_INTERRUPTED = 130  # 128 + SIGINT, as shells count


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise BadInput(f"{message[:1].upper()}{message[1:]}; see {self.prog} --help.")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run `glisson` with these arguments (those of the process by default) and give its exit code."""
    words = _with_negative_values(sys.argv[1:] if arguments is None else arguments)
    with suppress(ValueError):  # only the main thread may say what signals do
        # A batch system's end is as orderly as a person's Ctrl-C: nothing half-made, no child left running.
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    with private_stdout() as stdout:
        answer = _answer(words, stdout)
        tell(answer, "--json" in words, stdout)
        return answer.exit_code


def _answer(words: Sequence[str], stdout: TextIO) -> Answer:
    """The answer of a command, whatever happens in it."""
    debug = "--debug" in words or bool(os.environ.get("GLISSON_DEBUG"))
    command: Command | None = None
    lines = StageLines()
    keeps = False
    try:
        command = _command(next((word for word in words if not word.startswith("-")), ""))
        if not debug:
            warnings.simplefilter("ignore")  # they speak to programmers, of lines of code
        with redirect_stdout(stdout):
            arguments = _parser(command).parse_args(words)
        assert command is not None  # the parser asks for one
        keeps = hasattr(arguments, "case")
        answer = command.run(arguments, lines)
        answer.line()  # a number that cannot be printed is a failure like any other
        return answer
    except SystemExit:  # after --help and --version
        return Answer({})
    except BaseException as error:
        lines.close()
        if debug:
            traceback.print_exc()
        return _failure(error, lines.stage, command, keeps)


def _failure(error: BaseException, stage: str | None, command: Command | None, keeps: bool) -> Answer:
    """What is said of an error; `keeps`: the stages before the one that ran are in a case folder."""
    status: Status | None = None
    exit_code = 1
    while isinstance(error, SystemError) and error.__cause__ is not None:
        error = error.__cause__  # Ctrl-C in the midst of a compiled function comes wrapped, once for each caller
    message = str(error)
    if isinstance(error, KeyboardInterrupt):
        where = "" if stage is None else f" in the stage {stage}"
        where += "; what was done before it is kept" if stage is not None and keeps else ""
        message, exit_code = message or f"Interrupted{where}.", _INTERRUPTED
    elif isinstance(error, StageFailed):
        status = error.status
        exit_code = 2 if status is Status.BAD_INPUT else 1
    elif isinstance(error, GlissonError):
        exit_code = error.exit_code
        status = Status.BAD_INPUT if isinstance(error, BadInput) else None
    elif isinstance(error, MemoryError):
        message = "There is not enough memory; use a coarser mesh or close other programs."
    elif isinstance(error, OSError) and error.filename is not None:
        message = f"{error.filename}: {error.strerror}."
    elif isinstance(error, Exception):
        message = (
            f"Glisson failed in a way that was not foreseen ({type(error).__name__}: {' '.join(message.split())}); "
            "please report it with what --debug shows."
        )
    else:
        raise error
    values = dict.fromkeys(command.keys if command else ()) | {"status": status, "message": message, "stage": stage}
    return Answer(values, f"glisson: {message}", exit_code, is_error=True)


def _command(name: str) -> Command | None:
    if name not in COMMANDS:
        return None
    with interruptions_held():
        made: Command = import_module(f"glisson.cli.{name}").COMMAND
    return made


def _parser(chosen: Command | None) -> argparse.ArgumentParser:
    parser = _Parser(
        prog="glisson",
        description="Computational image-based guidance for precision laparoscopy. Research software, not for "
        "clinical use.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"glisson {glisson.__version__}")
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="COMMAND", parser_class=_Parser)
    for name, summary in COMMANDS.items():
        made = subparsers.add_parser(
            name,
            help=summary,
            description=summary,
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )
        made.add_argument("--json", action="store_true", help="print one JSON object on stdout, all else on stderr")
        made.add_argument("--debug", action="store_true", help="show where an unforeseen error came from")
        if chosen is not None and name == chosen.name:
            # Only then: the options of techniques come from their classes, which take seconds to load.
            made.epilog = f"examples:\n{chosen.examples}"
            chosen.add_arguments(made)
    return parser


def _with_negative_values(words: Sequence[str]) -> list[str]:
    """Join "--seed-point -10,20,30" with "=", since a list that begins with "-" looks like an option."""
    joined: list[str] = []
    for word in words:
        if joined and re.fullmatch(r"--[^=]+", joined[-1]) and re.match(r"-[\d.]", word):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


if __name__ == "__main__":
    sys.exit(main())
