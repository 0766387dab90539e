"""Files that appear whole or not at all: written beside their place, flushed to the disk, then renamed into it."""

import errno
import os
import shutil
import uuid
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from glisson.core import BadInput, GlissonError

_FULL = {errno.ENOSPC, errno.EDQUOT}


class WriteFailed(GlissonError):
    """The disk would not take a file; what was there before is untouched. The CLI exits with 1."""

    exit_code = 1


@contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """A temporary sibling with the same suffixes, renamed over `path` when the block ends well.

    On any exception, KeyboardInterrupt included, the temporary file is removed and `path` stays as it was.
    Missing parent folders are made.

    Raises:
        BadInput: nothing can be written there.
        WriteFailed: the disk is full or failing.
    """
    with atomic_paths(path) as temporaries:
        yield temporaries[0]


@contextmanager
def atomic_paths(*paths: str | Path) -> Iterator[tuple[Path, ...]]:
    """Several files that belong together: none is renamed before all are complete and on the disk.

    An interruption between the renames puts the old files back.

    Raises:
        BadInput: nothing can be written there.
        WriteFailed: the disk is full or failing.
    """
    # A link stays a link: the file that it names is replaced.
    targets = [Path(os.path.realpath(path)) for path in paths]
    temporaries = tuple(_sibling(target) for target in targets)
    try:
        with _writing_to(targets[0]):
            for target, temporary in zip(targets, temporaries, strict=True):
                _claim(target, temporary)
            yield temporaries
            for temporary in temporaries:
                _flush(temporary)
            _replace_together(targets, temporaries)
            _flush_folders({target.parent for target in targets})
    finally:
        for temporary in temporaries:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)


@contextmanager
def atomic_folder(path: str | Path) -> Iterator[Path]:
    """A temporary sibling folder that takes the place of `path` when the block ends well.

    A folder that was there is replaced whole. Between the two renames that this needs nothing is lost:
    an interruption there puts the old folder back.

    Raises:
        BadInput: nothing can be written there.
        WriteFailed: the disk is full or failing.
    """
    target = Path(os.path.realpath(path))
    temporary, previous = _sibling(target), _sibling(target)
    try:
        with _writing_to(target):
            try:
                temporary.mkdir(parents=True)
            except OSError as error:
                raise _refusal(target, error) from error
            yield temporary
            for entry in temporary.rglob("*"):
                if entry.is_file():
                    _flush(entry)
            _swap(target, temporary, previous)
            _flush_folders({target.parent})
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        if target.exists():
            shutil.rmtree(previous, ignore_errors=True)


def _replace_together(targets: Sequence[Path], temporaries: Sequence[Path]) -> None:
    if len(targets) == 1:
        os.replace(temporaries[0], targets[0])
        return
    previous = [_sibling(target) for target in targets]
    existed = [target.exists() for target in targets]
    try:
        for target, kept, exists in zip(targets, previous, existed, strict=True):
            if exists:
                shutil.copy2(target, kept)
        for target, temporary in zip(targets, temporaries, strict=True):
            os.replace(temporary, target)
    except BaseException:
        for target, kept, temporary, exists in zip(targets, previous, temporaries, existed, strict=True):
            if temporary.exists():
                continue  # its turn had not come
            if exists:
                os.replace(kept, target)
            else:
                target.unlink(missing_ok=True)
        raise
    finally:
        for kept in previous:
            kept.unlink(missing_ok=True)


def _swap(target: Path, temporary: Path, previous: Path) -> None:
    try:
        if target.exists():
            os.replace(target, previous)
        os.replace(temporary, target)
    except BaseException:
        if previous.exists() and not target.exists():
            os.replace(previous, target)
        raise


def _sibling(target: Path) -> Path:
    # Hidden, so that no reader of the folder takes it for data; the suffixes stay, writers go by them.
    return target.with_name(f".{uuid.uuid4().hex[:8]}-partial-{target.name}")


def _claim(target: Path, temporary: Path) -> None:
    if target.is_dir():
        raise BadInput(f"{target} is a folder, so no file of this name can be written.")
    try:
        temporary.parent.mkdir(parents=True, exist_ok=True)
        temporary.touch(exist_ok=False)
    except OSError as error:
        raise _refusal(target, error) from error


def _flush(path: Path) -> None:
    # Only a flushed file may be renamed: otherwise a power cut could leave the new name with old emptiness.
    if path.is_dir() and os.name == "nt":
        return
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _flush_folders(folders: set[Path]) -> None:
    # The files are in place; some network file systems only cannot flush a folder.
    for folder in folders:
        with suppress(OSError):
            _flush(folder)


@contextmanager
def _writing_to(target: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        if error.errno in _FULL:
            raise _refusal(target, error) from error
        # Whatever else the system refuses (an input/output error, a quota on sizes) is a failure of writing too.
        raise WriteFailed(f"{target} was not written: {error.strerror or error}.") from error


def _refusal(target: Path, error: OSError) -> GlissonError:
    if error.errno in _FULL:
        return WriteFailed(f"The disk is full: {target} was not written; free some space and run again.")
    return BadInput(f"{target} cannot be written: {error.strerror or error}.")
