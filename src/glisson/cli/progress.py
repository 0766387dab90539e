"""Shows the pipeline's stages on stderr: a moving bar on a terminal, plain lines elsewhere."""

import sys
import time

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

QUIET_SECONDS = 2.0
"""Work that is shorter needs no bar."""

_LINE_EVERY_SECONDS = 15.0


class StageLines:
    """A pipeline listener: one line for each stage, and between them how far it is."""

    def __init__(self) -> None:
        self._console = Console(file=sys.stderr, highlight=False, soft_wrap=True)
        self._shown: Progress | None = None
        self._started = 0.0
        self._last_line = 0.0
        self.stage: str | None = None
        """The stage that runs now, or ran last."""

    def begun(self, stage: str, reason: str) -> "StageLines":
        """A stage starts."""
        self.stage = stage
        self._started = self._last_line = time.monotonic()
        self._console.print(f"{stage:9s} running, because {reason}", markup=False)
        return self

    def ended(self, stage: str, seconds: float) -> None:
        """A stage ended well."""
        self.close()
        self._console.print(f"{stage:9s} {seconds:.1f} s", markup=False)

    def skipped(self, stage: str, reason: str) -> None:
        """A stage need not run."""
        self._console.print(f"{stage:9s} skipped, because {reason}", markup=False)

    def __call__(self, fraction: float | None, message: str) -> None:
        """How far the stage is."""
        now = time.monotonic()
        if now - self._started < QUIET_SECONDS:
            return
        if self._console.is_terminal:
            self._show(fraction, message)
        elif now - self._last_line > _LINE_EVERY_SECONDS:
            self._last_line = now
            share = "" if fraction is None else f" {100.0 * fraction:.0f} %"
            self._console.print(f"{self.stage:9s}{share} {message}", markup=False)

    def close(self) -> None:
        """Take the bar away."""
        if self._shown is not None:
            self._shown.stop()
            self._shown = None

    def _show(self, fraction: float | None, message: str) -> None:
        if self._shown is None:
            columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
            self._shown = Progress(*columns, console=self._console, transient=True)
            self._shown.add_task("", total=1.0)
            self._shown.start()
        task = self._shown.tasks[0].id
        self._shown.update(task, total=None if fraction is None else 1.0, completed=fraction, description=message)
