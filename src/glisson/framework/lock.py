"""One run at a time on a case, one process at a time on a part of a study.

The locks are the kernel's (`flock`), so they end with the process that holds them: a run that was killed
leaves a file but no lock, and the next run takes over.
"""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from glisson.core.errors import BadInput

LOCK = ".lock"


class Claim:
    """A lock that is held until `release`; its file is gone afterwards."""

    def __init__(self, path: Path, descriptor: int) -> None:
        self._path, self._descriptor = path, descriptor

    def release(self) -> None:
        """Give the lock back; once."""
        # Removed while still held: whoever opened the old file meanwhile sees that its name is gone.
        self._path.unlink(missing_ok=True)
        os.close(self._descriptor)


@contextmanager
def exclusive(folder: Path) -> Iterator[None]:
    """Hold the lock of a case folder for the block; the lock file is gone afterwards.

    Raises:
        BadInput: another process works on the case, or the folder is read-only.
    """
    path = folder / LOCK
    try:
        claim = try_claim(path)
    except OSError as error:
        raise BadInput(
            f"The case folder {folder} cannot be written ({error.strerror}); copy it to a place where you may write."
        ) from error
    if claim is None:
        holder = _holder(path)
        who = f"process {holder}" if holder else "another process"
        raise BadInput(f"The case {folder} is being worked on by {who}; wait until it ends.")
    try:
        yield
    finally:
        claim.release()


def try_claim(path: Path) -> Claim | None:
    """Lock a file, which is made; None where another process holds it.

    Raises:
        OSError: the file cannot be made.
    """
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(descriptor)
            return None
        if _is_still_named(descriptor, path):
            break
        os.close(descriptor)
    with suppress(OSError):  # the number is for people only, and a full disk may refuse it
        os.ftruncate(descriptor, 0)
        os.write(descriptor, str(os.getpid()).encode())
    return Claim(path, descriptor)


def _holder(path: Path) -> str:
    try:
        return path.read_text(encoding="ascii", errors="replace").strip()
    except OSError:  # it ended just now
        return ""


def _is_still_named(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except FileNotFoundError:
        return False
