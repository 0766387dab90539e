"""The bent first-order answer against closed forms."""

import numpy as np
import pytest

from glisson.mechanics.bend import Bend


@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0])
def test_a_parabola_is_met_exactly(ratio):
    """x(t) = a + b t + c t²: value and slope at 1, and the value at 1 − h, give the value at 1 + ratio · h."""
    a, b, c = np.random.default_rng(1).normal(size=(3, 7, 3))
    last, h = 1.0, 0.25

    def at(t):
        return a + b * t + c * t * t

    first_order = at(last) + ratio * h * (b + 2.0 * c * last)
    bent = Bend(ratio, at(last) - at(last - h)).bent(at(last), first_order)
    np.testing.assert_allclose(bent, at(last + ratio * h), atol=1e-12)


def test_the_error_is_of_third_order():
    """On a circle the bent answer's error falls by 8 with half the step, the first-order one's by 4."""

    def at(t):
        return np.array([[np.cos(t), np.sin(t), 0.0]])

    errors = []
    for h in (0.2, 0.1, 0.05):
        first_order = at(1.0) + h * np.array([[-np.sin(1.0), np.cos(1.0), 0.0]])
        bent = Bend(1.0, at(1.0) - at(1.0 - h)).bent(at(1.0), first_order)
        errors.append(float(np.linalg.norm(bent - at(1.0 + h))))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 3.0, atol=0.1)
