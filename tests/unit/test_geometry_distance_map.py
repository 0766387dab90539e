"""Distance maps against SciPy's, on random masks of two and three dimensions."""

import numpy as np
import pytest
from scipy import ndimage

from glisson.geometry.distance_map import distance_inside


@pytest.mark.parametrize("shape", [(20, 30, 40), (1, 50, 3), (33, 47)])
@pytest.mark.parametrize("share", [0.02, 0.5, 0.95])
def test_distances_are_those_of_scipy(shape: tuple[int, ...], share: float) -> None:
    random = np.random.default_rng(3)
    mask, spacing = random.random(shape) < share, random.uniform(0.5, 3.0, len(shape))
    assert np.allclose(
        distance_inside(mask, spacing), ndimage.distance_transform_edt(mask, sampling=spacing), atol=1e-4
    )


def test_where_nothing_is_outside_it_is_infinitely_far() -> None:
    assert np.isinf(distance_inside(np.ones((3, 4, 5), dtype=bool), np.ones(3))).all()
    assert not distance_inside(np.zeros((3, 4), dtype=bool), np.ones(2)).any()
