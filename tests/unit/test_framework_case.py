import os
import shutil
import signal
from pathlib import Path
from types import SimpleNamespace

import pytest

from glisson.core.errors import BadInput
from glisson.framework import settings_file
from glisson.framework.case import SCAN, SETTINGS, Case, new_case, open_case
from glisson.framework.interruptions import interruptions_held
from glisson.framework.lock import LOCK, exclusive
from glisson.framework.settings import PlaneSettings, Settings


@pytest.fixture(autouse=True)
def _no_techniques(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the file says of the techniques' parameters does not matter here."""
    monkeypatch.setattr(settings_file, "technique_class", lambda kind, name: SimpleNamespace(Parameters=PlaneSettings))


@pytest.fixture
def case(tmp_path: Path) -> Case:
    with new_case(tmp_path / "case", Settings()) as making:
        (making / SCAN).parent.mkdir()
        (making / SCAN).write_bytes(b"scan")
    return open_case(tmp_path / "case")


def test_a_new_case_opens_with_the_settings_it_was_made_with(case: Case) -> None:
    assert case.settings() == Settings()
    assert case.has(SCAN)
    assert sorted(p.name for p in case.folder.parent.iterdir()) == ["case"]


def test_a_case_that_fails_while_it_is_made_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), new_case(tmp_path / "case", Settings()):
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []


def test_an_existing_folder_is_never_overwritten(case: Case) -> None:
    with pytest.raises(BadInput, match="exists already"), new_case(case.folder, Settings()):
        pass
    assert case.has(SCAN)


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda f: shutil.rmtree(f), "There is no case folder"),
        (lambda f: (f / SETTINGS).unlink(), "not a case folder"),
        (lambda f: (f / SETTINGS).write_text("schema = 2\n"), "written by a newer Glisson"),
        (lambda f: (f / SETTINGS).write_text(""), "needs a line 'schema = 1'"),
        (lambda f: (f / SETTINGS).write_text("schema = true\n"), "needs a line 'schema = 1'"),
        (lambda f: (f / SETTINGS).write_text("schema = 1\n[mesh\n"), "half-written or damaged"),
        (lambda f: (f / SETTINGS).write_bytes(b"schema = 1\n\xff\xfe"), "half-written or damaged"),
        (lambda f: (f / SCAN).unlink(), "incomplete"),
    ],
)
def test_a_folder_that_is_no_good_case_is_refused_in_one_sentence(case: Case, damage: object, words: str) -> None:
    damage(case.folder)  # type: ignore[operator]
    with pytest.raises(BadInput, match=words) as caught:
        open_case(case.folder)
    assert "\n" not in str(caught.value)


def test_a_read_only_case_is_refused_before_anything_runs(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    # Root may write anywhere, so that the permission is taken away where it is asked for.
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with pytest.raises(BadInput, match="read-only"):
        case.check_writable()


def test_two_runs_on_one_case_do_not_mix(case: Case) -> None:
    with exclusive(case.folder):
        with pytest.raises(BadInput, match=f"worked on by process {os.getpid()}"), exclusive(case.folder):
            pass
        assert (case.folder / LOCK).exists()
    assert not (case.folder / LOCK).exists()


def test_the_lock_of_a_killed_run_is_taken_over(case: Case) -> None:
    child = os.fork()
    if child == 0:
        with exclusive(case.folder):
            os._exit(9)
    os.waitpid(child, 0)
    assert (case.folder / LOCK).exists()
    with exclusive(case.folder):
        assert (case.folder / LOCK).read_text() == str(os.getpid())


@pytest.mark.parametrize("signalled", [signal.SIGINT, signal.SIGTERM])
def test_an_interruption_that_is_held_comes_at_the_end(signalled: signal.Signals) -> None:
    """As the command line has it, where both signals are an interruption."""
    before = signal.signal(signalled, signal.default_int_handler)
    done = []

    def interrupted() -> None:
        with interruptions_held():
            os.kill(os.getpid(), signalled)
            sum(range(100_000))
            done.append("all of it")

    try:
        with pytest.raises(KeyboardInterrupt):
            interrupted()
        assert done
        assert signal.getsignal(signalled) is signal.default_int_handler
    finally:
        signal.signal(signalled, before)
