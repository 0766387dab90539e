"""What `glisson` says and to whom, whatever happens in a command."""

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Callable

import pytest

from glisson.cli import main as cli
from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.main import main
from glisson.cli.options import add_case
from glisson.cli.progress import StageLines
from glisson.core.errors import BadInput, StageFailed
from glisson.core.status import Status
from glisson.io.atomic import WriteFailed

Spoken = Callable[..., tuple[int, str, str]]


@pytest.fixture
def glisson(capfd: pytest.CaptureFixture[str]) -> Spoken:
    def run(*words: str) -> tuple[int, str, str]:
        code = main(words)
        out, err = capfd.readouterr()
        return code, out, err

    return run


def behaving(
    monkeypatch: pytest.MonkeyPatch,
    what: Callable[[StageLines], Answer],
    add_arguments: Callable[[argparse.ArgumentParser], None] = lambda parser: None,
) -> None:
    """Put a command in the place of "techniques" that does `what`."""

    def run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
        return what(lines)

    command = Command("techniques", "  example", add_arguments, run, ("rows",))
    monkeypatch.setattr(cli, "_command", lambda name: command if name == "techniques" else None)


def raising(error: BaseException) -> Callable[[StageLines], Answer]:
    def what(lines: StageLines) -> Answer:
        lines.begun("mesh", "it was asked for")
        raise error

    return what


@pytest.mark.parametrize(
    ("error", "code", "status", "words"),
    [
        (BadInput("The scan is empty."), 2, "bad_input", "The scan is empty."),
        (StageFailed("It slides along x.", Status.SINGULAR), 1, "singular", "It slides along x."),
        (WriteFailed("The disk is full."), 1, None, "The disk is full."),
        (KeyboardInterrupt(), 130, None, "Interrupted in the stage mesh."),
        (MemoryError(), 1, None, "not enough memory"),
        (FileNotFoundError(2, "No such file or directory", "x.nii"), 1, None, "x.nii: No such file"),
        (ZeroDivisionError("division\nby zero"), 1, None, "not foreseen (ZeroDivisionError: division by zero)"),
    ],
)
@pytest.mark.parametrize("as_json", [True, False])
def test_every_outcome_is_one_sentence_and_an_exit_code(
    glisson: Spoken,
    monkeypatch: pytest.MonkeyPatch,
    error: BaseException,
    code: int,
    status: str | None,
    words: str,
    as_json: bool,
) -> None:
    behaving(monkeypatch, raising(error))
    found, out, err = glisson("techniques", *(["--json"] if as_json else []))
    assert found == code
    assert "Traceback" not in out + err
    if as_json:
        values = json.loads(out)
        assert values["status"] == status
        assert words in values["message"]
        assert values["stage"] == "mesh"
        assert values["rows"] is None
        assert "\n" not in values["message"]
    else:
        assert out == ""
    assert words in err


def test_an_interruption_in_a_case_says_what_is_kept(glisson: Spoken, monkeypatch: pytest.MonkeyPatch) -> None:
    behaving(monkeypatch, raising(KeyboardInterrupt()), add_case)
    assert "Interrupted in the stage mesh; what was done before it is kept." in glisson("techniques", "case")[2]


def test_debug_shows_where_an_unforeseen_error_came_from(glisson: Spoken, monkeypatch: pytest.MonkeyPatch) -> None:
    behaving(monkeypatch, raising(ZeroDivisionError("slip")))
    assert "Traceback" in glisson("techniques", "--debug")[2]
    monkeypatch.setenv("GLISSON_DEBUG", "1")
    assert "Traceback" in glisson("techniques")[2]


def test_only_the_answer_reaches_stdout(glisson: Spoken, monkeypatch: pytest.MonkeyPatch) -> None:
    def noisy(lines: StageLines) -> Answer:
        print("Python prints")
        os.write(1, b"C++ prints\n")
        return Answer({"rows": 3}, "three rows")

    behaving(monkeypatch, noisy)
    code, out, err = glisson("techniques", "--json")
    assert code == 0
    assert json.loads(out) == {"rows": 3}
    assert all(words in err for words in ("Python prints", "C++ prints", "three rows"))
    assert glisson("techniques")[1] == "three rows\n"


def test_a_number_that_is_not_finite_is_never_printed(glisson: Spoken, monkeypatch: pytest.MonkeyPatch) -> None:
    behaving(monkeypatch, lambda lines: Answer({"rows": float("nan")}))
    code, out, _ = glisson("techniques", "--json")
    assert code == 1
    assert json.loads(out)["rows"] is None


@pytest.mark.parametrize(
    "words",
    [[], ["paint"], ["run"], ["run", "case", "--no-such-option"], ["new", "case"], ["--json"], ["techniques", "extra"]],
)
def test_wrong_usage_is_bad_input(glisson: Spoken, words: list[str]) -> None:
    code, out, err = glisson(*words, "--json")
    assert code == 2
    assert json.loads(out)["status"] == "bad_input"
    assert "--help" in err
    assert "Traceback" not in err


def test_help_and_version_go_to_stdout(glisson: Spoken) -> None:
    code, out, _ = glisson("--help")
    assert code == 0
    assert all(name in out for name in cli.COMMANDS)
    assert "not for clinical use" in " ".join(out.split())
    code, out, _ = glisson("mesh", "--help")
    assert code == 0
    assert "--mesh.edge-length-mm" in out
    assert "examples:" in out
    assert glisson("--version")[1].startswith("glisson ")


def test_a_list_that_begins_with_a_minus_is_a_value() -> None:
    assert cli._with_negative_values(["run", "c", "--seed-point", "-1,2,3", "--json", "--seed", "4"]) == [
        "run", "c", "--seed-point=-1,2,3", "--json", "--seed", "4",
    ]  # fmt: skip


def test_help_does_not_load_what_it_does_not_need() -> None:
    script = (
        "import sys; from glisson.cli.main import main; main(['--help'])\n"
        "sys.exit(any(name in sys.modules for name in ('scipy', 'numba', 'nibabel')))"
    )
    assert subprocess.run([sys.executable, "-c", script], capture_output=True, check=False).returncode == 0


def test_lines_without_a_terminal_have_no_escape_codes(capfd: pytest.CaptureFixture[str]) -> None:
    lines = StageLines()
    progress = lines.begun("simulate", "it has no result yet")
    lines._started -= 100.0
    lines._last_line -= 100.0
    progress(0.25, "stage 1: lever at [4]°")
    lines.ended("simulate", 100.0)
    err = capfd.readouterr().err
    assert "\x1b" not in err
    assert "simulate  25 % stage 1: lever at [4]°" in err


def test_a_closed_pipe_is_no_trouble() -> None:
    command = f"{sys.executable} -m glisson.cli.main --help | true; exit ${{PIPESTATUS[0]}}"
    ended = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert "Traceback" not in ended.stderr


@pytest.mark.parametrize(("words", "code"), [("--version", 0), ("paint --json", 2)])
def test_a_closed_stdout_is_no_trouble(words: str, code: int) -> None:
    command = f"{sys.executable} -m glisson.cli.main {words} >&-"
    ended = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert (ended.returncode, "Traceback" in ended.stderr) == (code, False), ended.stderr
