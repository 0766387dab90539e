"""How much Gauss–Newton steps are damped."""

_START, _MOST = 1e-4, 1e8


class Damping:
    """Levenberg's and Marquardt's damping, which falls by as much as steps keep their promise (Nielsen 1999).

    `share` of its diagonal is to be added to the matrix of a step.
    """

    def __init__(self) -> None:
        self.share = _START
        self._growth = 2.0

    def eased(self, gained: float, promised: float) -> None:
        """A step has lowered the cost by `gained` > 0, where the quadratic model `promised` so much."""
        kept = min(gained / max(promised, 1e-300), 2.0)
        self.share *= max(1.0 / 3.0, 1.0 - (2.0 * kept - 1.0) ** 3)
        self._growth = 2.0

    def raised(self) -> bool:
        """A step has gained nothing; False where none is short enough to gain anything."""
        self.share, self._growth = self.share * self._growth, 2.0 * self._growth
        return self.share < _MOST
