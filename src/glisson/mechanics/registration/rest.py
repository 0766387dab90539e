"""When a descent is over: nothing is gained any more that would count beside the noise."""

_STEPS = 6


class Rest:
    """Watches the cost (half a sum of squares of standard deviations) over the steps of one descent.

    One step that gains nothing is no sign: near to its end a descent goes to and fro over the edges between triangles.

    Args:
        least: what the last few steps must have gained together to go on.
    """

    def __init__(self, least: float) -> None:
        self._least = least
        self._costs: list[float] = []

    def reached(self, cost: float) -> bool:
        """Whether the cost after a further step is one to stay at."""
        self._costs.append(cost)
        gained = self._costs[-_STEPS - 1 : -_STEPS] or [float("inf")]
        return gained[0] - cost < self._least or (len(self._costs) > 1 and self._costs[-2] - cost < 1e-3 * self._least)
