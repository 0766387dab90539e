"""Files and folders that appear in a case together, or not at all."""

import os
from collections.abc import Sequence
from pathlib import Path


def put_in_place(moves: Sequence[tuple[Path, Path]], work: Path) -> None:
    """Rename files and folders to their places, all or none; what lay there goes into `work`."""
    for source, _ in moves:
        for entry in (source, *source.rglob("*")):
            _flush(entry)
    undo: list[tuple[Path, Path]] = []
    try:
        for number, (source, place) in enumerate(moves):
            place.parent.mkdir(parents=True, exist_ok=True)
            aside = work / f"replaced-{number}"
            for here, there in ((place, aside), (source, place)):
                if here.exists():
                    undo.append((there, here))
                    os.replace(here, there)
    except BaseException:
        for here, there in reversed(undo):
            if here.exists():
                os.replace(here, there)
        raise


def _flush(path: Path) -> None:
    # Without this a power cut could leave a new name with nothing in it; a full disk shows here at the latest.
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
