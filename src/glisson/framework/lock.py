"""One run at a time on a case.

The lock is the kernel's (`flock`), so it ends with the process that holds it: a run that was killed
leaves a file but no lock, and the next run takes over.
"""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from glisson.core.errors import BadInput

LOCK = ".lock"


@contextmanager
def exclusive(folder: Path) -> Iterator[None]:
    """Hold the lock of a case folder for the block; the lock file is gone afterwards.

    Raises:
        BadInput: another process works on the case, or the folder is read-only.
    """
    path = folder / LOCK
    descriptor = _acquire(path)
    try:
        with suppress(OSError):  # the number is for people only, and a full disk may refuse it
            os.ftruncate(descriptor, 0)
            os.write(descriptor, str(os.getpid()).encode())
        yield
    finally:
        # Removed while still held: whoever opened the old file meanwhile sees that its name is gone.
        path.unlink(missing_ok=True)
        os.close(descriptor)


def _acquire(path: Path) -> int:
    while True:
        try:
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        except OSError as error:
            raise BadInput(
                f"The case folder {path.parent} cannot be written ({error.strerror}); "
                "copy it to a place where you may write."
            ) from error
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            holder = os.read(descriptor, 32).decode("ascii", "replace").strip()
            os.close(descriptor)
            who = f"process {holder}" if holder else "another process"
            raise BadInput(f"The case {path.parent} is being worked on by {who}; wait until it ends.") from None
        if _is_still_named(descriptor, path):
            return descriptor
        os.close(descriptor)


def _is_still_named(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except FileNotFoundError:
        return False
