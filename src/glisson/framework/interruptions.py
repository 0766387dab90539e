"""Moments in which Ctrl-C must wait."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def interruptions_held() -> Iterator[None]:
    """Ctrl-C and SIGTERM during the block come at its end; a process that starts meanwhile never sees a Ctrl-C.

    Some libraries take an interruption while they are loaded for a part that is missing, and go on.

    Raises:
        KeyboardInterrupt: at the end, when there was one and it is not dealt with otherwise.
    """
    if threading.current_thread() is not threading.main_thread():  # only that one is ever interrupted
        yield
        return
    held: list[int] = []

    def hold(number: int, frame: FrameType | None) -> None:
        held.append(number)

    # Signals reach whichever thread takes them, so a mask alone would not do; new processes inherit the mask.
    kinds = (signal.SIGINT, signal.SIGTERM)
    handlers = [signal.signal(kind, hold) for kind in kinds]
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        for kind, handler in zip(kinds, handlers, strict=True):
            signal.signal(kind, handler)
    if held:
        signal.raise_signal(held[0])
