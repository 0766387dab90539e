"""Where points are computed: the seam between the runner and processes or a cluster."""

from typing import Protocol

from glisson.studies.evaluation import Work
from glisson.studies.point import Outcome


class Executor(Protocol):
    """Computes points side by side."""

    @property
    def capacity(self) -> int:
        """How many points are worked on at the same time; it may change."""

    @property
    def threads(self) -> int:
        """Threads that each point may use."""

    def submit(self, key: str, work: Work) -> None:
        """Begin a point."""

    def finished(self, timeout: float) -> list[tuple[str, Outcome]]:
        """Points that have ended since the last call, with their keys; waits up to `timeout` seconds for one.

        Raises:
            UnfitWorker: a worker cannot compute points at all.
        """

    def close(self) -> None:
        """Give up what is being computed and end the workers, or leave the cluster's in peace."""
