"""Colours of crosses that are not mistaken for each other."""

from functools import cache
from itertools import product

from glisson.core.crosses import readings
from glisson.core.marker_colours import MARKER_COLOURS

Code = tuple[str, str, str, str, str]


@cache
def cross_codes() -> tuple[Code, ...]:
    """Colours in the order of `Cross.colours` of crosses that differ in two squares at least.

    They do so turned and mirrored, and each from itself turned or mirrored: one square misread makes no other cross.
    """
    chosen: list[Code] = []
    for code in product(MARKER_COLOURS, repeat=5):
        turned, mirrored = readings(code), readings(code, mirrored=True)
        own = min(_difference(code, other) for other in [*turned[1:], *mirrored])
        if own >= 2 and all(_difference(other, view) >= 2 for other in chosen for view in [*turned, *mirrored]):
            middle, right, below, left, above = code
            chosen.append((middle, right, below, left, above))
    return tuple(chosen)


def _difference(one: tuple[str, ...], other: tuple[str, ...]) -> int:
    return sum(a != b for a, b in zip(one, other, strict=True))
