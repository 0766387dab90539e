"""The same all the way from pixels: rendered views, features matched and the tip found in them, landmarks clicked."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.views import Sightings, ViewSet
from glisson.intraoperative.views.bundle import Bundle
from glisson.intraoperative.views.features import match_features
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
from glisson.phantom.laparoscope_view import Place, picture_through
from glisson.phantom.measured_views import ViewNoise, measured_views
from glisson.phantom.optics import ray_slopes
from glisson.studies.point import Outcome, Task
from glisson.studies.surface.tasks import NO_LIMIT, PAIRS, scored

PIXELS = Task(
    f"{__name__}:from_pixels",
    ("glisson.core", "glisson.intraoperative.cameras.projection", "glisson.intraoperative.views",
     "glisson.phantom.half_sphere_box", "glisson.phantom.laparoscope_view",
     "glisson.phantom.measured_views", "glisson.phantom.optics", "glisson.phantom.photograph",
     "glisson.phantom.texture", "glisson.studies.surface.tasks", __name__),
)  # fmt: skip

_TIP_PX = 1.5
_OUTLIER_PX = 1.0


def from_pixels(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """A row for each pair of one draw: the joint adjustment's score, and how near tip and features are to the truth."""
    noise, seed = ViewNoise(**inputs["noise"]), inputs["seed"]
    rng = np.random.default_rng((inputs["stream"], seed, 5))
    box = HalfSphereBox(seed)
    places = [scope_place(angle) for angle in POSITIONS_DEG]
    pictures = [picture_through(CAMERA, place, box, touching_tool(), rng) for place in places]
    rows = [
        {"seed": seed, "views": name} | _row(other, noise, pictures, places, box, (inputs["stream"], seed))
        for name, other in PAIRS.items()
    ]
    return Outcome({"rows": rows})


def _row(
    other: int,
    noise: ViewNoise,
    pictures: list[NDArray[np.uint8]],
    places: list[Place],
    box: HalfSphereBox,
    seed: tuple[int, int],
) -> dict[str, Any]:
    angles = (POSITIONS_DEG[0], POSITIONS_DEG[other])
    drawn = measured_views(angles, noise, np.random.default_rng(seed), features=0)
    pair, seen_from = (pictures[0], pictures[other]), (places[0], places[other])
    try:
        tips = [find_tip(picture) for picture in pair]
    except StageFailed as error:
        return {"way": Bundle.name, "message": str(error)}
    views = tuple(replace(view, tip_px=tip) for view, tip in zip(drawn.views, tips, strict=True))
    features = match_features(pair, views)
    given = ViewSet(
        views, drawn.touched_mm, drawn.touched_covariance_mm2, _TIP_PX, drawn.names, drawn.landmarks, features
    )
    truth = [pixels_of(place, TOUCHED_MM[None])[0] for place in seen_from]
    off = _feature_errors(features, seen_from, box)
    near = np.abs(off).max(axis=1, initial=0.0) < _OUTLIER_PX
    return scored(Bundle(NO_LIMIT), given) | {
        "message": "",
        "tip_px": float(np.linalg.norm(np.array(tips) - truth, axis=1).max()),
        "features": len(off),
        "feature_px": float(off[near].std()) if near.any() else None,
        "feature_outliers": float(1.0 - near.mean()) if len(near) else None,
    }


def _feature_errors(features: Sightings, places: tuple[Place, Place], box: HalfSphereBox) -> FloatArray:
    """How far (n, 2) px features of the second view lie from where the first view's ones truly are."""
    first, second = (features.pixels[features.view == number] for number in (0, 1))
    slopes = ray_slopes(CAMERA, first)
    rays = np.concatenate([slopes, np.ones((len(slopes), 1))], axis=1)
    rays = rays / np.linalg.norm(rays, axis=1, keepdims=True) @ places[0].rotation.T
    far, _ = box.hits(places[0].centre_mm, rays)
    off: FloatArray = second - pixels_of(places[1], places[0].centre_mm + far[:, None] * rays)
    return off
