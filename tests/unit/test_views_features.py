"""Features and tips that are found in rendered pictures, against where they truly are."""

import numpy as np
import pytest

from glisson.core import StageFailed, Status
from glisson.core.camera import Camera
from glisson.core.views import Sightings, View, ViewSet
from glisson.geometry.distance import closest_points
from glisson.intraoperative.views.bundle import Bundle
from glisson.intraoperative.views.features import SIGMA_PX, match_features
from glisson.intraoperative.views.parameters import ReconstructionParameters
from glisson.intraoperative.views.tip import find_tip
from glisson.phantom.half_sphere_box import (
    CAMERA,
    POSITIONS_DEG,
    TOUCHED_MM,
    HalfSphereBox,
    pixels_of,
    scope_place,
    touching_tool,
)
from glisson.phantom.laparoscope_view import Place, Tool, picture_through
from glisson.phantom.liver_view import liver_scene, places_about
from glisson.phantom.measured_views import TROCAR, ViewNoise, measured_pose, measured_views
from glisson.phantom.optics import ray_slopes, seen_at

NOISE = ViewNoise(position_mm=0.08, direction_deg=0.16, roll_deg=0.16, touched_mm=0.08)
ANGLES = (POSITIONS_DEG[0], POSITIONS_DEG[3])


def seen_on(scene, camera, place, pixels):
    """The points (n, 3) that pixels show."""
    rays = np.column_stack([ray_slopes(camera, pixels), np.ones(len(pixels))])
    rays = rays / np.linalg.norm(rays, axis=1, keepdims=True) @ place.rotation.T
    return place.centre_mm + scene.hits(place.centre_mm, rays)[0][:, None] * rays


@pytest.fixture(scope="module")
def pictures():
    return [
        picture_through(
            CAMERA, scope_place(angle), HalfSphereBox(), touching_tool(), np.random.default_rng([8, number])
        )
        for number, angle in enumerate(ANGLES)
    ]


@pytest.mark.parametrize("noise", [NOISE, TROCAR])
def test_features_are_matched_to_a_fraction_of_a_pixel(pictures, noise):
    views = measured_views(ANGLES, noise, np.random.default_rng(1)).views
    found = match_features(pictures, views)
    assert found.count >= 120
    first, second = (found.pixels[found.view == number] for number in (0, 1))
    points = seen_on(HalfSphereBox(), CAMERA, scope_place(ANGLES[0]), first)
    off = np.abs(second - pixels_of(scope_place(ANGLES[1]), points)).max(axis=1)
    # What a robust adjustment lives with: most are as good as said, few are wrong.
    assert np.median(off) < SIGMA_PX * 1.2
    assert (off > 1.0).mean() < 0.1


def test_tips_are_found(pictures):
    for picture, angle in zip(pictures, ANGLES, strict=True):
        (truth,) = pixels_of(scope_place(angle), TOUCHED_MM[None])
        assert np.linalg.norm(find_tip(picture) - truth) < 3.0


def test_a_picture_without_a_tool_or_with_two_is_refused(pictures):
    nothing = np.tile(np.array([150, 60, 50], dtype=np.uint8), (270, 360, 1))
    with pytest.raises(StageFailed, match="No tool's shaft was recognised") as refused:
        find_tip(nothing)
    assert refused.value.status is Status.AMBIGUOUS
    two = nothing.copy()
    two[100:120, :150] = two[200:220, 250:] = 160
    with pytest.raises(StageFailed, match="2 tools"):
        find_tip(two)


def test_nothing_is_matched_between_pictures_of_different_things(pictures):
    views = measured_views(ANGLES, NOISE, np.random.default_rng(1)).views
    noise = np.random.default_rng(0).integers(0, 255, pictures[0].shape).astype(np.uint8)
    assert match_features([pictures[0], noise], views).count < 12
    assert match_features([np.zeros_like(noise), pictures[1]], views).count == 0


def test_a_livers_surface_from_two_rendered_views():
    """All the way from pixels, on a curved surface that the adjustment knows nothing of."""
    camera = Camera(720, 540, np.array([625.0, 625.0]), np.array([356.0, 274.0]), np.array([-0.2, 0.05, 0.0, 0.0, 0.0]))
    scene = liver_scene(3)
    vertices = np.asarray(scene.surface.vertices)
    target = vertices[vertices[:, 1].argmin()]
    places = places_about(target, 110.0, np.array([0.0, 10.0]))
    (tip,) = seen_on(scene, camera, places[0], np.array([[300.0, 330.0]]))
    tool = Tool(tip, np.array([0.7, -0.6, -0.4]))
    rng = np.random.default_rng(4)
    pictures = [picture_through(camera, place, scene, tool, rng) for place in places]
    views = tuple(
        View(f"view {number}", camera, measured_pose(place, NOISE, rng), _seen(camera, place, tip, rng))
        for number, place in enumerate(places, start=1)
    )
    features = match_features(pictures, views)
    touched = tip + NOISE.touched_mm * rng.standard_normal(3)
    given = ViewSet(views, touched, NOISE.touched_mm**2 * np.eye(3), 1.0, (), Sightings.none(), features)
    found = Bundle(ReconstructionParameters()).reconstruct(given)
    assert found.status is Status.CONVERGED
    (surface,) = [item for item in found.observations.items if item.name == "features"]
    off, _ = closest_points(surface.points_mm, scene.surface)
    assert len(off) > 60
    # All points share the poses' error, so one draw has them off together; its error bars say how far.
    longest = np.sqrt(np.linalg.eigvalsh(surface.covariance_mm2)[:, -1])
    assert np.median(longest) < 1.0
    assert (off < 3.0 * longest).mean() > 0.97


def _seen(camera: Camera, place: Place, point: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return seen_at(camera, (point[None] - place.centre_mm) @ place.rotation)[0] + rng.standard_normal(2)
