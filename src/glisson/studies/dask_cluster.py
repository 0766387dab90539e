"""A Dask cluster: the points go to its workers, the outcomes come back; the store stays here.

Dask (`dask.distributed`) is optional: `pip install glisson[dask]`.
"""

import time
from importlib.util import find_spec
from typing import Any

from glisson.core.errors import BadInput
from glisson.studies.evaluation import UnfitWorker, Work, evaluate
from glisson.studies.point import Outcome

_CONNECTING_S = 10.0
_POLL_S = 0.05


class DaskCluster:
    """An `Executor` on the cluster whose scheduler is at `address`.

    Raises:
        BadInput: Dask is not installed, or no scheduler answers.
    """

    def __init__(self, address: str) -> None:
        if find_spec("distributed") is None:
            raise BadInput("--scheduler needs Dask; install it with: pip install 'glisson[dask]'")
        import distributed

        try:
            self._client = distributed.Client(address, timeout=_CONNECTING_S, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise BadInput(
                f"No Dask scheduler answers at {address} ({error}); start one with: dask scheduler"
            ) from error
        self._futures: dict[str, Any] = {}

    @property
    def capacity(self) -> int:
        """Number of the cluster's workers, at least one (the points wait for a first one).

        Raises:
            UnfitWorker: a worker computes several points in one process, which the solver cannot.
        """
        threads = self._client.nthreads()
        if any(count > 1 for count in threads.values()):
            raise UnfitWorker("A Dask worker has several threads; start the workers with: dask worker --nthreads 1")
        return max(1, len(threads))

    @property
    def threads(self) -> int:
        """One: who wants more of a machine starts more workers there."""
        return 1

    def submit(self, key: str, work: Work) -> None:
        """Begin a point."""
        # Not pure: what the cluster still remembers of an earlier run does not count, only our store does.
        self._futures[key] = self._client.submit(evaluate, work, pure=False)

    def finished(self, timeout: float) -> list[tuple[str, Outcome]]:
        """Points that have ended."""
        end = time.monotonic() + timeout
        while not (ended := [key for key, future in self._futures.items() if future.done()]):
            if time.monotonic() >= end:
                return []
            time.sleep(_POLL_S)
        found = [(key, _outcome(self._futures[key])) for key in ended]
        for key in ended:
            del self._futures[key]
        return found

    def close(self) -> None:
        """Give up what is being computed, and leave the cluster; its workers stay."""
        if self._client.status == "running":
            self._client.cancel(list(self._futures.values()), force=True)
            self._client.close()
        self._futures.clear()


def _outcome(future: Any) -> Outcome:
    if future.status == "finished":
        outcome: Outcome = future.result()
        return outcome
    error = future.exception() if future.status == "error" else None
    if isinstance(error, UnfitWorker):
        raise error
    if type(error).__name__ == "KilledWorker":
        return Outcome(status=None, message="Its workers ended again and again, probably for want of memory.")
    raise UnfitWorker(f"The Dask cluster gave a point up ({future.status}: {error}).")
