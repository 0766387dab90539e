"""Real data that several tests share."""

import shutil
import tarfile
from collections.abc import Iterator
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def ircad(shared_data: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Folder of 3D-IRCADb-01 case 17, unpacked (PATIENT_DICOM, MASKS_DICOM); nothing of it outlives the tests."""
    folder = tmp_path_factory.mktemp("ircad")
    for name in ("PATIENT_DICOM", "MASKS_DICOM"):
        with tarfile.open(shared_data / "research-only" / "ircadb01-case17" / f"{name}.tar.xz") as archive:
            archive.extractall(folder, filter="data")
    yield folder
    shutil.rmtree(folder)
