from itertools import pairwise

import numpy as np
import pytest
from blocks import sphere

from glisson.core import Lever, TriangleSurface
from glisson.navigation.figures.colours import displacement_colours
from glisson.navigation.rendering.bodies import Body
from glisson.navigation.rendering.camera import framing
from glisson.navigation.rendering.ray_casting import cast
from glisson.navigation.rendering.shapes import lever_bar, patch, tube


def ball(centre, radius, **look) -> Body:
    surface = sphere(centre, radius, level=4)
    return Body(surface.vertices, surface.triangles, ink=False, **look)


def camera_on(body, forward=(1.0, 2.0, -0.5), size=(300, 240)):
    return framing(body.vertices, forward, (0.0, -1.0, 0.0), size)


def test_a_ball_covers_its_disc_at_its_place():
    body = ball([20.0, -10.0, 5.0], 30.0, colour=(0.1, 0.2, 0.3))
    camera = camera_on(body)
    covered = 1.0 - (cast([body], camera).min(axis=2) == 255)
    assert covered.sum() * camera.mm_per_pixel**2 == pytest.approx(np.pi * 30.0**2, rel=0.02)
    rows, columns = np.nonzero(covered)
    place = camera.pixels([[20.0, -10.0, 5.0]])[0]
    assert (columns.mean() + 0.5, rows.mean() + 0.5) == pytest.approx(tuple(place), abs=0.5)


def test_up_is_up_and_the_scale_is_true():
    body = ball([0.0, 0.0, 0.0], 10.0)
    camera = camera_on(body, forward=(0.0, 0.0, 1.0))
    (x, y), (right, _), (_, top) = camera.pixels([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, -5.0, 0.0]])
    assert right - x == pytest.approx(5.0 / camera.mm_per_pixel)  # seen from the feet, the patient's left is right
    assert y - top == pytest.approx(5.0 / camera.mm_per_pixel)


def test_the_nearer_body_hides_the_farther_whatever_their_order():
    near, far = (
        ball([0.0, 0.0, -50.0], 10.0, colour=(1.0, 0.0, 0.0)),
        ball([0.0, 0.0, 0.0], 20.0, colour=(0.0, 0.0, 1.0)),
    )
    camera = camera_on(far, forward=(0.0, 0.0, 1.0))
    pictures = [cast(order, camera) for order in ([near, far], [far, near])]
    assert np.array_equal(*pictures)
    middle = pictures[0][120, 150].astype(int)
    assert middle[0] > 150
    assert middle[2] < 60


def test_a_transparent_sheet_mixes_by_its_opacity():
    u, v = np.array([10.0, 0.0, 0.0]), np.array([0.0, 10.0, 0.0])
    sheets = [
        Body(*patch(np.array([0.0, 0.0, z]), u, v), colour, opacity, smooth=False, inner=True, ink=False)
        for z, colour, opacity in ((-5.0, (0.9, 0.2, 0.1), 0.25), (5.0, (0.1, 0.4, 0.8), 1.0))
    ]
    camera = framing(sheets[0].vertices, (0.0, 0.0, 1.0), (0.0, -1.0, 0.0), (60, 60))
    single = []
    for sheet in sheets:
        opaque = Body(sheet.vertices, sheet.triangles, sheet.colour, 1.0, smooth=False, inner=True, ink=False)
        single.append(cast([opaque], camera)[30, 30].astype(float))
    both = cast(sheets, camera)[30, 30]
    np.testing.assert_allclose(both, 0.25 * single[0] + 0.75 * single[1], atol=1.0)


def test_values_are_coloured_in_every_pixel():
    vertices, triangles = patch(np.zeros(3), np.array([10.0, 0.0, 0.0]), np.array([0.0, 10.0, 0.0]), steps=1)
    split = Body(
        vertices,
        triangles,
        smooth=False,
        inner=True,
        ink=False,
        values=vertices[:, 0],
        palette=lambda x: np.where(x[:, None] > 2.0, np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])),
    )
    camera = framing(vertices, (0.0, 0.0, 1.0), (0.0, -1.0, 0.0), (100, 100), border=0.0)
    row = cast([split], camera)[50]
    assert np.flatnonzero(row[:, 0] > row[:, 1])[0] == pytest.approx(60, abs=1)  # x = 2 of −10 … 10


def test_the_lever_has_its_size_and_turns_towards_up():
    lever = Lever.lifting("lever", [1.0, 2.0, 3.0], np.array([1.0, 0.0, 0.0]), np.array([0.0, -1.0, 0.0]))
    vertices, triangles = lever_bar(lever, 0.0)
    bar = TriangleSurface(vertices, triangles)
    assert bar.is_closed
    a, b, c, r = 144.0, 19.0, 2.0, 3.0  # Steiner's formula for a box with rounded edges
    volume = a * b * c + 2 * r * (a * b + b * c + c * a) + np.pi * r**2 * (a + b + c) + 4 / 3 * np.pi * r**3
    assert bar.volume_mm3 == pytest.approx(volume, rel=0.02)
    np.testing.assert_allclose(vertices.min(axis=0), [1.0, 2.0, 3.0 - 12.5], atol=1e-9)  # up is −y: the top is y = 2
    np.testing.assert_allclose(vertices.max(axis=0), [151.0, 10.0, 3.0 + 12.5], atol=1e-9)
    turned, _ = lever_bar(lever, 30.0)
    tip = turned[np.argmax(turned[:, 0])]
    assert tip[1] == pytest.approx(2.0 - 150.0 * np.sin(np.radians(30.0)), abs=9.0)


def test_a_tube_keeps_its_radius():
    points = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 10.0, 0.0]])
    vertices, _ = tube(points, 2.0)
    distance = np.min(
        [
            np.linalg.norm(vertices - np.clip(vertices, np.minimum(a, b), np.maximum(a, b)), axis=1)
            for a, b in pairwise(points)
        ],
        axis=0,
    )
    assert distance.max() <= 2.0 + 1e-9


def test_displacement_colours_grow_lighter_steadily():
    """So that the scale reads in print and with any colour vision (relative luminance, WCAG 2)."""
    colours = displacement_colours(30.0)(np.linspace(0.0, 30.0, 40))
    linear = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    assert np.all(np.diff(linear @ [0.2126, 0.7152, 0.0722]) > 0.0)
