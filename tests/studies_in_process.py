"""An executor without processes, so that tests can put something in the solver's place."""

from glisson.studies.evaluation import Work, evaluate
from glisson.studies.point import Outcome


class InThisProcess:
    """Computes a point when it is asked for."""

    capacity, threads = 1, 1

    def __init__(self, size: int | None = None) -> None:
        self._done: list[tuple[str, Outcome]] = []

    def submit(self, key: str, work: Work) -> None:
        self._done.append((key, evaluate(work)))

    def finished(self, timeout: float) -> list[tuple[str, Outcome]]:
        done, self._done = self._done, []
        return done

    def close(self) -> None:
        pass
