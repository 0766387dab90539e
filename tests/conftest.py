import json
import os
import shutil
import signal
import tarfile
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parent.parent

# A test run in the background ignores Ctrl-C; the programs under test must not inherit that.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--clicks", type=int, default=2, help="random clicks into a real liver, each some 30 s")


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of the shared real data; the test is skipped where it is absent."""
    folder = Path(os.environ.get("GLISSON_SHARED_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"real data not found at {folder} (set GLISSON_SHARED_DATA)")
    return folder


@pytest.fixture(scope="session")
def ircad(shared_data: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Folder of 3D-IRCADb-01 case 17, unpacked (PATIENT_DICOM, MASKS_DICOM); nothing of it outlives the tests."""
    folder = tmp_path_factory.mktemp("ircad")
    for name in ("PATIENT_DICOM", "MASKS_DICOM"):
        with tarfile.open(shared_data / "research-only" / "ircadb01-case17" / f"{name}.tar.xz") as archive:
            archive.extractall(folder, filter="data")
    yield folder
    shutil.rmtree(folder)


@pytest.fixture(scope="session")
def meshed_small_case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small case of `small_case.py` with its model and scenario; copy it before changing it."""
    from glisson.framework.stages import PIPELINE
    from small_case import make_small_case, offer_bending

    with pytest.MonkeyPatch.context() as patch:
        offer_bending(patch)
        case = make_small_case(tmp_path_factory.mktemp("meshed") / "case")
        PIPELINE.run(case, "scenario")
    return case.folder


@contextmanager
def _memory_below(limit: float) -> Iterator[None]:
    tracemalloc.start()
    try:
        yield
        assert tracemalloc.get_traced_memory()[1] < limit
    finally:
        tracemalloc.stop()


@pytest.fixture
def memory_below() -> Callable[[float], AbstractContextManager[None]]:
    """`with memory_below(limit):` fails where the code inside holds more than so many bytes at once."""
    return _memory_below


@pytest.fixture
def glisson(capfd: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, dict[str, Any]]]:
    """The command line, run with `--json`: exit code and what it says."""
    from glisson.cli.main import main

    def run(*words: str | Path) -> tuple[int, dict[str, Any]]:
        code = main([*map(str, words), "--json"])
        out, err = capfd.readouterr()
        assert "Traceback" not in err
        return code, json.loads(out)

    return run
